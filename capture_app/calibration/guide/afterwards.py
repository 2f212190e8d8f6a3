"""What comes after a mount: the floor refines it, and what is still open is told with its remedy."""

from pathlib import Path
from shlex import join

from capture_app.calibration.guide.finding import Finding
from capture_app.calibration.guide.prompt import Prompt
from capture_app.calibration.guide.steps import GuideState
from capture_app.calibration.guide.wizard import command_line
from ingest.calibration.drawing import numbers
from ingest.calibration.floor_contacts import find_contacts, flat_sides, standings, track
from ingest.calibration.posterior import TILT_IT
from ingest.formats.registry import read_session
from ingest.mesh import load_mesh
from ingest.mount import Mount
from ingest.mount_file import load_mount
from ingest.session import CaptureSession
from ingest.uncertainty import bounds_95
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_SURE_MM, _SURE_DEG = 15.0, 2.0
"""95 % bounds within which hands are seen to hold the object."""


def refine_by_floor(prompt: Prompt, state: GuideState, path: Path, output: Path) -> Path:
    """Offer to let the floor refine a mount; the file to use then.

    Args:
        talk: asks and tells.
        known: with the mesh.
        path: of the mount.
        output: of the refined mount.
    """
    assert state.mesh_file is not None
    prompt.heading("The floor")
    mount = load_mount(path)
    mesh = load_mesh(state.mesh_file, scale=mount.object_scale)
    recording = _recording(prompt, state, mount, mesh)
    if recording is None or not prompt.yes("Let it refine the mount?", default=True):
        return path
    height = prompt.until_right(lambda: _height(prompt))
    words = ["floor", str(path), str(recording), "--object", str(state.mesh_file)]
    words += [*(["--phone-height", height] if height else []), "-o", str(output)]
    prompt.command(command_line(words))
    try:
        state.run(words)
    except InputError as error:
        prompt.problem(error)
        prompt.tell(f"{path} stays as it is.")
        return path
    return output


def _recording(prompt: Prompt, state: GuideState, mount: Mount, mesh: ObjectMesh) -> Path | None:
    """One in which the object stands on the floor, if there is one."""
    path = state.session_file
    while True:
        try:
            if path is not None:
                session = state.session if path == state.session_file else None
                session = session or read_session(path)
                prompt.good(standing(session, mesh, mount).good)
                return path
        except InputError as error:
            prompt.tell(f"In {path} the floor tells nothing: {error.what} {error.fix}")
        path = prompt.maybe_path(
            "A recording, with the phone on it, in which the object stands on the floor for two "
            "seconds (Enter: none)"
        )
        if path is None:
            return None


def standing(session: CaptureSession, mesh: ObjectMesh, mount: Mount) -> Finding:
    """How often the object stands on the floor in a recording.

    Raises:
        InputError: of `ingest.calibration.floor_contacts.track` and
            `ingest.calibration.floor_contacts.standings`.
    """
    found = standings(find_contacts(track(session)), flat_sides(mesh), mount, str(session.source))
    rests = sum(one.contact.kind == "rest" for one in found)
    pushed = f", and is pushed over it {len(found) - rests} times" if len(found) > rests else ""
    return Finding(f"in the recording the object rests on the floor {rests} times{pushed}")


def _height(prompt: Prompt) -> str:
    answer = prompt.ask(
        "Metres from the floor up to the lens, where the object first rests (Enter: not measured)",
        "",
    )
    if answer:
        numbers(answer, 1, "the height")
    return answer


def print_closing_advice(prompt: Prompt, state: GuideState, best: Path) -> None:
    """Which file to use and how, what is still open, and what would make it surer."""
    mount = load_mount(best)
    prompt.heading("Done")
    for free in mount.free:
        prompt.doubt(f"Still open: {free}.")
    bounds = bounds_95(mount.covariance) if mount.covariance is not None else None
    sure = bounds is not None and bounds.mm < _SURE_MM and bounds.deg < _SURE_DEG
    if mount.free and not any(TILT_IT in free for free in mount.free):
        prompt.tell(
            "Record once more and turn the object about two directions, by 20 degrees or more."
        )
    if mount.free or not sure:
        prompt.tell(
            "To be surer, calibrate in another way too (omocap calibrate), then combine both:"
        )
        prompt.command(command_line(["combine", str(best), "OTHER.json", "-o", "BOTH.json"]))
    prompt.tell("Use it:")
    words = [
        "run",
        "RECORDING",
        "--object",
        str(state.mesh_file),
        "--mount",
        str(best),
        "-o",
        "OUT",
    ]
    prompt.command(f"omocap {join(words)}")
