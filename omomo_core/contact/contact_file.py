"""contacts.json: which hand holds the object when and where, to look at and to correct by hand.

    {
      "version": 1,
      "fps": 30,
      "frames": 240,
      "segments": [
        {"hand": "left", "start": 12, "stop": 96, "anchor": [0.21, -0.08, 0.4]},
        {"hand": "right", "start": 30, "stop": 96}
      ]
    }

`frames` is the length of the take. A segment lasts from frame `start` to `stop` (exclusive). `anchor` is
the place of the palm joint, base of the middle finger, in the object's frame, metres; without one (or
with null) the hand is put where the prediction has it.
"""

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from reprlib import repr as short

import numpy as np
from jaxtyping import Float

from omomo_core import strict_json
from omomo_core.contact.contact_config import EDITED_CONTACTS
from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.errors import InputError
from omomo_core.geometry.surface import Surface
from omomo_core.motion import FPS

VERSION = 1
HANDS = ("left", "right")
_MOST_BYTES = 10 * 10**6
_LAYOUT = (
    '{"version": 1, "fps": 30, "frames": 240, "segments": '
    '[{"hand": "left", "start": 12, "stop": 96, "anchor": [0.2, 0.0, 0.4]}]}'
)


def write_contacts(path: Path, segments: Sequence[ContactSegment], frames: int) -> None:
    """Write the contacts of a take of `frames` frames, one segment a line in the order of their starts."""
    lines = [
        json.dumps(
            {
                "hand": HANDS[s.hand],
                "start": s.start,
                "stop": s.stop,
                "anchor": s.anchor.round(5).tolist(),
            }
        )
        for s in sorted(segments, key=lambda s: (s.start, s.hand))
    ]
    inner = "\n    " + ",\n    ".join(lines) + "\n  " if lines else ""
    head = f'  "version": {VERSION},\n  "fps": {FPS:g},\n  "frames": {frames},\n'
    path.write_text(f'{{\n{head}  "segments": [{inner}]\n}}\n', encoding="utf-8")


def read_contacts(path: Path, frames: int, surface: Surface) -> tuple[ContactSpan, ...]:
    """Return what each hand holds, as a contact file says.

    Args:
        path: the file, laid out as this module's description shows.
        frames: length of the take at 30 fps.
        surface: the object's surface in its own frame.

    Returns:
        In the order of the file: a segment where an anchor is given, a span where not.

    Raises:
        InputError: "contacts-missing", "contacts-unreadable", "contacts-version",
            "contacts-keys", "contacts-frames", "contacts-hand", "contacts-range",
            "contacts-anchor", "contacts-off-surface", "contacts-overlap" or "contacts-travel"; where
            it concerns one entry, it says which.
    """
    data = _load(path)
    _check_keys(data, ("version", "fps", "frames", "segments"), (), str(path))
    if data["fps"] != FPS or data["frames"] != frames:
        raise InputError(
            "contacts-frames",
            f"The contacts are for {short(data['frames'])} frames at {short(data['fps'])} fps; the "
            f"take has {frames} at {FPS:g}.",
            where=str(path),
            fix="Use the contacts of this take, or count its frames again.",
        )
    if not isinstance(data["segments"], list):
        raise _unreadable(path, "segments is not a list")
    spans = tuple(
        _span(entry, frames, surface, f"{path}, segments[{index}]")
        for index, entry in enumerate(data["segments"])
    )
    _check_overlap(spans, path)
    return spans


def _load(path: Path) -> dict[str, object]:
    """Return the JSON object of a contact file, after its size and version are checked."""
    if not path.is_file():
        raise InputError(
            "contacts-missing", "There is no such file.", where=str(path), fix="Check the path."
        )
    if path.stat().st_size > _MOST_BYTES:
        raise _unreadable(path, f"it has more than {_MOST_BYTES / 1e6:g} MB")
    try:
        data = strict_json.parse(path.read_bytes())
    except ValueError as problem:
        raise _unreadable(path, f"{problem}") from None
    if not isinstance(data, dict):
        raise _unreadable(path, "it is not an object in braces")
    if data.get("version") != VERSION:
        raise InputError(
            "contacts-version",
            f"The contacts are of version {short(data.get('version'))}; version {VERSION} is read.",
            where=str(path),
            fix=f'Begin the file with "version": {VERSION}.',
        )
    return data


