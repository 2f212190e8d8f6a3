"""`omocap export`: a result as a file of another program."""

from typing import Any

import typer

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
    lerobot: a data set of a humanoid's motions, of one result or of all that `omocap batch` wrote;
    Ctrl-C and the same command again goes on where it was.

    Example: `omocap export chair_motion --to glb --bones unreal --fps 60 -o chair.glb`
    """
    from capture_app.exports.export_sample import export_result
    from capture_app.robots.export_robot import export_robot
    from capture_app.robots.robot_dataset import export_data_set

    asked = {**said, "result": result, "output": file or result}
    request = validated(ExportRequest, asked, "option-invalid")
    export_it = export_robot if request.is_of_robot else export_result
    if request.is_data_set:
        export_it = export_data_set
    with progress_bars() as progress:
        written = export_it(request, progress)
    for note in written.notes:
        say("Note", note, "yellow")
    for path in written.files:
        say("Done", str(path), "green")
    for failure in written.failures:
        say("Failed", failure, "red")
    if written.failures:
        raise typer.Exit(2)
