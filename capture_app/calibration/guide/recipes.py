"""The ways to calibrate, by what a person has: the surest with little effort first."""

from collections.abc import Sequence

from capture_app.calibration.guide import file_steps as files
from capture_app.calibration.guide import record_steps as record
from capture_app.calibration.guide import screen_steps as screen
from capture_app.calibration.guide.board_steps import PRINT, place
from capture_app.calibration.guide.phone_steps import DRAWN_PLACE, DRAWN_TURN, MODEL, PICKED
from capture_app.calibration.guide.steps import Recipe

RECIPES: Sequence[Recipe] = (
    Recipe(
        "board",
        "board",
        "a printer, and a second camera or phone on a tripod (surest)",
        (files.MESH, PRINT, place("--board-place"), record.WITNESSED, record.FILM),
    ),
    Recipe(
        "filmed",
        "session",
        "a printer, and only the phone",
        (files.MESH, PRINT, place("--board-place"), record.FILMED),
    ),
    Recipe(
        "meshed",
        "session",
        "only the phone, and its app makes a mesh of what it sees (LiDAR)",
        (files.MESH, record.SCANNED, files.SCAN),
    ),
    Recipe(
        "scan",
        "scan",
        "a scan of the object with its surroundings (a COLMAP model)",
        (
            files.MESH,
            files.colmap(),
            files.MODEL_PICTURES,
            files.to_object("--model-to-object"),
            record.STOOD,
        ),
    ),
    Recipe(
        "screen",
        "screen",
        "a printer and a second camera, but the object cannot be moved about; its phone's screen is "
        "outside",
        (files.MESH, MODEL, screen.SHOWN, PRINT, place("--place"), screen.PHOTOS),
    ),
    Recipe(
        "screen-scan",
        "screen",
        "a second camera and COLMAP, no printer; the phone's screen is outside",
        (
            files.MESH,
            MODEL,
            screen.SHOWN,
            screen.SCAN_PHOTOS,
            files.colmap("--model"),
            files.to_object("--to-object"),
            screen.METRES,
        ),
    ),
    Recipe(
        "tracker",
        "tracker",
        "motion capture, or a tracker on the object",
        (files.MESH, record.TRACKED, record.POSES),
    ),
    Recipe(
        "drawing",
        "drawing",
        "a drawing of the holder (printed in 3D, milled)",
        (files.MESH, MODEL, DRAWN_PLACE, DRAWN_TURN),
    ),
    Recipe(
        "points",
        "points",
        "only a ruler (quick, rough)",
        (files.MESH, MODEL, PICKED),
    ),
)
