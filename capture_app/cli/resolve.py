"""`omocap resolve`: correct which hand holds when and where."""

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars
from capture_app.cli.summary import summarise


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
    size = given.picture_size(video_size, "--video-size") if video else None
    from capture_app.request import ResolveRequest
    from capture_app.resolve import resolve_result

    request = ResolveRequest(result, contacts, output, video_size=size, replace=replace)
    with progress_bars() as progress:
        made = resolve_result(request, progress)
    summarise(made)
