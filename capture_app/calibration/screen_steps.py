"""Steps about the phone's own screen, which shows a board to another camera."""

from capture_app.calibration.guide_recordings import photographed_boards
from capture_app.calibration.guide_steps import AgainError, GuideState, GuideStep, Prompt, Words
from ingest.calibration.screen.shown import TURNS, screen_board

_SHOW = (
    "Send the picture to the phone without shrinking it (AirDrop, Files). Lock the rotation upright, "
    "open it full screen, not zoomed; brightness up, automatic lock off.",
    "Clamp the phone with its screen to the outside.",
)
_TURNED = "By how many degrees clockwise does the picture stand on the screen (0, 90, 180, 270)?"


def _ask_shown(prompt: Prompt, state: GuideState) -> Words:
    board = screen_board(state.model)
    if prompt.yes("Write the picture that the phone is to show?", default=True):
        words = ["-o", str(state.fresh("screen.png")), "--phone", state.model.name]
        state.run(["screen", "--show", *words])
    prompt.good(f"{state.model.name} shows {board}")
    turned = prompt.choose(_TURNED, [f"{turn} degrees" for turn in TURNS])
    return ["--turned", str(TURNS[turned])] if turned else []


SHOWN = GuideStep("The phone's screen", _SHOW, _ask_shown, ())


def _photos(*, with_board: bool):
    def ask(prompt: Prompt, state: GuideState) -> Words:
        folder = prompt.path("Folder of the photos")
        prompt.tell("Looking at some of them...")
        boards = {"the phone's screen": screen_board(state.model)}
        if with_board:
            boards["the printed board"] = state.printed
        if not prompt.accept(photographed_boards(folder, boards)):
            raise AgainError
        return [str(folder)]

    return ask


PHOTOS = GuideStep(
    "Photos",
    (
        "With one camera at one zoom, take ten to twenty photos from several sides, half a metre "
        "away. The screen and the printed board are in each of them, both seen at a slant (20 to 50 "
        "degrees), without reflections. Nothing moves meanwhile.",
    ),
    _photos(with_board=True),
    ("PHOTOS",),
)
SCAN_PHOTOS = GuideStep(
    "The scan's photos",
    (
        "Scan the object with the phone on it: with one camera at one zoom, photos from all sides, "
        "in ten or more of which the screen is seen at a slant, without reflections. Make the "
        "COLMAP model of them, and the object's mesh of that model.",
    ),
    _photos(with_board=False),
    ("PHOTOS",),
)


def _ask_metres(prompt: Prompt, state: GuideState) -> Words:
    if prompt.yes(
        "Is the model in metres? (COLMAP alone does not know how large things are)", default=False
    ):
        return []
    prompt.good("its scale is taken from the screen")
    return ["--scale"]


METRES = GuideStep("Its scale", (), _ask_metres, ("--scale",))
