"""What the extension shows: the panel in the sidebar of the 3D view, its settings, menu and preferences."""

from functools import lru_cache
from typing import Any

from .extension_operators import (
    BakeToArmature,
    CancelJob,
    FollowJob,
    GuessBones,
    ImportResult,
    MakePerson,
)
from .motion_in_scene import bpy
from .omocap_job import samples_of


class BoneChoice(bpy.types.PropertyGroup):
    """A row of the table of bones: our joint, and the armature's bone."""

    __annotations__ = {"ours": bpy.props.StringProperty(), "theirs": bpy.props.StringProperty()}


@lru_cache(maxsize=8)
def _choices(count: int, best: int) -> list[tuple[str, str, str]]:
    # Blender keeps no reference to these texts, so they must not be made anew.
    numbered = [(str(k + 1), str(k + 1), "") for k in range(count) if k != best]
    return [("0", f"{best + 1} (best)", "The sample that omocap ranks first"), *numbered]


def _samples(settings: Any, _context: Any) -> list[tuple[str, str, str]]:
    return _choices(*samples_of(bpy.path.abspath(settings.result)))


class ExtensionSettings(bpy.types.PropertyGroup):
    """What the panel asks for, kept with the scene."""

    __annotations__ = {
        "result": bpy.props.StringProperty(
            name="Result", subtype="DIR_PATH", description="Folder that omocap run has made"
        ),
        "sample": bpy.props.EnumProperty(name="Sample", items=_samples),
        "options": bpy.props.StringProperty(
            name="Options", description="More options of omocap run, such as --height 1.95 --seed 2"
        ),
    }


class ExtensionPreferences(bpy.types.AddonPreferences):
    """The place of omocap."""

    bl_idname = __package__
    __annotations__ = {
        "omocap": bpy.props.StringProperty(
            name="omocap",
            default="omocap",
            subtype="FILE_PATH",
            description="The program: a name on the PATH, or .venv/bin/omocap in its folder",
        ),
    }

    def draw(self, _context: Any) -> None:
        """Show the one field."""
        self.layout.prop(self, "omocap")


class OmocapPanel(bpy.types.Panel):
    """The panel in the sidebar."""

    bl_label, bl_idname = "omocap", "VIEW3D_PT_omocap"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "omocap"

    def draw(self, context: Any) -> None:
        """Show what omocap does, or what can be asked for."""
        layout, settings = self.layout, context.scene.omocap
        if FollowJob.job is not None:
            stage, share = FollowJob.job.progress
            layout.progress(text=stage, factor=share)
            layout.operator(CancelJob.bl_idname, icon="CANCEL")
            return
        layout.prop(settings, "result")
        count, _ = samples_of(bpy.path.abspath(settings.result))
        if count:
            layout.prop(settings, "sample", expand=True)
            button = layout.operator(ImportResult.bl_idname, text="Import", icon="IMPORT")
            button.directory, button.sample = settings.result, int(settings.sample or 0)
        layout.separator()
        layout.operator(MakePerson.bl_idname, icon="OUTLINER_OB_ARMATURE")
        layout.prop(settings, "options")


class BonesPanel(bpy.types.Panel):
    """The table of bones, and what bakes."""

    bl_label, bl_idname, bl_parent_id = "My armature", "VIEW3D_PT_omocap_bones", "VIEW3D_PT_omocap"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "omocap"
    poll = BakeToArmature.poll

    def draw(self, context: Any) -> None:
        """Show the active armature's table."""
        layout, armature = self.layout, context.object
        layout.operator(BakeToArmature.bl_idname, icon="ACTION")
        layout.operator(GuessBones.bl_idname, icon="VIEWZOOM")
        for row in armature.omocap_bones:
            layout.prop_search(row, "theirs", armature.data, "bones", text=row.ours)


def _menu(menu: Any, _context: Any) -> None:
    menu.layout.operator(ImportResult.bl_idname, text="omocap result")


_CLASSES = (
    BoneChoice, ExtensionSettings, ExtensionPreferences, FollowJob, CancelJob, ImportResult,
    BakeToArmature, GuessBones, MakePerson, OmocapPanel, BonesPanel,
)  # fmt: skip


def register_all() -> None:
    """Add everything to Blender."""
    for kind in _CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.Scene.omocap = bpy.props.PointerProperty(type=ExtensionSettings)
    bpy.types.Object.omocap_bones = bpy.props.CollectionProperty(type=BoneChoice)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister_all() -> None:
    """Take everything away again."""
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    del bpy.types.Object.omocap_bones, bpy.types.Scene.omocap
    for kind in reversed(_CLASSES):
        bpy.utils.unregister_class(kind)
