"""The COLMAP model of a filmed scene: made by pycolmap, or at once from the drawn depth."""

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8
from scipy.spatial.transform import Rotation

from ingest.calibration.scan_landmarks import find_features
from ingest.colmap import pycolmap
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from omomo_core.geometry.transforms import inverse
from tests.simulator.scan_scene import ScanScene, film, intrinsics

_CELL = 0.008
"""Points nearer to each other than this are one, metres."""


@dataclass(frozen=True)
class SimulatedModel:
    """A model on disk, in a frame of its own."""

    images: Path
    sparse: Path
    T_object_model: Float64[np.ndarray, "4 4"]
    """Similarity that maps the model's points into the object's frame, metres."""


@dataclass(frozen=True)
class ModelErrors:
    """Of each picture's part in a model: they are shared by all the points that it shows."""

    shift: float = 0.001
    """Standard deviation of its pose on each axis, metres."""
    turn: float = 0.0003
    """The same for its rotation, rad."""
    depth: float = 0.002
    """Of each point, as a part of its depth."""


def drawn_model(
    scene: ScanScene,
    T_world_phone: Float64[np.ndarray, "count 4 4"],
    folder: Path,
    *,
    width: int = 640,
    seed: int = 0,
    errors: ModelErrors | None = None,
) -> SimulatedModel:
    """A model of SIFT features, each put where the drawn depth says, but for errors.

    Args:
        scene, T_world_phone: what is filmed, from where.
        folder: gets `images` and `sparse`.
        width: of the pictures, pixels.
        seed: of the errors and of the model's frame.
        errors: of its points.
    """
    errors = errors or ModelErrors()
    rng = np.random.default_rng(seed)
    T_object_model = _any_frame(rng)
    T_model_world = np.linalg.inv(T_object_model) @ inverse(scene.T_world_object)
    model, camera = _empty(width)
    seen = defaultdict[tuple[int, ...], list[tuple[int, int, np.ndarray]]](list)
    for k, (picture, depth) in enumerate(film(scene, T_world_phone, width)):
        grey = _save(picture, folder / "images", k)
        pixels = find_features(grey).pixels
        places = _places(pixels, depth, T_world_phone[k], errors, rng)
        for index, (place, exact) in enumerate(zip(*places, strict=True)):
            if np.isfinite(place).all():
                seen[tuple((exact // _CELL).astype(int))].append((k + 1, index, place))
        _add_image(model, camera, k, pixels, T_model_world @ T_world_phone[k])
    for observed in seen.values():
        if len({image for image, _, _ in observed}) < 2:
            continue
        mean = np.mean([place for _, _, place in observed], axis=0)
        track = pycolmap.Track()
        for image, index in {image: index for image, index, _ in observed}.items():
            track.add_element(image, index)
        model.add_point3D(T_model_world[:3, :3] @ mean + T_model_world[:3, 3], track)
    return _written(model, folder, T_object_model)


def triangulated_model(
    scene: ScanScene,
    T_world_phone: Float64[np.ndarray, "count 4 4"],
    folder: Path,
    *,
    width: int = 960,
    seed: int = 0,
) -> SimulatedModel:
    """A model that pycolmap triangulates from the pictures, their poses known; tens of seconds.

    Writes `images`, `sparse` and `database.db`; the model's frame is any.
    """
    T_object_model = _any_frame(np.random.default_rng(seed))
    T_model_world = np.linalg.inv(T_object_model) @ inverse(scene.T_world_object)
    for k, (picture, _) in enumerate(film(scene, T_world_phone, width)):
        _save(picture, folder / "images", k)
    model, camera = _empty(width)
    database = folder / "database.db"
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model, reader.camera_params = "PINHOLE", camera.params_to_string()
    pycolmap.extract_features(
        database,
        folder / "images",
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=reader,
        device=pycolmap.Device.cpu,
    )
    pycolmap.match_exhaustive(database, device=pycolmap.Device.cpu)
    with pycolmap.Database.open(database) as opened:
        numbers = {image.name: image.image_id for image in opened.read_all_images()}
    for k, T in enumerate(T_world_phone):
        _add_image(model, camera, k, None, T_model_world @ T, numbers[_name(k)])
    (folder / "sparse").mkdir()
    model = pycolmap.triangulate_points(model, database, folder / "images", folder / "sparse")
    return _written(model, folder, T_object_model)


def _any_frame(rng: np.random.Generator) -> Float64[np.ndarray, "4 4"]:
    T = np.eye(4)
    T[:3, :3] = rng.uniform(0.3, 3.0) * Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-2, 2, 3)
    return T


def _empty(width: int) -> tuple[pycolmap.Reconstruction, pycolmap.Camera]:
    model = pycolmap.Reconstruction()
    fx, fy, cx, cy = intrinsics(width)
    # COLMAP counts pixels from the corner of the first one.
    camera = pycolmap.Camera(
        model="PINHOLE",
        width=width,
        height=3 * width // 4,
        params=[fx, fy, cx + 0.5, cy + 0.5],
        camera_id=1,
    )
    model.add_camera_with_trivial_rig(camera)
    return model, camera


def _name(k: int) -> str:
    return f"{k:03d}.png"


def _save(picture: UInt8[np.ndarray, "h w 3"], folder: Path, k: int) -> UInt8[np.ndarray, "h w"]:
    folder.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(folder / _name(k)), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))


