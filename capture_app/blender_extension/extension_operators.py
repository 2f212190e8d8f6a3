"""What the extension does: import a result, bake it on an armature, make a person for an object."""

import re
import shlex
import tempfile
from collections.abc import Generator
from pathlib import Path
from typing import Any, ClassVar

from .armature_motion import bake, export_rig, guessed_bones
from .blender_export import glb as glb_of_object
from .blender_export import sample as sample_object
from .bone_names import JOINTS
from .motion_in_scene import (
    RATES,
    RESULT,
    ImportedMotion,
    bpy,
    contacts_of,
    import_motion,
    remove_objects,
    show_contacts,
)
from .omocap_job import ExtensionFailure, OmocapJob, Steps, free_folder, samples_of

_Importing = Generator[list[str], None, ImportedMotion]
_FRAME = bpy.props.IntProperty(name="First frame", default=1, description="Where the motion begins")
_SAMPLE = bpy.props.IntProperty(name="Sample", default=0, min=0, description="0 is the best")


class FollowJob(bpy.types.Operator):
    """Follow the work of omocap, without blocking the window."""

    bl_idname, bl_label = "omocap.follow", "Follow omocap"
    bl_options: ClassVar = {"INTERNAL", "UNDO"}
    job: ClassVar[OmocapJob | None] = None
    is_cancelled: ClassVar[bool] = False

    def invoke(self, context: Any, _event: Any) -> set[str]:
        """Look at the job ten times a second."""
        window = context.window_manager
        self.timer = window.event_timer_add(0.1, window=context.window)
        window.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Go on with the job; every other event is the user's."""
        job = FollowJob.job
        if event.type != "TIMER" or job is None:
            return {"PASS_THROUGH"}
        for area in (a for window in context.window_manager.windows for a in window.screen.areas):
            area.tag_redraw()
        try:
            if FollowJob.is_cancelled:
                job.cancel()
            elif job.advance():
                return {"PASS_THROUGH"}
        except ExtensionFailure as failure:
            self.report({"ERROR"}, str(failure))
        for note in job.notes:
            self.report({"WARNING"}, note)
        FollowJob.job, FollowJob.is_cancelled = None, False
        context.window_manager.event_timer_remove(self.timer)
        return {"FINISHED"}


class CancelJob(bpy.types.Operator):
    """Stop omocap; nothing half made stays."""

    bl_idname, bl_label = "omocap.cancel", "Cancel"

    def execute(self, _context: Any) -> set[str]:
        """Let the follower stop it."""
        FollowJob.is_cancelled = FollowJob.job is not None
        return {"FINISHED"}


def _begin(operator: Any, context: Any, steps: Steps, notes: list[str]) -> set[str]:
    """Start a job; where there is no window to keep alive, wait for it."""
    if FollowJob.job is not None:
        operator.report({"ERROR"}, "omocap is at work: wait for it, or cancel it in its panel.")
        return {"CANCELLED"}
    preferences = context.preferences.addons[__package__].preferences
    job = OmocapJob(bpy.path.abspath(preferences.omocap), steps, notes)
    if not bpy.app.background:
        FollowJob.job = job
        bpy.ops.omocap.follow("INVOKE_DEFAULT")
        return {"FINISHED"}
    try:
        job.run()
    except ExtensionFailure as failure:
        operator.report({"ERROR"}, str(failure))
        return {"CANCELLED"}
    for note in job.notes:
        operator.report({"WARNING"}, note)
    return {"FINISHED"}


def _imported(result: str, sample: int, rate: int, first: int, *more: str) -> _Importing:
    """Have omocap write a sample as GLB, and import that."""
    result = bpy.path.abspath(result).rstrip("/\\")
    count, best = samples_of(result)
    if not 1 <= (sample or best + 1) <= count:
        raise ExtensionFailure(
            f"{result or 'Nothing'} is no result folder with a sample {sample or 1}."
        )
    words = [
        "export",
        result,
        "--to",
        "glb",
        "--fps",
        str(rate),
        "--sample",
        str(sample or best + 1),
    ]
    with tempfile.TemporaryDirectory(prefix="omocap_") as folder:
        path = Path(folder, "motion.glb")
        yield [*words, "-o", str(path), *more]
        return import_motion(path, first, f"{Path(result).name} {sample or best + 1}", result)


def _rate_of(scene: Any) -> int:
    rate = scene.render.fps / scene.render.fps_base
    if rate not in RATES:
        raise ExtensionFailure(
            f"The scene has {rate:g} frames a second; omocap writes {', '.join(map(str, RATES))}. "
            "Change it in Output Properties > Format > Frame Rate."
        )
    return int(rate)


class ImportResult(bpy.types.Operator):
    """Import a result of omocap: the person with skin, the object, and the contacts."""

    bl_idname, bl_label = "omocap.import_result", "omocap result"
    bl_options: ClassVar = {"UNDO"}
    __annotations__ = {
        "directory": bpy.props.StringProperty(name="Result folder", subtype="DIR_PATH"),
        "filter_folder": bpy.props.BoolProperty(default=True, options={"HIDDEN"}),
        "sample": _SAMPLE,
        "rate": bpy.props.EnumProperty(
            name="Frames a second", items=[(str(r), str(r), "") for r in RATES], default="30"
        ),
        "frame": _FRAME,
    }

    def invoke(self, context: Any, _event: Any) -> set[str]:
        """Ask for the folder, unless the panel has said it."""
        if self.directory:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        """Import it."""
        steps = self.steps(context.scene, self.directory, self.sample, int(self.rate), self.frame)
        return _begin(self, context, steps, [])

    @staticmethod
    def steps(scene: Any, result: str, sample: int, rate: int, first: int) -> Steps:
        """Import, then show what the motion says of the scene."""
        # The importer turns seconds into frames at the scene's rate.
        loading = _imported(result, sample, rate, first)
        yield next(loading)
        scene.render.fps, scene.render.fps_base = rate, 1.0
        motion = yield from loading
        scene.frame_start, scene.frame_end = motion.first, motion.last
        scene.omocap.result = motion.thing[RESULT]
        show_contacts(motion.armature, motion, contacts_of(motion.thing))
        scene.frame_set(motion.first)


