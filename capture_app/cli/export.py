"""`omocap export`: a result as a file of another program."""

from typing import Any

from capture_app.cli import options
from capture_app.cli.console import progress_bars, say
from capture_app.cli.derived import derived
from capture_app.commands.export import ExportRequest
from capture_app.commands.request import validated


@derived(ExportRequest)
def export(result: options.Result, file: options.ExportFile = None, **said: Any) -> None:
    """Write a result for another program: the person, their root motion and the object.

    glb: Blender, Unity, Unreal, web pages. bvh: every animation program (the object in a second file).
    usd: Blender, Maya, Houdini, Unreal. fbx: through a Blender of yours. amass: SMPL-X npz for
    research. csv: positions for spreadsheets. robot: joints of a humanoid, and a MuJoCo scene.

    Example: `omocap export chair_motion --to glb --bones unreal --fps 60 -o chair.glb`
    """
    from capture_app.exports.export_sample import export_result
    from capture_app.robots.export_robot import export_robot

    asked = {**said, "result": result, "output": file or result}
    request = validated(ExportRequest, asked, "option-invalid")
    with progress_bars() as progress:
        written = (export_robot if request.is_of_robot else export_result)(request, progress)
    for note in written.notes:
        say("Note", note, "yellow")
    for path in written.files:
        say("Done", str(path), "green")
