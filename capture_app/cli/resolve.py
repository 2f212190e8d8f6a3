"""`omocap resolve`: correct which hand holds when and where."""

from typing import Any

from capture_app.cli import options
from capture_app.cli.derived import derived
from capture_app.cli.summary import show_result
from capture_app.commands.request import validated
from capture_app.commands.run import ResolveRequest


@derived(ResolveRequest)
def resolve(
    result: options.Result, output: options.ResultFolder, video: options.Video = True, **said: Any
) -> None:
    """Solve the motion again where you have corrected its contacts.

    Edit *contacts.json* of a result: move, add or take out a segment, or put an anchor elsewhere. The
    sample gets these contacts; what they do not touch stays as it was, to the last bit.

    Example: `omocap resolve chair_motion --contacts chair_motion/contacts.json -o chair_corrected`
    """
    from capture_app.resolve import corrected_motion

    if not video:
        said["video_size"] = None
    said |= {"result": result, "output": output}
    request = validated(ResolveRequest, said, "option-invalid")
    show_result(request, corrected_motion)
