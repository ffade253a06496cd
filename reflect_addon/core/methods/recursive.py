"""`recursive`: planar mirrors drawn by mirrored views, and mirrors in them by views of views [nielsen-2002].

Problem. A flat mirror shows the scene as sharply as it is seen without one, and mirrors that it shows as sharply again: no stand-in does.
Idea. A planar mirror's picture is the scene drawn by the eye's mirror image; where that picture shows a planar mirror, the same is done
from there, until a depth is reached (3.1, Fig 4). One target per level is enough, since a picture is used as soon as it is made (Fig 3).
  * Planes are recognised in any mesh (mirror_planes.py), views are cameras (mirrored_view.py), and which of them are worth a picture is
    decided before anything is drawn (reflection_tree.py): by what is seen, how large, and how strong a mirror still is.
  * A level is a picture like the window's (gpu/levels.py), so what is curved is answered in it by its own asset's kernel.
  * A curved reflector is answered by its own distance maps as baked, or by a cube map that is drawn when something moved, with the planar
    mirrors in it and the other curved ones by the maps that they have (3.2, Fig 6; live_maps.py, map_updates.py), or by one view from
    its middle for each picture that shows it, of which nothing is kept (2.3, Fig 5; curved_views.py, curved_march.py).
  * Glass, the paper's future work: a pane shows the view through it, a level more (pane_view.py); a solid convex body bends rays (glass_optics.py),
    and those that leave it are answered as its mirrored rays are.
  * Behind the surfaces of a view is the sky, a map by direction traced with everything hidden: views know that a ray meets nothing.
  * Beyond the last level the rays of mirrors that show each other go on through the pictures of their branch (mirror_series.py).
Where we depart. The paper fills a mirror beyond the last level with the surface alone; here that series answers it, and `layered_distance`
whatever else no view was drawn for, so that the last level does not show (option `endless`; without it as the paper, and as a renderer with
that many glossy bounces). What is drawn is surface radiance: the paper's fixed-function light has no shadows and no bounces.
Limits. Colours are surface radiance: what is glossy looks the same from everywhere. Rough mirrors show of their lobe
what their view holds (mirror_march.py), up to ROUGHEST; above mirrors.ROUGHEST only to the eye, since in other mirrors surface radiance shows it.
"""

from dataclasses import replace

from .. import glass_body, reflected_surfaces
from ..asset import Asset
from ..curved_views import CurvedMirror, curved_of
from ..glass_shapes import Pane, glass_of, panes_of
from ..job import BakeJob
from ..kernel import Hit
from ..mirror_planes import MirrorPlane, planes_of
from ..reflection_tree import Culling
from ..remake import REFLECTOR, part_of
from ..scene_items import OWN, Items, light_alone
from ..settings import Setting
from ..snapshot import Instance, SceneSnapshot
from ..spaces import STATUS_FELL_BACK
from . import environment, layered_distance

# Blender's roughness of a plane up to which a view is drawn for it. FLIP against Cycles of a floor under a table (evaluation/bench_nielsen_glossy.py)
# is 0.13, 0.26 and 0.41 at 0.5, 0.7 and 1, that of distance maps 0.47, 0.57 and 0.67: views are nearer everywhere, but beyond this neither is near.
ROUGHEST = 0.7
_SKY = "sky_"  # before the names of the sky's images and uniforms

NAME = "recursive"
LABEL = "Recursive Mirrors"
REQUIRES = (layered_distance.NAME,)
EFFORT = 4.5  # a second picture of what a planar mirror shows
SURFACES = reflected_surfaces.SETTINGS
# By field of Culling: label and words.
CULLING = {
    "back_faces": ("Cull Back Faces", "Draw no view of a mirror that is seen from behind"),
    "frustum": ("Cull Outside Picture", "Draw no view of a mirror that is outside of the picture"),
    "window": ("Cull Outside Mirror", "Draw no view of a mirror that is not seen within the mirror that shows it"),
    "area": ("Cull Small Mirrors", "Draw no view of a mirror that takes less than a pixel of the picture"),
    "energy": ("Cull Faint Mirrors", "Draw no view of a mirror below Least Energy"),
    "scissor": ("Tight Scissor", "Draw of a view only the pixels where its mirror is seen, and of the scene only what may be seen there"),
    "size": ("Size by Area", "Make live cube maps as large as their reflectors are seen, Map Side at most, and memory for views as large as the "
             "mirrors are seen. Without it cube maps have Map Side and views the picture's size"),
    "coarse_meshes": ("Coarse Deep Meshes", "Draw surfaces in mirrors in mirrors with no more triangles than their pixels show"),
}  # fmt: skip
SETTINGS = {
    "depth": Setting("Depth", "Mirrors in mirrors that are drawn: 1 is what the eye sees in a mirror, each one more what is seen in "
                     "mirrors there. What lies beyond is taken from these pictures, or from distance maps", low=1, soft_high=8, drawn=True),
    "least_energy": Setting("Least Energy", "Share of the picture's light below which a mirror in a mirror is not drawn: its "
                            "share of the picture times the reflectances on the way to it", high=1.0, advanced=True, drawn=True),
    "endless": Setting("Endless", "Let mirrors beyond the last level show what views already drawn see there, and distance maps the rest. "
                      "Without it these show no reflection, as a renderer whose glossy bounces end there", advanced=True, drawn=True),
    "curved": Setting("Live Cube Maps", "Answer curved reflectors by cube maps that are drawn when something moves, with mirrors in them, "
                      "instead of by distance maps as baked", drawn=True),
    "curved_views": Setting("Views of Curved Mirrors", "Answer curved reflectors by one wide view of what is before them, drawn in every "
                            "frame for each picture that shows them; what lies beside and behind by distance maps. Instead of live cube maps",
                            drawn=True),
    "map_side": Setting("Map Side", "Texels along an edge of a live cube map, and pixels of half of a curved mirror's view, at most", low=16,
                        high=1024, power_of_two=True, advanced=True, drawn=True),
    "maps_per_frame": Setting("Maps a Frame", "Live cube maps that a frame makes at most, six views of the scene each; others show what "
                              "they had, those with the largest error being next", soft_high=8, advanced=True, drawn=True),
    **{f"cull_{name}": Setting(*words, advanced=True, drawn=True) for name, words in CULLING.items()},
}  # fmt: skip
DEFAULTS = {
    **environment.DEFAULTS, "depth": 3, "least_energy": 1e-4, "endless": True, "curved": False, "curved_views": False, "map_side": 128,
    "maps_per_frame": 1, **{f"cull_{name}": True for name in CULLING},
}  # fmt: skip


