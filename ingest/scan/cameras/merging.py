"""joined: pictures that COLMAP placed in models of their own, brought into the largest model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.scan.cameras.metric import Similarity
from ingest.scan.cameras.reconstruction import names_of, poses_of

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
