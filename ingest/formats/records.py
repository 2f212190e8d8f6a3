"""Frames of a JSON log, one object each: in one file, or a file each."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.cameras import one_size
from ingest.formats.json_file import JsonObject, inside, load_object, member, numbers_at, place

CameraKeys = tuple[str, str, str, str, str, str]
"""What a format calls fx, fy, cx, cy, width and height."""


@dataclass(frozen=True)
class Record:
    """One frame, and where it stands."""

    values: JsonObject
    path: Path
    where: str = ""
    """Its name in the file, e.g. "frame 17"; "" when it is the file."""


@dataclass(frozen=True)
class Records:
    """The frames of a log, in order."""

    rows: tuple[Record, ...]

    def place(self, row: int) -> str:
        """File and name of a frame, for messages."""
        return place(self.rows[row].path, self.rows[row].where)

    def column(self, key: str, *shape: int) -> Float64[np.ndarray, "frames ..."]:
        """The numbers that every frame has under a key.

        Raises:
            InputError: a frame without the key, or with anything else than such numbers.
        """
        numbers = [
            numbers_at(
                member(row.values, key, row.path, row.where),
                shape,
                row.path,
                inside(row.where, key),
            )
            for row in self.rows
        ]
        return np.array(numbers, dtype=np.float64).reshape(len(self.rows), *shape)

    def columns(self, keys: Sequence[str]) -> Float64[np.ndarray, "frames keys"]:
        """One number under each of the keys."""
        return np.stack([self.column(key) for key in keys], axis=1)

    def any_has(self, key: str) -> bool:
        """Whether the log knows the key at all."""
        return any(key in row.values for row in self.rows)

    def ordered_by(self, key: str) -> "Records":
        """The same frames, the number under a key never decreasing."""
        order = np.argsort(self.column(key), kind="stable")
        return Records(tuple(self.rows[i] for i in order))


def one_file_each(files: Sequence[Path]) -> Records:
    """Records that are whole files."""
    return Records(tuple(Record(load_object(file), file) for file in files))


def pinhole(
    records: Records, keys: CameraKeys
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """fx, fy, cx, cy of every frame and the one image size; nothing where the log has none.

    Raises:
        InputError: a frame without one of them, or with an image of another size.
    """
    if not records.any_has(keys[0]):
        return None, None
    return records.columns(keys[:4]), one_size(records.columns(keys[4:]), records.place)
