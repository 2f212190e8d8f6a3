"""A motion in Blender's scene: read from omocap's GLB, moved to its first frame, with its contacts."""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

bpy: Any = import_module("bpy")

RATES = (24, 25, 30, 50, 60)
"""Frames a second that omocap writes."""
RESULT = "omocap_result"
"""Custom property of what was imported: the result folder."""
_PARTS = {
    "left_hand": ("left hand holds", "left hand lets go"),
    "right_hand": ("right hand holds", "right hand lets go"),
}
"""Parts that get markers, and what these say."""
_CONTACTS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "left_toe", "right_toe")
_LINEAR, _CONSTANT = 1, 0
"""Kinds of interpolation, as `foreach_set` takes them."""


@dataclass
class ImportedMotion:
    """What the importer made of omocap's GLB."""

    armature: Any
    thing: Any
    """The object that is moved."""
    first: int
    """The scene's frame that is the motion's first."""
    frames: int

    @property
    def last(self) -> int:
        """The scene's frame that is the motion's last."""
        return self.first + self.frames - 1

    @property
    def skins(self) -> list[Any]:
        """Meshes that the armature moves."""
        return [o for o in self.armature.children if o.type == "MESH" and o is not self.thing]


def import_motion(glb: Path, first: int, name: str, result: str) -> ImportedMotion:
    """Bring a GLB of omocap into the scene, in a collection of its own.

    Args:
        glb: written at the scene's rate.
        first: the scene's frame that shall be the motion's first.
        name: of the collection.
        result: the folder that the motion comes from.
    """
    before = set(bpy.data.objects)
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.import_scene.gltf(
        filepath=str(glb),
        bone_heuristic="BLENDER",
        disable_bone_shape=True,
        import_scene_extras=False,
    )
    made = [thing for thing in bpy.data.objects if thing not in before]
    armature = next(o for o in made if o.type == "ARMATURE")
    thing = next(o for o in made if o.type == "MESH" and "contacts" in o)
    thing.parent = None  # The importer hangs it on the armature, which stands at the origin.
    home = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(home)
    for part in made:
        for collection in list(part.users_collection):
            collection.objects.unlink(part)
        home.objects.link(part)
        part[RESULT] = result
    thing["contacts"] = [_in_own_axes(span.to_dict()) for span in thing["contacts"]]
    frames = round(armature.animation_data.action.frame_range[1]) + 1
    for part in (armature, thing):
        _starting_at(part, first)
    return ImportedMotion(armature, thing, first, frames)


def _in_own_axes(span: dict[str, Any]) -> dict[str, Any]:
    """A contact with its point in the axes that the importer gives the mesh: z up."""
    if "point" not in span:
        return span
    x, y, z = span["point"]
    return {**span, "point": [x, -z, y]}


def curves_of(part: Any) -> Any:
    """The curves of an object's own action; they belong to its slot."""
    action, slot = part.animation_data.action, part.animation_data.action_slot
    strip = action.layers[0].strips[0]
    return strip.channelbag(slot).fcurves


def _starting_at(part: Any, first: int) -> None:
    """Move the keys of an object, which begin at frame 0, and leave nothing in its NLA tracks."""
    for track in list(part.animation_data.nla_tracks):
        part.animation_data.nla_tracks.remove(track)
    for curve in curves_of(part):
        keys = curve.keyframe_points
        for field in ("co", "handle_left", "handle_right"):
            values = np.empty(2 * len(keys), np.float32)
            keys.foreach_get(field, values)
            values[::2] += first
            keys.foreach_set(field, values)
        curve.update()


def new_action(part: Any, name: str) -> Any:
    """Give an object a new action, and return its curves; the action it had is kept in the file."""
    data = part.animation_data_create()
    if data.action is not None:
        data.action.use_fake_user = True
    action = bpy.data.actions.new(name)
    slot = action.slots.new("OBJECT", part.name)
    strip = action.layers.new("motion").strips.new(type="KEYFRAME")
    data.action, data.action_slot = action, slot
    return strip.channelbag(slot, ensure=True).fcurves


def key_all(curves: Any, path: str, first: int, values: np.ndarray) -> None:
    """Add curves with a key in each frame.

    Args:
        curves: from `new_action` or `curves_of`.
        path: data path of the property.
        first: frame of the first key.
        values: (frames, components).
    """
    for index in range(values.shape[1]):
        curve = curves.new(path, index=index)
        _fill(curve, first + np.arange(len(values)), values[:, index], _LINEAR)


def _fill(curve: Any, frames: np.ndarray, values: np.ndarray, interpolation: int) -> None:
    keys = curve.keyframe_points
    keys.add(len(frames))
    keys.foreach_set("co", np.stack([frames, values], axis=1).astype(np.float32).ravel())
    keys.foreach_set("interpolation", [interpolation] * len(frames))
    curve.update()


def contacts_of(thing: Any) -> list[dict[str, Any]]:
    """The contacts that came with the object: part, from, to (seconds), point on the object."""
    return [span.to_dict() for span in thing["contacts"]]


def show_contacts(part: Any, motion: ImportedMotion, spans: Iterable[dict[str, Any]]) -> None:
    """Key a property for each hand and foot, 1 while it touches, and mark in the timeline when hands do.

    Args:
        part: gets the properties, such as "left_hand_contact"; it has an action.
        motion: where in the scene the spans lie.
        spans: from `contacts_of`.
    """
    scene, spans = bpy.context.scene, list(spans)
    rate = scene.render.fps / scene.render.fps_base
    for name in (word for pair in _PARTS.values() for word in pair):
        for marker in [m for m in scene.timeline_markers if m.name == name]:
            scene.timeline_markers.remove(marker)
    for kind in _CONTACTS:
        changes = {motion.first: 0}
        for span in (s for s in spans if s["part"] == kind):
            start, stop = (motion.first + round(span[key] * rate) for key in ("from", "to"))
            changes |= {start: 1, stop: 0}
            for frame, word in zip((start, stop), _PARTS.get(kind, ()), strict=False):
                scene.timeline_markers.new(word, frame=min(frame, motion.last))
        name = f"{kind}_contact"
        part[name] = changes[motion.first]
        part.id_properties_ui(name).update(min=0, max=1)
        curve = curves_of(part).new(f'["{name}"]')
        frames = np.array(sorted(changes))
        _fill(curve, frames, np.array([changes[frame] for frame in frames.tolist()]), _CONSTANT)


def remove_objects(parts: Iterable[Any]) -> None:
    """Delete objects with what only they use: meshes, materials, actions, and empty collections."""
    for part in parts:
        action = part.animation_data.action if part.animation_data else None
        data, homes = part.data, list(part.users_collection)
        bpy.data.objects.remove(part)
        for unused in (data, action):
            if unused is not None and not unused.users:
                materials = getattr(unused, "materials", ())
                bpy.data.batch_remove([m for m in materials if m.users == 1] + [unused])
        for home in homes:
            if not home.all_objects and home in set(bpy.data.collections):
                bpy.data.collections.remove(home)
