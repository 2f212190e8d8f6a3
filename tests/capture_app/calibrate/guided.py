"""What a person answers to the guide, and what the conversation leaves behind."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from capture_app.calibration.guide_flow import RECIPES
from capture_app.simulator.demo_take import box_mesh, clamped_phone
from ingest.calibration.board.board_spec import PRESETS
from ingest.calibration.drawn_mount import body_of_camera
from ingest.calibration.phone_body import phone_body, phone_named
from ingest.mount import Mount
from ingest.uncertainty import between
from omomo_core.geometry.transforms import inverse

PHONE = phone_named("iPhone 15")
BOARD = PRESETS["A4"]
NUMBER = {recipe.have: str(k + 1) for k, recipe in enumerate(RECIPES)}
BY_BOARD, _, BY_SESSION, _, BY_TRACKER, BY_DRAWING, BY_POINTS = NUMBER.values()


@dataclass(frozen=True)
class Told:
    """What a conversation left behind."""

    code: int
    out: str
    err: str

    @property
    def commands(self) -> list[list[str]]:
        """The command lines of `omocap calibrate` that were printed to be repeated."""
        lines = [line.strip() for line in self.out.splitlines()]
        return [shlex.split(line)[2:] for line in lines if line.startswith("omocap calibrate ")]


def write_mesh(path: Path) -> None:
    mesh = box_mesh()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)


def numbers(values: Sequence[float] | np.ndarray) -> str:
    return " ".join(f"{x:.5f}" for x in values)


def drawn(mount: Mount) -> list[str]:
    """What a drawing of this mount says, as the guide asks it."""
    T_object_phone = inverse(mount.T_phone_object)
    T_object_body = T_object_phone @ phone_body(PHONE)[0]
    R = body_of_camera(T_object_phone[:3, :3])
    axes = f"screen faces ({numbers(R[:, 2])}), top edge points ({numbers(R[:, 1])})"
    return ["iPhone 15", "centre front", numbers(T_object_body[:3, 3]), axes, "1"]


DRAWING = [BY_DRAWING, "mount.json", "box.obj", *drawn(clamped_phone()), "y"]


def off(found: Mount, truth: Mount) -> tuple[float, float]:
    step = between(found.T_phone_object, truth.T_phone_object)
    return 1e3 * float(np.linalg.norm(step[3:])), float(np.degrees(np.linalg.norm(step[:3])))
