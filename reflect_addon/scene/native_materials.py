"""Use in materials, and remove: reflectors whose own materials show a method's reflections in EEVEE, without the add-on.

Problem. An artist's file gets new materials, groups, images and actions, and must be as before when they go.
Idea. A copy of each material gets a shader tree for EEVEE that asks the asset's group (native_shader.py); the copy takes the slot's place
on the object (native_slots.py); the artist's material stays behind both. Everything is made before the first slot changes, and what was
made goes again when anything fails. Removing puts the slots back and deletes what is ours and has no user left.
"""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy

from ..core import methods
from ..core.asset import Asset
from ..core.errors import ReflectError
from ..core.kernel import KernelError
from ..core.progress import Progress, teller
from ..core.snapshot import SceneSnapshot
from .kernel_group import IOR
from .native_follow import following
from .native_marks import NAME, ORIGINAL, OURS, is_ours
from .native_normals import keep_fine, put_back
from .native_plan import Change, may_be_rough, plan
from .native_shader import draw_with_group
from .native_slots import put, take_back
from .node_images import keep_images
from .node_report import describe_group
from .node_uniforms import too_large
from .reflection_group import REFLECTANCE, reflection_group

SHARED = (REFLECTANCE, IOR)  # groups that are found by their names
IMAGES = "native"  # folder below a scene's assets, for images that are not packed
KINDS = ("materials", "node_groups", "images", "actions")  # collections of bpy.data that ours are in, users before what they use


@dataclass(frozen=True)
class Report:
    """What was done, for the person who asked."""

    materials: int = 0  # of ours that slots show now, or that were removed
    objects: int = 0
    nodes: int = 0  # of the materials, groups counted with all that is in them
    sentences: tuple[str, ...] = ()  # what stayed as it is, and why

    def counts(self) -> str:
        return f"{_many(self.materials, 'material')} of {_many(self.objects, 'object')}, {_many(self.nodes, 'node')}"


def use_in_materials(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, assets: dict[str, Asset], method: str, *, pack: bool = True,
    folder: Path | None = None, stale: Collection[str] = (), progress: Progress | None = None,
) -> Report:  # fmt: skip
    """Gives every reflector of the snapshot materials that show its asset; those that have them already get new ones.

    pack: images go into the .blend; else they are written below `folder`. progress: told at each group that is begun. ReflectError when no object can be changed, or the method's
    kernel cannot be nodes; the file is then as it was."""
    if method not in (*methods.gathering(), methods.AUTO):
        raise ReflectError(f"{method} draws the scene again for each frame, which a material cannot.", _choose())
    planned = plan(scene, snapshot, assets, method, stale)
    if not planned.changes:
        said = " ".join(planned.sentences) or f"The scene '{scene.name}' has no reflector."
        raise ReflectError("No material was changed.", said)
    with _all_or_nothing(), ExitStack() as undo:
        try:
            groups = _groups(scene, planned.changes, teller(progress, "Nothing was changed."))
            copies, nodes, unchanged = _copies(planned.changes, groups)
            for group in groups.values():
                keep_images(group, pack, folder)
        except KernelError as error:
            raise ReflectError(f"{method} cannot be made into nodes: {error}.", _choose()) from error
        if not copies:
            raise ReflectError("No material was changed.", " ".join((*planned.sentences, *unchanged)))
        for change in planned.changes:
            if (own := copies.get(_key(change))) is not None:
                undo.callback(put(change.obj, change.index, own))
        undo.pop_all()
    keep_fine(scene)
    objects = {change.obj.name_full for change in planned.changes if _key(change) in copies}
    return Report(len(copies), len(objects), nodes, (*planned.sentences, *unchanged))


def remove_from_materials(objects: Iterable[bpy.types.Object]) -> Report:
    """Gives the objects' slots back what they showed, and deletes what nobody uses then."""
    objects = tuple(objects)
    changed, sentences = 0, []
    for obj in objects:
        if len(obj.reflect_native):
            changed += 1
        kept = [take_back(obj, position) for position in reversed(range(len(obj.reflect_native)))]
        if not all(kept):
            sentences.append(f"{obj.name} was given another material since; that one stays.")
    put_back({scene for obj in objects for scene in obj.users_scene})
    return Report(_purge(), changed, 0, tuple(sentences))


