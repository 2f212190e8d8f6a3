"""Keyframes in CSV: a header with `time` or `frame`, x, y, z, qx, qy, qz, qw, in any order.

Optional: a column `interpolation` (how the motion goes on from that key), and comment lines
`# fps: 24` (needed with `frame`), `# up: y` (else z) and `# interpolation: linear` (else smooth).
"""

from pathlib import Path

from ingest.animated.animation import Animation
from ingest.animated.keyframes import MODES, Keyframes, Mode, animate
from ingest.animated.rows import numbers
from ingest.animated.stated import stated, stated_fps, stated_up, unknown_word
from ingest.formats.pick import first_row
from ingest.formats.table import TextRows, read_rows
from omomo_core.errors import InputError

NAME = "CSV"
FILES = "keyframes as CSV with the columns time or frame, x, y, z, qx, qy, qz, qw"

_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def detect(path: Path) -> bool:
    """Whether the first line names x, y and z, and no `timestamp` (that is what phones write)."""
    names = _names(first_row(path).split(_separator(path)))
    return {"x", "y", "z"} <= set(names) and "timestamp" not in names


def read(path: Path) -> Animation:
    """Read keyframes and interpolate them at 30 fps.

    Raises:
        InputError: "csv-columns", "fps-missing", "comment-unknown", "interpolation-unknown",
            "row-damaged", "pose-not-finite"; besides those of `animate`.
    """
    text = read_rows(path, _separator(path))
    names, rows = _names(text.rows[0]), text.without_header()
    clock = "time" if "time" in names else "frame"
    missing = [name for name in (clock, *_POSE) if name not in names]
    if missing:
        raise InputError(
            "csv-columns",
            f"The header of {path.name} lacks {', '.join(missing)}; it has {', '.join(names)}.",
            where=f"{path}:{text.lines[0]}",
            fix="Name the columns time (or frame), x, y, z, qx, qy, qz, qw.",
        )
    table = numbers(rows, len(names), [names.index(name) for name in (clock, *_POSE)])
    fps = 1.0 if clock == "time" else stated_fps(path)
    return animate(
        Keyframes(
            source=path,
            times=table.values[:, 0] / fps,
            positions=table.values[:, 1:4],
            xyzw=table.values[:, 4:],
            modes=_modes(rows, names),
            up=stated_up(path),
            places=tuple(table.place(row) for row in range(len(table.lines))),
        )
    )


def _names(fields: list[str] | tuple[str, ...]) -> list[str]:
    return [field.strip().strip("\"'").lower() for field in fields]


def _separator(path: Path) -> str:
    header = first_row(path)
    return max(",;\t", key=header.count)


def _modes(rows: TextRows, names: list[str]) -> tuple[Mode, ...]:
    usual = stated(rows.path).get("interpolation", "smooth")
    known: dict[str, Mode] = {mode: mode for mode in MODES}
    if usual not in known:
        raise unknown_word(rows.path, "interpolation", usual)
    if "interpolation" not in names:
        return (known[usual],) * len(rows.rows)
    column = names.index("interpolation")
    modes: list[Mode] = []
    for fields, line in zip(rows.rows, rows.lines, strict=True):
        word = fields[column].strip("\"'").lower() or usual
        if word not in known:
            raise InputError(
                "interpolation-unknown",
                f"{word[:30]!r} is no interpolation that is played.",
                where=f"{rows.path}:{line}",
                fix=f"Write one of {', '.join(MODES)}; bake other curves to keys in every frame.",
            )
        modes.append(known[word])
    return tuple(modes)
