"""Why a board or a marker gives a scan no size: another family, another number, or nothing there."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

from ingest.calibration.board.detect import Grey
from ingest.calibration.board.diagnose import other_families
from ingest.calibration.board.reference import Reference, Tags
from ingest.calibration.board.spec import MIN_CORNERS
from ingest.calibration.board.tags import TagDetector
from omomo_core.errors import InputError

_OTHERS = 3
"""Sightings of a marker of another family that are no accident."""


def not_seen(
    pictures: Iterable[Grey], reference: Reference, counts: Sequence[int], views: int, where: str
) -> InputError:
    """The error that says what the pictures show instead of a board or marker.

    Args:
        pictures: a few of them; each takes a second or so.
        reference: what was looked for.
        counts: how many pictures show some of it, for each marker.
        views: how many pictures there are.
        where: their folder, for the message.
    """
    most = max(counts, default=0)
    if isinstance(reference, Tags) and not most:
        what, fix = _instead(_seen(pictures, reference), reference)
    elif isinstance(reference, Tags):
        what = (
            f"No marker of {reference} is seen from two sides: {most} of {views} pictures show one."
        )
        fix = "Leave it in view for half of the walk, and walk around it; or give a length (--height)."
    else:
        what = (
            f"The board {reference} gives no scale: {most} of {views} pictures show some of it, and "
            f"fewer than {MIN_CORNERS} of its {len(reference.corners)} corners are seen from two sides."
        )
        fix = (
            "Lay the printed board flat beside the object, in view for half of the walk; check "
            "that it is this board (--board), or give a length instead (--height)."
        )
    return InputError("scan-board-missing", what, where=where, fix=fix)


def _seen(pictures: Iterable[Grey], tags: Tags) -> Mapping[str, Mapping[int, int]]:
    """How often each marker of each family is there."""
    families = [tags.dictionary, *other_families(tags.dictionary)]
    finders = {name: TagDetector(Tags(name, tags.side)) for name in families}
    times = {name: defaultdict[int, int](int) for name in families}
    for grey in pictures:
        for name, finder in finders.items():
            for number in finder.find(grey):
                times[name][number] += 1
    return times


def _instead(times: Mapping[str, Mapping[int, int]], tags: Tags) -> tuple[str, str]:
    """What is there in the place of a marker, and what to do."""
    own = [str(number) for number in sorted(times[tags.dictionary])]
    if own:
        return (
            f"No picture shows marker {tags.number} of {tags.dictionary}, but there {_are(own)}.",
            "Give the number of the marker whose side was measured, or none if all are as large "
            f"(--board {tags.dictionary}:{1e3 * tags.side:g}mm:{own[0]}).",
        )
    name, others = max(times.items(), key=lambda one: max(one[1].values(), default=0))
    if max(others.values(), default=0) >= _OTHERS:
        return (
            f"No picture shows a marker of {tags.dictionary}, but there {_are(sorted(others))} of {name}.",
            f"Name that family: --board {name}:{1e3 * tags.side:g}mm.",
        )
    return (
        f"No picture shows a marker of {tags}.",
        "Lay it flat beside the object with white paper around it, in view for half of the walk, so "
        "large that each of its cells measures three pixels or more; or give a length (--height).",
    )


def _are(numbers: Sequence[object]) -> str:
    listed = ", ".join(str(number) for number in numbers)
    return f"is marker {listed}" if len(numbers) == 1 else f"are markers {listed}"
