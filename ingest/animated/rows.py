"""Rows of text as numbers; what is wrong is said with its line."""

from collections.abc import Sequence

import numpy as np

from ingest.formats.pick import floats
from ingest.formats.table import NumberTable, TextRows
from omomo_core.errors import InputError


def numbers(rows: TextRows, width: int, columns: Sequence[int]) -> NumberTable:
    """The named columns of all rows, each of `width` fields.

    Raises:
        InputError: "row-damaged" or "pose-not-finite", naming the line.
    """
    values = np.empty((len(rows.rows), len(columns)))
    for i, (fields, line) in enumerate(zip(rows.rows, rows.lines, strict=True)):
        row = floats([fields[c] for c in columns]) if len(fields) == width else []
        if not row:
            raise InputError(
                "row-damaged",
                f"Line {line} of {rows.path.name} is no row of {width} fields with numbers where "
                f"they belong: {' '.join(fields)[:60]!r}.",
                where=f"{rows.path}:{line}",
                fix="Export the motion again, or mend the line.",
            )
        if not np.isfinite(row).all():
            raise not_finite(f"{rows.path}:{line}")
        values[i] = row
    return NumberTable(rows.path, values, rows.lines)


def not_finite(where: str) -> InputError:
    """The error for a pose with NaN or infinity."""
    return InputError(
        "pose-not-finite",
        "The pose has NaN or infinity where a number belongs.",
        where=where,
        fix="Export the motion again, or take this pose out.",
    )