def _add_image(
    model: pycolmap.Reconstruction,
    camera: pycolmap.Camera,
    k: int,
    pixels: Float64[np.ndarray, "points 2"] | None,
    T_model_phone: Float64[np.ndarray, "4 4"],
    number: int | None = None,
) -> None:
    """Put a picture into the model; `T_model_phone` may scale."""
    scale = np.cbrt(np.linalg.det(T_model_phone[:3, :3]))
    R = (T_model_phone[:3, :3] / scale @ T_OPENCV_ARKIT_CAMERA[:3, :3]).T
    pose = pycolmap.Rigid3d(pycolmap.Rotation3d(R), -R @ T_model_phone[:3, 3])
    image = pycolmap.Image(
        name=_name(k), camera_id=camera.camera_id, image_id=k + 1 if number is None else number
    )
    if pixels is not None:
        image.points2D = pycolmap.Point2DList([pycolmap.Point2D(xy) for xy in pixels])
    model.add_image_with_trivial_frame(image, pose)


def _places(
    pixels: Float64[np.ndarray, "points 2"],
    depth: Float32[np.ndarray, "h w"],
    T_world_phone: Float64[np.ndarray, "4 4"],
    errors: ModelErrors,
    rng: np.random.Generator,
) -> tuple[Float64[np.ndarray, "points 3"], Float64[np.ndarray, "points 3"]]:
    """Where the features are in the world as the model has them, and where they really are."""
    fx, fy, cx, cy = intrinsics(depth.shape[1])
    u, v = (pixels - 0.5).T
    row, column = (np.rint(x).astype(int) for x in (v, u))
    z = depth[row.clip(0, len(depth) - 1), column.clip(0, depth.shape[1] - 1)].astype(float)
    z[z <= 0] = np.nan
    rays = np.stack([(u - cx) / fx, -(v - cy) / fy, -np.ones_like(u)], axis=1)
    R, eye = T_world_phone[:3, :3], T_world_phone[:3, 3]
    turned = Rotation.from_rotvec(rng.normal(0, errors.turn, 3)).as_matrix() @ R
    wrong = rays * (z * (1 + rng.normal(0, errors.depth, len(z))))[:, None]
    return wrong @ turned.T + eye + rng.normal(0, errors.shift, 3), rays * z[:, None] @ R.T + eye


def _written(
    model: pycolmap.Reconstruction, folder: Path, T_object_model: Float64[np.ndarray, "4 4"]
) -> SimulatedModel:
    sparse = folder / "sparse"
    sparse.mkdir(exist_ok=True)
    model.write(sparse)
    return SimulatedModel(folder / "images", sparse, T_object_model)