def has_native(objects: Iterable[bpy.types.Object]) -> bool:
    """Whether any of them shows materials of ours."""
    return any(len(obj.reflect_native) for obj in objects)


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _choose() -> str:
    return f"Choose among: {', '.join(methods.gathering())}."


def _key(change: Change) -> tuple[str, int, float]:
    return change.material.name_full, id(change.asset), change.roughest


def _groups(scene: bpy.types.Scene, changes: tuple[Change, ...], say: Callable[[float, str], None]) -> dict[int, bpy.types.NodeTree]:
    """id of an asset -> the group that answers from it."""
    assets = {id(change.asset): change.asset for change in changes}
    rough = {id(change.asset) for change in changes if may_be_rough(change.material)}
    groups, alike = {}, {}
    for number, (key, asset) in enumerate(assets.items()):
        begun = partial(say, number / len(assets), f"Nodes for {asset.reflector or 'all reflectors'}")
        name = f"Reflect {asset.kind} {asset.reflector}".strip()
        follower, driven = following(scene, asset, name)
        groups[key] = reflection_group(follower, name, key in rough, driven, alike, begun)
    return groups


def _copies(changes: tuple[Change, ...], groups: dict[int, bpy.types.NodeTree]):
    """(_key -> material of ours, nodes in all of them, sentences on materials where nothing mirrors for EEVEE)."""
    copies, nodes, unchanged = {}, 0, []
    for change in changes:
        key = _key(change)
        if key in copies:
            continue
        own = change.material.copy()
        own[ORIGINAL] = change.material
        own.name = NAME.format(change.material.name)
        added = draw_with_group(own, groups[id(change.asset)], change.roughest)
        if added and (large := too_large(own.node_tree)):
            bpy.data.materials.remove(own)
            copies[key] = None
            unchanged.append(
                f"{change.material.name}: {large}; it stays as it is. "
                "Let fewer objects move, use fewer layers in the material, or choose another method."
            )
        elif added:
            copies[key] = own
            called = [n.node_tree for n in own.node_tree.nodes if n.bl_idname == "ShaderNodeGroup" and OURS in n and n.node_tree]
            nodes += added + sum(describe_group(group).inlined for group in called)
        else:
            bpy.data.materials.remove(own)
            copies[key] = None
            unchanged.append(f"{change.material.name}: what EEVEE draws of it has nothing that mirrors; it stays as it is.")
    return {key: own for key, own in copies.items() if own is not None}, nodes, unchanged


@contextmanager
def _all_or_nothing() -> Iterator[None]:
    """Marks every data-block that the body makes as ours, and deletes those of an earlier bake that nobody uses then. When the body
    raises, what it made is removed. New blocks get the names that earlier ones have."""
    before = {(kind, block.session_uid) for kind in KINDS for block in getattr(bpy.data, kind)}
    earlier = {(kind, b.session_uid): b.name for kind in KINDS for b in getattr(bpy.data, kind) if is_ours(b) and b.name not in SHARED}

    def blocks(known, wanted: bool):
        return [(kind, b) for kind in KINDS for b in getattr(bpy.data, kind) if ((kind, b.session_uid) in known) == wanted]

    for _, block in blocks(earlier, True):
        block.name = f"{block.name} (earlier)"
    try:
        yield
        for _, block in blocks(before, False):
            if not is_ours(block):
                block[OURS] = True
        _purge()
    except BaseException:
        for kind, block in blocks(before, False):
            getattr(bpy.data, kind).remove(block)
        raise
    finally:
        for kind, block in blocks(earlier, True):
            block.name = earlier[kind, block.session_uid]


def _purge() -> int:
    """Deletes what is ours and has no user; how many materials that were."""
    count, again = 0, True
    while again:
        again = False
        for kind in KINDS:
            blocks = getattr(bpy.data, kind)
            for block in [b for b in blocks if is_ours(b) and b.users == 0 and b.library is None]:
                count += kind == "materials"
                blocks.remove(block)
                again = True
    return count
