"""Results that tests make without generating anything, and what a camera saw of them."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from capture_app.manifest import (
    MANIFEST,
    MOTION,
    BodyRecord,
    FloorRecord,
    Input,
    Manifest,
    Segment,
    sha256,
    write_manifest,
)
from capture_app.result import Result, load_result, save_motion
from capture_app.simulator.demo_take import write_recording
from capture_app.simulator.simulated_phone import PhoneNoise, simulate
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import PRESETS
from ingest.calibration.board.board_track import BoardTrack
from ingest.mount import Mount
from ingest.mount_file import save_mount
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body
from omomo_core.generation.person import Person
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import HumanMotion, ObjectMotion
from tests.simulator.witness import Witness, board_on_box, corner_observations

BOARD = PRESETS["A4"]
PLACE = board_on_box(BOARD)
LENS = (0.1, -0.15, 0.001, -0.001, 0.0)


@dataclass(frozen=True)
class Watched:
    """What was, and what a camera saw of it."""

    motion: ObjectMotion
    human: HumanMotion
    witness: Witness

    def track(self, *, sigma: float = 0.3, seed: int = 0) -> BoardTrack:
        """What the detector would find of the board in the witness's pictures."""
        camera = self.witness.camera
        T = self.witness.board_poses(self.motion, PLACE)
        pixels, numbers = corner_observations(
            T, BOARD, camera, np.random.default_rng(seed), sigma=sigma, lost=0.1
        )
        return track_of(pixels, numbers, self.witness.times(self.motion), camera)


def track_of(pixels, numbers, times, camera) -> BoardTrack:
    poses = board_poses(pixels, numbers, BOARD, camera.K, camera.lens)
    sure = ~poses.ambiguous
    kept = poses.frames[sure]
    return BoardTrack(
        times=times[kept],
        T_camera_board=poses.T_camera_board[sure],
        covariance=poses.covariance[sure],
        rms=poses.rms[sure],
        corners=poses.corners[sure],
        pixels=[pixels[k] for k in kept],
        numbers=[numbers[k] for k in kept],
        board=BOARD,
        camera=camera,
        sigma=poses.sigma,
        pictures=len(times),
    )


def standing(frames: int, x: float) -> HumanMotion:
    """A T-pose that faces +x."""
    body = load_body()
    facing = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    rotations = np.tile(facing, (frames, 22, 1, 1))
    height = float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
    root = np.tile([x, 0.0, height], (frames, 1))
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    fingers = np.tile(body.relaxed_fingers.numpy(), (frames, 1, 1, 1))
    nothing = np.zeros((frames, 2))
    return HumanMotion(root, rotations, fingers, joints, nothing, np.ones((frames, 4)))


def write_result(folder: Path, take: Watched, *, animated: bool = True, **inputs: Path) -> Result:
    """A result folder with one sample."""
    folder.mkdir(parents=True, exist_ok=True)
    frames = len(take.human.root)
    person = Person(take.human, (), np.zeros((frames, 2)), np.zeros(frames))
    save_motion(folder / MOTION, [person], 0, take.motion, "anny")
    manifest = Manifest(
        inputs=tuple(
            Input(role=role, path=str(path), sha256=sha256(path)) for role, path in inputs.items()
        ),
        options={"animated": animated},
        segment=Segment(index=1, count=1, start=0, stop=frames),
        floor=FloorRecord(height=0.0, source="given"),
        mount_method="truth",
        body=BodyRecord(name="anny", credit="", height=load_body().height),
        weights={},
        scores=({},),
        chosen=0,
        notes=(),
        faults=(),
        timings={},
        files=(),
    )
    write_manifest(folder / MANIFEST, manifest)
    return load_result(folder)


PHONE = Mount(
    inverse(np.array([[0.0, 0, 1, 0.3], [1, 0, 0, 0.1], [0, 1, 0, 0.25], [0, 0, 0, 1]])),
    "truth",
)
"""The phone sits before the box and looks back at the person: its -z is the box's -x."""


def phone_take(watched: Watched, folder: Path) -> Result:
    """A result of an object with a phone, for a second; it filmed grey pictures."""
    short = slice(0, 32)
    motion = replace(
        watched.motion,
        T_world_object=watched.motion.T_world_object[short],
        valid=watched.motion.valid[short],
    )
    take = replace(watched, motion=motion, human=standing(32, -0.5))
    # A result follows the phone where it drifted; this one is the truth.
    session = simulate(motion, PHONE, seed=0, noise=PhoneNoise(drift=0.0))
    grey = (np.full((60, 80, 3), 128, np.uint8) for _ in session.times)
    write_recording(session, folder / "session", grey)
    save_mount(PHONE, folder / "mount.json")
    return write_result(
        folder / "result",
        take,
        animated=False,
        session=folder / "session",
        mount=folder / "mount.json",
    )
