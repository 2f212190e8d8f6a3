"""`omocap run`: a phone session with mesh and mount, or an animated object, becomes a motion."""

from typing import Any

from capture_app.cli import options
from capture_app.cli.derived import derived
from capture_app.cli.summary import show_result
from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest, mount_file

HELP = """Make the motion of the person who moved the object.

Writes a folder with *motion.glb* (the animated person and object, for Blender, Unity, Unreal),
*motion.mp4*, *motion.npz* (the numbers), *contacts.json* (which hand holds when and where, to be
corrected with `omocap resolve`) and *manifest.json* (how it was made).

Example: `omocap run my_take --object chair.obj --mount chair_mount.json -o chair_motion`

An object that was animated needs no phone: `omocap run chair.glb -o chair_motion`
"""


@derived(RunRequest, first=("object", "mount"))
def run(
    session: options.Recording,
    output: options.ResultFolder,
    video: options.Video = True,
    **said: Any,
) -> None:
    """See HELP."""
    from capture_app.pipeline import motion_of_take
    from ingest.animated.detect import is_animation
    from ingest.formats.registry import check_there

    check_there(session)
    animated = is_animation(session, mounted=said["mount"] is not None)
    if not animated:
        said["mount"] = mount_file(said["mount"])
    if not video:
        said["video_size"] = None
    said |= {"session": session, "output": output, "animated": animated}
    request = validated(RunRequest, said, "option-invalid")
    show_result(request, motion_of_take)
