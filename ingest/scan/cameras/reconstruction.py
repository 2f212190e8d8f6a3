"""COLMAP's reconstruction: its models merged, cameras as pinholes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.scan.cameras.features import THREADS, quiet
from ingest.scan.cameras.metric_scale import Similarity
from ingest.scan.scan_types import Frame, Progress, View
from omomo_core.geometry.transforms import inverse

_ROUNDS = (12.0, 5.0, 3.0)
"""Pixels (of a picture 960 wide) that a point may be off in each round of triangulation: a phone's
rotations err by up to half a degree at first."""
_MIN_ANGLE = 1.5
"""Degrees between the rays of a point, at least."""
FEWEST_POINTS = 25
"""That a registered picture shows."""


def names_of(model: pycolmap.Reconstruction) -> list[str]:
    """The registered pictures by name."""
    return sorted(image.name for image in model.images.values() if image.has_pose)


def poses_of(
    model: pycolmap.Reconstruction, names: Sequence[str]
) -> Float64[np.ndarray, "pictures 4 4"]:
    """T_model_camera of some pictures, OpenCV's axes."""
    by_name = {image.name: image for image in model.images.values()}
    T_camera_model = np.tile(np.eye(4), (len(names), 1, 1))
    for k, name in enumerate(names):
        T_camera_model[k, :3] = by_name[name].cam_from_world().matrix()
    return inverse(T_camera_model)


def points_of(model: pycolmap.Reconstruction) -> Float64[np.ndarray, "points 3"]:
    """Sparse points in the order of their numbers."""
    points = [model.points3D[number].xyz for number in sorted(model.points3D)]
    return np.array(points, np.float64).reshape(-1, 3)


def laid(model: pycolmap.Reconstruction, similarity: Similarity) -> None:
    """Transform a model in place."""
    model.transform(
        pycolmap.Sim3d(
            similarity.scale, pycolmap.Rotation3d(similarity.R), similarity.t.reshape(3, 1)
        )
    )


def from_poses(
    database: Path,
    images: Path,
    output: Path,
    frames: Sequence[Frame],
    T_world_camera: Float64[np.ndarray, "pictures 4 4"],
    progress: Progress,
) -> pycolmap.Reconstruction:
    """Points triangulated with known poses, then poses and points refined together, and again.

    The result's place and size are free to move a little: see `ingest.scan.cameras.metric_scale`.
    `progress` is called with "cameras".
    """
    quiet()
    wide = max(max(frame.size) for frame in frames) / 960
    poses: Mapping[str, np.ndarray] = dict(
        zip((f.name for f in frames), T_world_camera, strict=True)
    )
    model = pycolmap.Reconstruction()
    for number, off in enumerate(_ROUNDS):
        progress("cameras", number / len(_ROUNDS))
        model = triangulated(database, images, output, poses, off * wide)
        progress("cameras", (number + 0.5) / len(_ROUNDS))
        refine(model, intrinsics=False)
        cleaned(model, off * wide)
        kept = names_of(model)
        poses = dict(zip(kept, poses_of(model, kept), strict=True))
    return model


def triangulated(
    database: Path,
    images: Path,
    output: Path,
    poses: Mapping[str, np.ndarray],
    off: float,
    cameras: Mapping[int, pycolmap.Camera] | None = None,
) -> pycolmap.Reconstruction:
    """Points of pictures whose poses are known.

    Args:
        database: with features and matches.
        images: folder of the pictures.
        output: folder for COLMAP's model.
        poses: T_model_camera by picture.
        off: pixels that a point may be off.
        cameras: their lenses by number; those of the database if not given.
    """
    output.mkdir(parents=True, exist_ok=True)
    model = pycolmap.Reconstruction()
    with pycolmap.Database.open(database) as opened:
        for camera in cameras.values() if cameras is not None else opened.read_all_cameras():
            model.add_camera_with_trivial_rig(camera)
        for image in opened.read_all_images():
            if image.name not in poses:
                continue
            T = inverse(poses[image.name])
            model.add_image_with_trivial_frame(
                pycolmap.Image(name=image.name, camera_id=image.camera_id, image_id=image.image_id),
                pycolmap.Rigid3d(pycolmap.Rotation3d(T[:3, :3]), T[:3, 3]),
            )
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = THREADS
    options.extract_colors = False
    options.mapper.filter_max_reproj_error = off
    options.triangulation.merge_max_reproj_error = off
    options.triangulation.complete_max_reproj_error = off
    return pycolmap.triangulate_points(model, database, images, output, options=options)


def refine(model: pycolmap.Reconstruction, *, intrinsics: bool) -> None:
    """Poses and points, and focal lengths and lenses if wanted, by all observations, in place."""
    quiet()
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_focal_length = options.refine_extra_params = intrinsics
    options.refine_principal_point = False
    options.print_summary = False
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = 1.0
    options.ceres.solver_options.num_threads = THREADS
    options.ceres.solver_options.max_num_iterations = 40
    options.ceres.solver_options.function_tolerance = 1e-5
    config = pycolmap.BundleAdjustmentConfig()
    for number in model.reg_image_ids():
        config.add_image(number)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    # pycolmap.bundle_adjustment does the same and lets COLMAP log everything from then on.
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()


def cleaned(model: pycolmap.Reconstruction, off: float) -> None:
    """Leave out points that are off or flat, and pictures that show too few of the others."""
    manager = pycolmap.ObservationManager(model)
    manager.filter_all_points3D(off, _MIN_ANGLE)
    for image in list(model.images.values()):
        if image.has_pose and image.num_points3D < FEWEST_POINTS:
            model.deregister_frame(image.frame_id)
    model.update_point_3d_errors()


