"""Boards: a sheet to print, and a picture for the phone's screen."""

from pathlib import Path
from typing import Any

from omomo_core.whole_file import whole_file


def board_sheet(paper: str, target: Path) -> dict[str, Any]:
    """Write the PDF of the board that fills a sheet of this paper.

    Raises:
        InputError: "paper-unknown".
    """
    from ingest.calibration.board.sheet import preset_for, write_sheet

    with whole_file(target) as partial:
        write_sheet(preset_for(paper), paper, partial)
    return {}


def screen_sheet(phone: str, target: Path) -> dict[str, Any]:
    """Write the PNG that a phone is to show full screen.

    Raises:
        InputError: "phone-unknown" or "screen-unknown".
    """
    import numpy as np

    from ingest.calibration.phone.body import phone_named
    from ingest.calibration.screen.shown import screen_picture
    from render.stills import write_png

    grey = screen_picture(phone_named(phone))
    write_png(target, np.repeat(grey[..., None], 3, axis=2))
    return {}
