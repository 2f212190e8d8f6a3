"""The whole chain on files: calibrate from one recording, run another with the mount, compare."""

import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from capture_app.simulator.carried_box import box_mesh, carried_box, clamped_phone
from capture_app.simulator.noise import PhoneNoise
from capture_app.simulator.phone import arkit_from_world, simulate
from capture_app.simulator.recording import write_recording
from capture_app.simulator.wiggle import wiggle_motion
from ingest.calibration.board.sheet import preset_for
from ingest.formats import stray_scanner
from ingest.formats.detect import read_session
from ingest.mount_file import load_mount
from ingest.trajectory.object_motion import to_object_motion
from omomo_core.geometry.transforms import inverse
from tests.simulator.witness import board_on_box, record_witness, tripod


def chain(seed: int = 0) -> tuple[float, float]:
    """mm and deg (95th percentiles over the take) between the object's poses and the truth.

    A phone without drift but with jitter; the board's film is drawn, written as H.264 and read.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _record(folder, seed)
        code = invoke(
            [
                *("calibrate", "board", str(folder / "wiggle"), str(folder / "board.mp4")),
                *("--board", "A4", "--board-place", str(folder / "place.json")),
                *("--camera", str(folder / "camera.json"), "-o", str(folder / "mount.json")),
            ]
        )
        if code:
            raise SystemExit(code)
        mm, deg = _compare(folder)
    print(
        f"\nchain: object's pose off by {mm:.2f} mm and {deg:.3f} deg (95 % of the take's frames)"
    )
    return mm, deg


def _record(folder: Path, seed: int) -> None:
    """Both sessions of the phone, the witness's film and where the board is."""
    mount, quiet = clamped_phone(), replace(PhoneNoise(), drift=0.0)
    board, wiggle = preset_for("A4"), wiggle_motion(seed=seed)
    write_recording(
        simulate(wiggle, mount, seed=seed, noise=quiet),
        folder / "wiggle",
        None,
        format_=stray_scanner,
    )
    write_recording(
        simulate(carried_box(), mount, seed=seed + 1, noise=quiet),
        folder / "take",
        None,
        format_=stray_scanner,
    )
    on_box = board_on_box(board)
    witness = tripod(rate=15.0, start=0.7)
    record_witness(folder / "board.mp4", wiggle, board, on_box, witness, seed=seed)
    corners = [0, 3, 12, 20]
    at = board.corners[corners] @ on_box[:3, :3].T + on_box[:3, 3]
    points = [{"corner": c, "object": p.tolist()} for c, p in zip(corners, at, strict=True)]
    (folder / "place.json").write_text(json.dumps({"points": points, "sigma_mm": 0.5}))


def _compare(folder: Path) -> tuple[float, float]:
    """The take with the calibrated mount against the motion that was simulated, in ARKit's world."""
    take = to_object_motion(
        read_session(folder / "take"), box_mesh(), load_mount(folder / "mount.json")
    )
    made = inverse(take.T_world_arkit) @ take.motion.T_world_object
    truth = carried_box().T_world_object
    start = truth[0] @ inverse(clamped_phone().T_phone_object)
    truth = arkit_from_world(start) @ truth
    count = min(len(made), len(truth))
    off = inverse(truth[:count]) @ made[:count]
    mm = 1e3 * np.linalg.norm(made[:count, :3, 3] - truth[:count, :3, 3], axis=1)
    deg = np.degrees(Rotation.from_matrix(off[:, :3, :3]).magnitude())
    return float(np.quantile(mm, 0.95)), float(np.quantile(deg, 0.95))


if __name__ == "__main__":
    chain()
