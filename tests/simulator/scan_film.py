"""A phone that films a thing all around, for a scan: the files that it leaves, and the truth."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from capture_app.simulator.simulated_phone import BOOT_SECONDS, arkit_from_world, disturb
from ingest.axes import T_ZUP_ARKIT
from ingest.formats import scanner_3d
from ingest.formats.registry import Format
from ingest.formats.still_images import load_millimetres, save_millimetres
from ingest.session import CaptureSession, DepthLog
from tests.log_writers import write_session
from tests.simulator.scan_camera import FilmErrors, lidar, photographed
from tests.simulator.scan_scene import ScanScene, film, intrinsics, orbit_poses

RATE = 3.0
"""Pictures a second."""
_QUALITY = 92


@dataclass(frozen=True)
class ScanFilm:
    """What a phone has filmed."""

    scene: ScanScene
    path: Path
    """Session folder, or folder of photos."""
    T_world_phone: Float64[np.ndarray, "pictures 4 4"]
    """Where the camera really was at each picture, in the scene's world."""
    T_scan_world: Float64[np.ndarray, "4 4"]
    """Maps the scene's world into the session's, turned z up: there a scan should come out."""
    width: int

    @property
    def T_scan_object(self) -> Float64[np.ndarray, "4 4"]:
        """Where the thing stands in the scan."""
        return self.T_scan_world @ self.scene.T_world_object


def around(
    scene: ScanScene, count: int, *, seed: int = 0, turns: int = 0, arc: float = 360.0
) -> Float64[np.ndarray, "count 4 4"]:
    """T_world_phone of a walk around the thing at two heights, in hands that are not quite still.

    Args:
        scene: what is filmed.
        count: of poses.
        seed: of the hands.
        turns: quarter turns counter-clockwise by which the phone is held: 1 is upright.
        arc: see `orbit_poses`.
    """
    tall = float(np.ptp(scene.mesh.vertices[:, 2]))
    T = orbit_poses(scene, count, height=tall / 2, distance=max(1.1, 1.4 * tall), arc=arc)
    rng = np.random.default_rng(seed)
    sway = gaussian_filter1d(rng.normal(size=(count, 6)), 2.0, axis=0)
    T[:, :3, 3] += 0.04 * sway[:, :3]
    held = Rotation.from_euler("z", 90 * turns, degrees=True)
    T[:, :3, :3] = T[:, :3, :3] @ (Rotation.from_rotvec(0.05 * sway[:, 3:]) * held).as_matrix()
    return T


def film_session(
    scene: ScanScene,
    folder: Path,
    *,
    count: int = 80,
    width: int = 960,
    seed: int = 0,
    errors: FilmErrors | None = None,
    depth: bool = False,
    turns: int = 0,
    arc: float = 360.0,
    format_: Format = scanner_3d,
) -> ScanFilm:
    """Film a thing with an app that logs poses with single pictures; writes its session.

    Args:
        scene: what is filmed.
        folder: gets the session.
        count: of pictures.
        width: of the pictures, which are 3/4 as high, pixels.
        seed: of all errors.
        errors: of pictures, poses and depth.
        depth: also LiDAR's depth maps, with confidence as 3D Scanner App writes it.
        turns, arc: see `around`.
        format_: the app's layout; one with single pictures.
    """
    errors = errors or FilmErrors()
    rng = np.random.default_rng(seed)
    T_world_phone = around(scene, count, seed=seed, turns=turns, arc=arc)
    T_arkit_world = arkit_from_world(T_world_phone[0])
    times = BOOT_SECONDS + np.arange(count) / RATE
    with tempfile.TemporaryDirectory() as temporary:
        shots = Path(temporary)
        for k, (picture, metres) in enumerate(film(scene, T_world_phone, width)):
            _save(photographed(picture, errors, rng), shots / f"{k:05d}.jpg")
            if depth:
                _save_depth(*lidar(metres, errors, rng), shots, folder, k)
        maps = tuple(shots / f"depth_{k:05d}.png" for k in range(count))
        session = CaptureSession(
            app=format_.NAME,
            source=Path("simulated"),
            times=times,
            T_world_phone=disturb(T_arkit_world @ T_world_phone, errors.poses, rng),
            intrinsics=np.tile(intrinsics(width), (count, 1)),
            image_size=(width, 3 * width // 4),
            images=tuple(shots / f"{k:05d}.jpg" for k in range(count)),
            video_times=times,
            depth=DepthLog(times, maps, load_millimetres) if depth else None,
        )
        path = write_session(format_, session, folder)
    return ScanFilm(scene, path, T_world_phone, T_ZUP_ARKIT @ T_arkit_world, width)


def film_photos(
    scene: ScanScene,
    folder: Path,
    T_world_phone: Float64[np.ndarray, "pictures 4 4"],
    *,
    width: int = 960,
    seed: int = 0,
    errors: FilmErrors | None = None,
) -> ScanFilm:
    """Photograph a thing from these poses into a folder of JPEG files, with nothing but pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, picture in enumerate(_photos(scene, T_world_phone, width, seed, errors or FilmErrors())):
        _save(picture, folder / f"{k:05d}.jpg")
    return ScanFilm(scene, folder, T_world_phone, np.eye(4), width)


def _photos(
    scene: ScanScene,
    T_world_phone: Float64[np.ndarray, "pictures 4 4"],
    width: int,
    seed: int,
    errors: FilmErrors,
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    rng = np.random.default_rng(seed)
    for picture, _ in film(scene, T_world_phone, width):
        yield photographed(picture, errors, rng)


def _save(picture: UInt8[np.ndarray, "h w 3"], file: Path) -> None:
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(file), bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])


def _save_depth(
    metres: Float32[np.ndarray, "192 256"],
    confidence: UInt8[np.ndarray, "192 256"],
    shots: Path,
    folder: Path,
    k: int,
) -> None:
    """The app's format writes the depth; it knows no confidence."""
    save_millimetres(metres, shots / f"depth_{k:05d}.png")
    folder.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(folder / f"conf_{k:05d}.png"), confidence)
