"""Which hand holds the object, when and where, and when each foot stands: what files say of contacts."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_app.exports.resample import Sampled
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import to_local

HANDS = ("left_hand", "right_hand")
FEET = ("left_ankle", "right_ankle", "left_toe", "right_toe")
"""Columns of a motion's contacts: hands on the object, feet on the floor."""


@dataclass(frozen=True)
class ExportedContact:
    """A time during which a hand holds the object or a foot stands."""

    part: str
    """One of HANDS or FEET."""
    start: float
    """Seconds from the first frame of the file."""
    stop: float
    """Seconds; the first frame without contact."""
    point: Float[np.ndarray, "3"] | None
    """The palm in the object's frame, in the unit of the take; a foot has none."""

    @property
    def described(self) -> dict[str, Any]:
        """Its fields as files have them."""
        times = {"part": self.part, "from": round(self.start, 6), "to": round(self.stop, 6)}
        if self.point is None:
            return times
        return {**times, "point": [round(float(x), 6) for x in self.point]}


_RESTS = 0.03
"""Metres a second that a palm which holds may move along the object: it comes and goes at the ends."""


def contact_spans(sampled: Sampled) -> tuple[ExportedContact, ...]:
    """All spans of a motion at the rate of a file, hands first; points in metres."""
    human, moved, fps = sampled.human, sampled.object_motion, sampled.fps
    spans: list[ExportedContact] = []
    for column, part in enumerate(HANDS):
        palms = human.joints[:, 22 + column : 23 + column].astype(np.float64)
        local = to_local(moved.T_world_object, palms)[:, 0]
        rests = np.linalg.norm(np.diff(local, axis=0), axis=1) < _RESTS / fps
        held = human.hand_contact[:, column] > 0.5
        # A pair of frames between which the palm rests holds in both.
        for start, stop in runs(rests & held[1:] & held[:-1]):
            point = local[(start + stop) // 2]
            spans.append(ExportedContact(part, start / fps, (stop + 1) / fps, point))
    for column, part in enumerate(FEET):
        for start, stop in runs(human.foot_contact[:, column] > 0.5):
            spans.append(ExportedContact(part, start / fps, stop / fps, None))
    return tuple(spans)


def write_contacts(path: Path, spans: Iterable[ExportedContact]) -> None:
    """Write a table: part, from_s, to_s, and x, y, z of a palm in the object's frame."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["part", "from_s", "to_s", "x", "y", "z"])
        for span in (span.described for span in spans):
            writer.writerow([span["part"], span["from"], span["to"], *span.get("point", [""] * 3)])