_SHARED = 3
"""Pictures that two models have in common, at least: fewer may agree by accident."""
_INLIERS, _OFF = 0.3, 8.0
"""Part of the points of the common pictures that must agree, and within how many pixels."""


@dataclass(frozen=True)
class JoinedPoses:
    """Poses of the pictures of several models in the frame of the largest."""

    T_model_camera: dict[str, Float64[np.ndarray, "4 4"]]
    """OpenCV's axes, by picture."""
    cameras: dict[int, pycolmap.Camera]
    """Their lenses; where models differ, that of the largest."""


def joined(models: Sequence[pycolmap.Reconstruction]) -> JoinedPoses | None:
    """The pictures of all models that share pictures with the largest, or with one that does.

    Args:
        models: of one database, the largest first.

    Returns:
        None where no other model adds a picture.
    """
    main, *others = models
    names = names_of(main)
    poses = dict(zip(names, poses_of(main, names), strict=True))
    cameras = {number: camera for number, camera in main.cameras.items()}
    to_main = [(main, Similarity(1.0, np.eye(3), np.zeros(3)))]
    added = True
    while added and others:
        added = False
        for other in list(others):
            similarity = _laid(other, to_main)
            if similarity is None:
                continue
            others.remove(other)
            to_main.append((other, similarity))
            names = names_of(other)
            moved = similarity.poses(poses_of(other, names))
            poses = dict(zip(names, moved, strict=True)) | poses
            cameras = dict(other.cameras.items()) | cameras
            added = True
    return JoinedPoses(poses, cameras) if len(poses) > len(names_of(main)) else None


def _laid(
    other: pycolmap.Reconstruction,
    to_main: Sequence[tuple[pycolmap.Reconstruction, Similarity]],
) -> Similarity | None:
    """How a model lies in the largest one; None where nothing says it."""
    for model, similarity in to_main:
        if len(set(names_of(model)) & set(names_of(other))) < _SHARED:
            continue
        found = pycolmap.align_reconstructions_via_reprojections(
            other, model, min_inlier_observations=_INLIERS, max_reproj_error=_OFF
        )
        if found is not None:
            R = np.asarray(found.rotation.matrix(), np.float64)
            t = np.asarray(found.translation, np.float64).ravel()
            return Similarity(
                similarity.scale * float(found.scale),
                similarity.R @ R,
                similarity.points(t[None])[0],
            )
    return None


_STRAIGHT = 0.2
"""Pixels that a lens may bend a picture by and still count as a pinhole."""
_QUALITY = 97


def views_of(
    model: pycolmap.Reconstruction,
    names: Sequence[str],
    frames: Mapping[str, Frame],
    straightened: Path,
) -> tuple[View, ...]:
    """The registered pictures as pinholes, in the model's world.

    Args:
        model: the reconstruction.
        names: of the pictures wanted.
        frames: the pictures by their name.
        straightened: folder for those whose lens bends; what is there already is not made again.
    """
    cameras = {image.name: model.cameras[image.camera_id] for image in model.images.values()}
    T = poses_of(model, names)
    return tuple(_view(frames[n], cameras[n], T[k], straightened) for k, n in enumerate(names))


def _view(
    frame: Frame, camera: pycolmap.Camera, T: Float64[np.ndarray, "4 4"], straightened: Path
) -> View:
    size = camera.width, camera.height
    fx, fy = camera.focal_length_x, camera.focal_length_y
    # COLMAP counts pixels from the corner of the first one.
    K = np.array([fx, fy, camera.principal_point_x - 0.5, camera.principal_point_y - 0.5])
    file = frame.file
    if not _is_straight(camera, K):
        file = straightened / frame.name
        if not file.is_file():
            _straighten(frame.file, camera, K, file)
    return View(frame.name, file, size, K, T, frame.depth)


def _is_straight(camera: pycolmap.Camera, K: Float64[np.ndarray, "4"]) -> bool:
    grid = _pixels(camera, 9)
    return float(np.abs(_bent(camera, K, grid) - grid).max()) < _STRAIGHT


def _pixels(camera: pycolmap.Camera, steps: int) -> Float64[np.ndarray, "pixels 2"]:
    x = np.linspace(0, camera.width - 1, steps)
    y = np.linspace(0, camera.height - 1, steps)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _bent(
    camera: pycolmap.Camera, K: Float64[np.ndarray, "4"], pixels: Float64[np.ndarray, "pixels 2"]
) -> Float64[np.ndarray, "pixels 2"]:
    """Return the pixels of the bent picture that show what a pinhole camera shows at these pixels."""
    flat = (pixels - K[2:]) / K[:2]
    rays = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
    return np.asarray(camera.img_from_cam(rays), np.float64) - 0.5


def _straighten(
    source: Path, camera: pycolmap.Camera, K: Float64[np.ndarray, "4"], target: Path
) -> None:
    picture = cv2.imread(str(source), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    assert picture is not None
    height, width = camera.height, camera.width
    x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    where = _bent(camera, K, np.stack([x, y], axis=-1).reshape(-1, 2))
    # A picture that was made smaller since: its pixels are those of the camera, scaled.
    scale = np.array([picture.shape[1] / width, picture.shape[0] / height])
    at = ((where + 0.5) * scale - 0.5).reshape(height, width, 2).astype(np.float32)
    straight = cv2.remap(picture, at[..., 0], at[..., 1], cv2.INTER_LINEAR)
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.stem}.part.jpg")
    cv2.imwrite(str(temporary), straight, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    temporary.replace(target)
