"""overlay_result: a result drawn into a film of the take, as a video."""

from dataclasses import dataclass

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.aligned import Aligned, draw, shows
from capture_app.overlay.find import find
from capture_app.progress import Progress
from capture_app.result import load_result, sample_index
from omomo_core.whole_file import check_target
from render.overlay import OverlayStyle
from render.video import write_moving

FORMATS = (".mp4", ".webp", ".gif")


@dataclass(frozen=True)
class Overlaid:
    """What was found out on the way."""

    offset: float | None
    """Seconds that were added to the film's time; None where they were known."""
    notes: tuple[str, ...]
    """In sentences."""


def overlay_result(request: OverlayRequest, progress: Progress) -> Overlaid:
    """Draw it into a file that appears whole or not at all.

    Args:
        request: what to draw.
        progress: called with the stages "board" or "localise", and "video".

    Raises:
        InputError: see `find` and `draw`, or the file cannot be written.
    """
    check_target(request.output, FORMATS)
    result = load_result(request.result)
    index = sample_index(result, request.sample)
    aligned = find(result, request, progress)
    pictures = draw(
        result,
        index,
        aligned,
        OverlayStyle(request.object_style, request.opacity, request.wipe),
        backend=request.backend,
        samples=4 if request.smooth else 0,
    )
    count = len(aligned.seconds)
    counted = (progress("video", (k + 1) / count) or p for k, p in enumerate(pictures))
    write_moving(request.output, counted, aligned.fps)
    return _told(request, aligned, seen=shows(result, index, aligned))


def _told(request: OverlayRequest, aligned: Aligned, *, seen: bool) -> Overlaid:
    found = request.video is not None and request.offset is None
    notes = [f"The film begins at --offset {aligned.offset:.2f} of the motion."] if found else []
    if not seen:
        notes.append("The film never shows the place where the person was.")
    return Overlaid(aligned.offset if found else None, tuple(notes))
