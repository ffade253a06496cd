"""The background from the reflectors' own assets: a camera's rays instead of mirrored ones [yu-2005 section 6, end].

Problem. Around its reflectors a picture shows the scene itself, which must be drawn by something else.
Idea. What answers rays from all over a box answers a camera's in it, too: "replacing the reflected direction with the viewing
direction at each pixel and taking the viewpoint as the origin of the ray". A method that can do it has `holds(asset, points)
-> (N,) bool`: from which places any ray is answered.
Limits. One asset answers for a whole picture, the first that can. What a bake leaves out (its reflectors) is not to be seen in
it, and of the reflectors only what they mirror is drawn over it: metals are whole, others lack their own colour.
"""

from . import methods
from .asset import Asset, asset_of
from .camera import Camera
from .snapshot import SceneSnapshot


def can_show(kind: str) -> bool:
    """Whether assets of this kind may hold a camera."""
    return kind in methods.names() and hasattr(methods.get(kind), "holds")


def background_of(assets: dict[str, Asset], scene: SceneSnapshot, camera: Camera) -> Asset | None:
    """The asset of the first reflector whose asset holds all places that the camera's rays start from."""
    starts = camera.starts()
    for asset in filter(None, (asset_of(assets, reflector) for reflector in scene.reflectors())):
        if can_show(asset.kind) and methods.get(asset.kind).holds(asset, starts).all():
            return asset
    return None


def why_none(kind: str, camera: Camera | None = None) -> tuple[str, str]:
    """What background_of's None means, and what to do about it, as sentences."""
    if not can_show(kind):
        others = ", ".join(name for name in methods.names() if can_show(name))
        return f"The method {kind} has no background: its assets answer rays from the reflectors only.", f"Choose one that has: {others}."
    if camera is not None and camera.is_orthographic:
        return "The view is orthographic: its rays start outside every cell.", "Switch to perspective."
    return (
        "The viewpoint is in no cell that can show the background.",
        "Bake with Camera in Cell (cameras=true), with more Room for other views, or move the camera into a cell.",
    )
