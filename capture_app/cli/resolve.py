"""`omocap resolve`: correct which hand holds when and where."""

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars
from capture_app.cli.summary import summarise
from capture_app.commands.request import validated
from capture_app.commands.run import ResolveRequest


def resolve(
    result: given.Result,
    contacts: given.CorrectedContacts,
    output: given.ResultFolder,
    video: given.Video = True,
    video_size: given.Size = "960x540",
    replace: given.Replace = False,
) -> None:
    """Solve the motion again where you have corrected its contacts.

    Edit *contacts.json* of a result: move, add or take out a segment, or put an anchor elsewhere. The
    chosen sample gets these contacts; what they do not touch stays as it was, to the last bit.

    Example: `omocap resolve chair_motion --contacts chair_motion/contacts.json -o chair_corrected`
    """
    from capture_app.resolve import resolve_result

    said = {"result": result, "contacts": contacts, "output": output, "replace": replace}
    size = video_size if video else None
    request = validated(ResolveRequest, {**said, "video_size": size}, "option-invalid", prefix="--")
    with progress_bars() as progress:
        made = resolve_result(request, progress)
    summarise(made)