def _unreadable(path: Path, why: str) -> InputError:
    return InputError(
        "contacts-unreadable",
        f"The contacts cannot be read: {why}.",
        where=str(path),
        fix=f"Write them like this: {_LAYOUT}",
    )


def _check_keys(
    data: dict[str, object], needed: Sequence[str], optional: Sequence[str], where: str
) -> None:
    missing = [key for key in needed if key not in data]
    unknown = [key for key in data if key not in (*needed, *optional)]
    for keys, fault in ((missing, "is missing"), (unknown, "is not known here")):
        if keys:
            raise InputError(
                "contacts-keys",
                f"{', '.join(map(short, keys[:5]))} {fault}.",
                where=where,
                fix=f"Write {', '.join((*needed, *(f'{key} (optional)' for key in optional)))}.",
            )


def _span(entry: object, frames: int, surface: Surface, where: str) -> ContactSpan:
    """Return the span that one entry of `segments` describes."""
    if not isinstance(entry, dict):
        raise InputError("contacts-keys", "This is no object in braces.", where=where, fix=_LAYOUT)
    _check_keys(entry, ("hand", "start", "stop"), ("anchor",), where)
    if entry["hand"] not in HANDS:
        raise InputError(
            "contacts-hand",
            f"There is no hand {short(entry['hand'])}.",
            where=where,
            fix='Write "left" or "right".',
        )
    hand = HANDS.index(entry["hand"])
    start, stop = (_frame(name, entry[name], frames, where) for name in ("start", "stop"))
    if start >= stop:
        raise InputError(
            "contacts-range",
            f"The contact starts at frame {start} and stops at frame {stop}.",
            where=where,
            fix="Let it stop after it starts; at the frame of the stop the hand is free again.",
        )
    anchor = entry.get("anchor")
    if anchor is None:
        return ContactSpan(hand, start, stop)
    return ContactSegment(hand, start, stop, _anchor(anchor, surface, where))


def _frame(name: str, value: object, frames: int, where: str) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= frames:
        return value
    raise InputError(
        "contacts-range",
        f"{name} is {short(value)}, which is no frame of the take.",
        where=where,
        fix=f"Write a whole number from 0 to {frames}.",
    )


def _anchor(value: object, surface: Surface, where: str) -> Float[np.ndarray, "3"]:
    numbers = [x for x in value if _is_number(x)] if isinstance(value, list) else []
    if not isinstance(value, list) or not len(numbers) == len(value) == 3:
        raise InputError(
            "contacts-anchor",
            f"anchor is {short(value)}, not three finite numbers.",
            where=where,
            fix="Write [x, y, z] in the object's frame, metres, or leave the anchor out.",
        )
    anchor = np.array(numbers, float)
    distance, _ = surface.tree.query(anchor)
    if distance > EDITED_CONTACTS.farthest_anchor:
        raise InputError(
            "contacts-off-surface",
            f"The anchor is {distance:.3g} m off the object's surface; a palm that holds it is within "
            f"{EDITED_CONTACTS.farthest_anchor:g} m.",
            where=where,
            fix="Give the place in the object's frame and in metres, or leave the anchor out.",
        )
    return anchor


def _is_number(x: object) -> bool:
    return isinstance(x, int | float) and not isinstance(x, bool) and abs(x) < 1e9


def _check_overlap(spans: Sequence[ContactSpan], path: Path) -> None:
    """Refuse spans of one hand that overlap, or that leave it too little time between two places."""
    for hand, name in enumerate(HANDS):
        order = sorted(
            (k for k, s in enumerate(spans) if s.hand == hand), key=lambda k: spans[k].start
        )
        for k, after in pairwise(order):
            if spans[after].start < spans[k].stop:
                raise InputError(
                    "contacts-overlap",
                    f"The {name} hand holds two places from frame {spans[after].start} on.",
                    where=f"{path}, segments[{k}] and segments[{after}]",
                    fix="Shorten one of the two, or take it out.",
                )
            if spans[after].start - spans[k].stop < EDITED_CONTACTS.shortest_travel:
                raise InputError(
                    "contacts-travel",
                    f"The {name} hand has {spans[after].start - spans[k].stop} frames to go from one "
                    "place to the next.",
                    where=f"{path}, segments[{k}] and segments[{after}]",
                    fix=f"Leave at least {EDITED_CONTACTS.shortest_travel} frames between the two, "
                    "or make them one.",
                )