class BakeToArmature(bpy.types.Operator):
    """Put the result's motion on the active armature: palms on the object, feet on the floor."""

    bl_idname, bl_label = "omocap.bake", "Bake to my armature"
    bl_options: ClassVar = {"UNDO"}
    __annotations__ = {"sample": _SAMPLE, "frame": _FRAME}

    @classmethod
    def poll(cls, context: Any) -> bool:
        """It needs an armature."""
        return context.object is not None and context.object.type == "ARMATURE"

    def execute(self, context: Any) -> set[str]:
        """Bake the result that the panel names."""
        scene, notes = context.scene, []
        sample = self.sample or int(scene.omocap.sample)
        steps = self.steps(scene, context.object.name, sample, self.frame, notes)
        return _begin(self, context, steps, notes)

    @staticmethod
    def steps(scene: Any, name: str, sample: int, first: int, notes: list[str]) -> Steps:
        """Send the rig to omocap, and key its answer."""
        armature, result, rate = bpy.data.objects[name], scene.omocap.result, _rate_of(scene)
        chosen = {row.ours: row.theirs for row in armature.omocap_bones if row.theirs}
        with tempfile.TemporaryDirectory(prefix="omocap_") as folder:
            rig = Path(folder, "rig.glb")
            names = export_rig(armature, chosen or guessed_bones(armature), rig)
            motion = yield from _imported(result, sample, rate, first, "--skeleton", str(rig))
        armature = bpy.data.objects[name]  # An undo meanwhile has made it anew.
        spans, folder_of_result = contacts_of(motion.thing), motion.thing[RESULT]
        try:
            remove_objects(motion.skins)
            off = bake(armature, motion, names, f"{Path(folder_of_result).name} on {name}")
            show_contacts(armature, motion, spans)
        finally:
            here = (o for o in scene.objects if o is not motion.thing and o.type == "MESH")
            known = any(o.get(RESULT) == folder_of_result for o in here)
            remove_objects([motion.armature, *([motion.thing] if known else [])])
        if off:
            notes.append(f"Constraints or drivers hold these bones elsewhere; mute them: {off}")
        for part in bpy.context.selected_objects:
            part.select_set(False)
        armature.select_set(True)
        bpy.context.view_layer.objects.active = armature


class GuessBones(bpy.types.Operator):
    """Fill the table of bones with those whose names are known."""

    bl_idname, bl_label = "omocap.guess_bones", "Find bones by name"
    bl_options: ClassVar = {"UNDO"}
    poll = BakeToArmature.poll

    def execute(self, context: Any) -> set[str]:
        """Write the table anew."""
        armature = context.object
        found = guessed_bones(armature)
        armature.omocap_bones.clear()
        for ours in JOINTS:
            row = armature.omocap_bones.add()
            row.ours, row.theirs = ours, found.get(ours, "")
        return {"FINISHED"}


class MakePerson(bpy.types.Operator):
    """Make the person who moves the active object, with omocap run, and import the result."""

    bl_idname, bl_label = "omocap.make_person", "Make the person"
    bl_options: ClassVar = {"UNDO"}
    __annotations__ = {
        "output": bpy.props.StringProperty(name="Result folder", subtype="DIR_PATH"),
    }

    @classmethod
    def poll(cls, context: Any) -> bool:
        """It needs an object with a surface."""
        return context.object is not None and context.object.type != "ARMATURE"

    def execute(self, context: Any) -> set[str]:
        """Make the person for the scene's frames."""
        steps = self.steps(context.scene, context.object, self.output)
        return _begin(self, context, steps, [])

    @staticmethod
    def steps(scene: Any, thing: Any, output: str) -> Steps:
        """Export the object, run, and import the person beside it."""
        rate, first = _rate_of(scene), scene.frame_start
        name = re.sub(r"\W+", "_", thing.name)
        home = Path(bpy.path.abspath("//") if bpy.data.filepath else tempfile.gettempdir())
        result = Path(bpy.path.abspath(output)) if output else free_folder(home / f"{name}_motion")
        with tempfile.TemporaryDirectory(prefix="omocap_") as folder:
            path = Path(folder, f"{name}.glb")
            try:
                sampled = sample_object(bpy, thing, range(first, scene.frame_end + 1))
                metres = scene.unit_settings.scale_length
                path.write_bytes(glb_of_object(thing.name, *sampled, float(rate), metres))
            except SystemExit as stop:
                raise ExtensionFailure(str(stop)) from stop
            # Their floor is ours, so that the object may stay where it is.
            words = ["run", str(path), "-o", str(result), "--no-video", "--floor", "0"]
            yield [*words, *shlex.split(scene.omocap.options)]
        motion = yield from _imported(str(result), 0, rate, first)
        scene.omocap.result = motion.thing[RESULT]
        show_contacts(motion.armature, motion, contacts_of(motion.thing))
        remove_objects([motion.thing])
