"""The figures into a file that appears whole or not at all."""

import json
from pathlib import Path

from capture_app.comparison.arrange import Comparison
from omomo_core.motion import FPS
from omomo_core.whole_file import write_whole


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
