"""A capture with markers that never was: an object that moves, what a recorder would write of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

NAMES = ("M1", "M2", "M3", "M4", "M5")


@dataclass(frozen=True)
class Capture:
    """Markers on an object whose scan has another unit, axes and origin."""

    times: np.ndarray
    points: np.ndarray
    """(T, 5, 3), metres."""
    places: np.ndarray
    """(5, 3), as they sit on the scan, in its unit."""
    T: np.ndarray
    """(T, 4, 4) of the scan in metres."""
    scale: float
    """Metres per unit of the scan."""

    def pose_at(self, times: np.ndarray) -> np.ndarray:
        """The truth at any time: it is a formula."""
        return moving(times, self.turn)

    turn: np.ndarray
    """What the motion is a formula of."""


def moving(times: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """A smooth way and turn."""
    T = np.tile(np.eye(4), (len(times), 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(np.sin(1.3 * times)[:, None] * turn).as_matrix()
    T[:, :3, 3] = np.stack([0.5 * times, 0.3 * np.sin(times), 0.8 + 0.2 * np.cos(times)], axis=1)
    return T


def capture(
    rng: np.random.Generator, seconds: float = 2.0, fps: float = 120.0, noise: float = 0.0
) -> Capture:
    """Five markers on something of half a metre."""
    scale = float(10 ** rng.uniform(-2.5, 1.0))
    spots = rng.uniform(-0.3, 0.3, (5, 3))
    spots[:4] = (
        np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.15 + 0.3 * spots[:4]
    )
    spots += rng.normal(0, 0.3, 3)
    turn = rng.normal(0, 0.6, 3)
    times = 5.0 + np.arange(round(seconds * fps) + 1) / fps
    T = moving(times, turn)
    points = spots @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    points += rng.normal(0, noise, points.shape)
    return Capture(times, points, spots / scale, T, scale, turn)


def write_npz(path: Path, made: Capture, **more: object) -> Path:
    """Tracks as npz, metres."""
    arrays = {"points": made.points, "names": np.array(NAMES), "times": made.times, **more}
    np.savez(path, **arrays)  # pyright: ignore[reportArgumentType]
    return path


def write_csv(path: Path, made: Capture) -> Path:
    """Tracks as plain CSV, metres; empty where a marker is not seen."""
    lines = ["time," + ",".join(f"{name}_{axis}" for name in NAMES for axis in "xyz")]
    for time, points in zip(made.times, made.points, strict=True):
        lines.append(f"{time:.6f}," + ",".join(_field(x, 1.0) for x in points.ravel()))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_vicon(path: Path, made: Capture, others: bool = True) -> Path:
    """Tracks as Vicon's programs export them, in millimetres, after the section of another device."""
    rate = 1.0 / float(np.median(np.diff(made.times)))
    lines = [
        "Devices",
        "1000",
        ",,Force",
        "Frame,Sub Frame,Fx",
        ",,N",
        "1,0,0.5",
        "",
        "Trajectories",
    ]
    names = [*(f"Chair:{name}" for name in NAMES), *(["Person:LFHD"] if others else [])]
    lines += [f"{rate:g}", ",," + ",,,".join(names)]
    lines += ["Frame,Sub Frame" + ",X,Y,Z" * len(names), ",," + ",".join(["mm"] * 3 * len(names))]
    for time, points in zip(made.times, made.points, strict=True):
        fields = [_field(x, 1000.0) for x in points.ravel()] + ["1", "2", "1700"] * others
        lines.append(f"{round(time * rate)},0," + ",".join(fields))
    path.write_text(
        "\r\n".join([*lines, "", "Model Outputs", "100"]) + "\r\n", encoding="utf-8-sig"
    )
    return path


def write_places(path: Path, places: np.ndarray) -> Path:
    """Where the markers sit on the scan."""
    rows = [
        f"{name},{x:.9g},{y:.9g},{z:.9g}" for name, (x, y, z) in zip(NAMES, places, strict=True)
    ]
    path.write_text("\n".join(["name,x,y,z", *rows]) + "\n")
    return path


def _field(value: float, unit: float) -> str:
    return f"{value * unit:.6f}" if np.isfinite(value) else ""
