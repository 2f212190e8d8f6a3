"""Steps in which something is recorded: by the clamped phone, by a second camera, by a tracker."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from capture_app.calibration.guide.film import filmed_board, filmed_then_clamped
from capture_app.calibration.guide.finding import Finding
from capture_app.calibration.guide.prompt import Prompt
from capture_app.calibration.guide.recording import filmed_rest, rested_recording, turned_recording
from capture_app.calibration.guide.steps import AgainError, GuideState, GuideStep, Words
from ingest.calibration.board.camera_file import load_camera
from ingest.calibration.hand_eye.to_mount import read_pose_log
from ingest.calibration.pose_file import load_pose
from ingest.formats.registry import read_session
from ingest.session import CaptureSession


def _recording(check: Callable[[CaptureSession, GuideState], Finding], *words: str):
    """What asks for a recording that passes a check."""

    def ask(prompt: Prompt, state: GuideState) -> Words:
        path = prompt.path("Folder or archive of the recording", state.session_file)
        session = read_session(path)
        if not prompt.accept(check(session, state)):
            raise AgainError
        state.session_file, state.session = path, session
        return [*words, str(path)]

    return ask


_CLAMP = "clamp the phone to the object without stopping the log. Keep the lens uncovered."
_REST = (
    "Let go: leave object and phone alone for two seconds, where the object still stands as before."
)
_END = (
    "If you go on to move the object in the same recording, put it back on its mark at the end and "
    "leave it alone for two seconds: that tells whether the phone slipped. Then stop."
)
_MARK = (
    "Put the object where there is light and much to see, and mark on the floor where it stands."
)
_TURN = (
    "Let the object stand on the floor for two seconds with nobody touching it, so that the floor "
    "can help later. Then turn it for 20 seconds by 30 to 60 degrees about two directions (let it "
    "nod, and shake its head), not too fast. A thing that can only be pushed will do, but its height "
    "stays open then.",
    "Put it down, leave it alone for two seconds, and stop both.",
)

SCANNED = GuideStep(
    "Record",
    (
        _MARK,
        "Start the log, in an app that logs ten poses a second or more and gives a mesh of the same "
        "recording in the same world (3D Scanner App with All Data if it is that fast; Stray Scanner, "
        "if you make the mesh from its depth maps).",
        "Walk round the object twice, at knee height and above it, with the room in the picture too. "
        "Do not move the object.",
        f"Then {_CLAMP}",
        _REST,
        _END,
    ),
    _recording(lambda session, _: rested_recording(session)),
    ("RECORDING",),
)
FILMED = GuideStep(
    "Record",
    (
        _MARK,
        "Start the log, in an app that films while it logs (Stray Scanner).",
        "Film the board on the object from several sides for ten seconds, from half a metre away, "
        "then walk once round the object.",
        f"Then {_CLAMP}",
        _REST,
        _END,
    ),
    _recording(lambda session, state: filmed_then_clamped(session, state.printed)),
    ("RECORDING",),
)
STOOD = GuideStep(
    "Record",
    (
        "Put the object where it stood when it was scanned, in the same place and the same light: "
        "what the clamped phone looks at must be in the scan.",
        "Clamp the phone, and start the log in an app that films while it logs (Stray Scanner, "
        "Record3D).",
        _REST,
        _END,
    ),
    _recording(lambda session, _: filmed_rest(session), "--session"),
    ("--session", "RECORDING"),
)
WITNESSED = GuideStep(
    "Record",
    (
        "Put the second camera on a tripod, one to two metres away, so that the board fills a third "
        "of the picture. Lock its focus, its zoom and its exposure; switch off mirroring.",
        "Clamp the phone, with its back camera towards a lit room with much to see. Start its log, "
        "then the film of the second camera. Their clocks need not agree.",
        *_TURN,
    ),
    _recording(lambda session, _: turned_recording(session)),
    ("RECORDING",),
)
TRACKED = GuideStep(
    "Record",
    (
        "Fix the markers or the tracker to the object, and the phone to the object, so that nothing "
        "gives.",
        "Start both logs. Their clocks need not agree.",
        *_TURN,
    ),
    _recording(lambda session, _: turned_recording(session)),
    ("RECORDING",),
)


def _ask_film(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("What the second camera recorded: a video, or a second phone's session")
    prompt.tell("Looking at it...")
    if not prompt.accept(filmed_board(path, state.printed)):
        raise AgainError
    question = "File with that camera's intrinsics (Enter: they are found from the film)"
    return [str(path), *_optional(prompt, question, "--camera", load_camera)]


FILM = GuideStep("The film", (), _ask_film, ("FILM",))


def _ask_poses(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("The tracker's log: lines of t x y z qx qy qz qw")
    stream = read_pose_log(path)
    rate = 1 / float(np.median(np.diff(stream.times)))
    seconds = float(np.ptp(stream.times))
    prompt.good(f"{len(stream.times):,} poses, {rate:.0f} a second, {seconds:.0f} s")
    question = "File with the tracked body's pose on the mesh (Enter: it has the mesh's frame)"
    return [str(path), *_optional(prompt, question, "--body", load_pose)]


def _optional(prompt: Prompt, question: str, option: str, load: Callable[[Path], object]) -> Words:
    """A file that there may be, once it can be read."""

    def attempt() -> Words:
        path = prompt.maybe_path(question)
        if path is None:
            return []
        load(path)
        return [option, str(path)]

    return prompt.until_right(attempt)


POSES = GuideStep(
    "The tracker's log",
    (
        "Export the object's pose in its own resting frame, seconds and metres, quaternions with w "
        "last; blanks or commas between the numbers.",
    ),
    _ask_poses,
    ("POSES",),
)