def bake(job: BakeJob) -> Asset:
    """The sky, one for all reflectors; the asset says what was asked for, and whose surfaces are drawn."""
    if NAME not in job.shared:
        job.shared[NAME] = environment.capture(job, NAME, tuple(i.object_name for i in (*job.scene.instances, *job.scene.lamps)))
    sky = job.shared[NAME]
    planes = [plane for plane in drawn_mirrors(job.scene)[0] if job.scene.reflectors()[plane.reflector].name == job.reflector.name]
    planes = [plane for plane in planes if not isinstance(plane, Pane)]
    glass = glass_body.part_of_asset(glass_of(job.scene, job.reflector))
    return Asset(
        NAME,
        job.reflector.name,
        {_SKY + name: image for name, image in sky.images.items()} | glass["images"],
        uniforms={"planes": float(len(planes)), **{_SKY + name: value for name, value in sky.uniforms.items()}} | glass["uniforms"],
        options=glass["options"],
        settings=dict(job.settings),
        parts=(part_of(job.scene, job.reflector, REFLECTOR, -1), *reflected_surfaces.parts(job.scene)),
        light_hash=job.scene.light_hash,
    )


def sky_of(asset: Asset) -> Asset:
    """What a view shows where it sees nothing: an asset of `environment`, which shares the asset's image."""
    images, uniforms = ({n.removeprefix(_SKY): v for n, v in of.items() if n.startswith(_SKY)} for of in (asset.images, asset.uniforms))
    return Asset(environment.NAME, asset.reflector, images, uniforms)


def culling_of(settings: dict[str, object]) -> Culling:
    """What an asset's settings want left out."""
    return Culling(**{name: bool(settings[f"cull_{name}"]) for name in CULLING})


def culling_settings(culling: Culling) -> dict[str, object]:
    """The same as settings."""
    return {f"cull_{name}": getattr(culling, name) for name in CULLING}


def drawn_mirrors(scene: SceneSnapshot) -> tuple[tuple[MirrorPlane, ...], tuple[CurvedMirror, ...]]:
    """The planar mirrors that are smooth enough for a view, with the panes, and the curved ones, which may have a cube map."""
    planes = planes_of(scene)
    return (*(plane for plane in planes if plane.roughness[1] <= ROUGHEST), *panes_of(scene)), curved_of(scene, planes)


def answered_by(
    curved: tuple[CurvedMirror, ...], asked: dict[int, dict[str, object]]
) -> tuple[tuple[CurvedMirror, ...], tuple[CurvedMirror, ...]]:
    """(curved mirrors with a view for each picture that shows them, those with a live cube map): all of one kind, views where one asks
    for them. asked: settings by reflector."""
    viewed, live = (tuple(c for c in curved if c.reflector in asked and asked[c.reflector][name]) for name in ("curved_views", "curved"))
    return viewed, () if viewed else live


def inputs(scene: SceneSnapshot, reflectors: tuple[Instance, ...]) -> Items:
    """The reflectors' shapes and marks, whose surfaces are drawn, and light, of which the sky is a part."""
    light = light_alone(scene)
    return light and {**light, **reflected_surfaces.inputs_of(scene, reflectors), OWN: {r.name: str(int(r.mark == "YES")) for r in reflectors}}


def report(asset: Asset) -> str:
    """How much of a reflector views are drawn for, and what its glass shows."""
    count = int(asset.uniforms["planes"])
    drawn = "One planar mirror is drawn." if count == 1 else f"{count} planar mirrors are drawn, each where its front is seen."
    if not count:
        drawn = "No part of it is a smooth planar mirror: distance maps answer alone."
    return " ".join(part for part in (drawn, glass_body.sentence(asset.options, asset.uniforms)) if part)


def trace(k, asset, ray) -> Hit:
    """What is not drawn: what is curved or rough, and mirrors beyond the last level (STATUS_FELL_BACK)."""
    return replace(layered_distance.trace(k, asset, ray), status=STATUS_FELL_BACK)
