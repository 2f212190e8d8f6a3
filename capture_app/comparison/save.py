"""Pictures and figures into files that appear whole or not at all."""

import json
from collections.abc import Iterator
from pathlib import Path

from capture_app.comparison.arrange import Comparison
from omomo_core.motion import FPS
from omomo_core.whole_file import write_whole
from render.stills import write_png
from render.strips import Picture
from render.video import write_moving


def stride(path: Path) -> int:
    """Ticks from picture to picture: a video has all, a loop for a web page every second one."""
    return 1 if path.suffix == ".mp4" else 2


def save_pictures(path: Path, pictures: Iterator[Picture]) -> None:
    """Write pictures as the file's ending says: a .png the first, others all, at their stride.

    Raises:
        InputError: the file cannot be written.
    """
    if path.suffix == ".png":
        write_png(path, next(pictures))
    else:
        write_moving(path, pictures, FPS / stride(path))


def save_figures(path: Path, made: Comparison) -> None:
    """Write every figure and note as JSON.

    Raises:
        InputError: the file cannot be written.
    """
    rows = [
        {
            "label": c.label,
            "truth": c.truth,
            "begins_s": c.begin / FPS,
            "lasts_s": len(c.human.root) / FPS,
            "figures": figures,
        }
        for c, figures in zip(made.contenders, made.figures, strict=True)
    ]
    text = json.dumps({"motions": rows, "notes": made.notes}, indent=1) + "\n"
    write_whole(path, text)
