"""A COLMAP reconstruction as arrays, and from known poses; how it is refined."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.scan.cameras.metric import Similarity
from ingest.scan.cameras.quiet import THREADS, quiet
from ingest.scan.types import Frame, Progress
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

    The result's place and size are free to move a little: see `ingest.scan.cameras.metric`.
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
