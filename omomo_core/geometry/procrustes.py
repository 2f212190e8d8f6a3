"""Closed-form fits: the nearest rotation of a matrix, and the similarity between two point sets."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64


def nearest_rotation(
    M: Float64[np.ndarray, "*batch 3 3"],
) -> Float64[np.ndarray, "*batch 3 3"]:
    """The rotation R that is nearest to M in the Frobenius norm; never a mirror image.

    With M = sum of a_i b_i^T this is the R of least squares with a = R b (Kabsch).
    """
    U, _, Vt = np.linalg.svd(M)
    U[..., 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[..., None]
    return U @ Vt


class SimilarityTransform(NamedTuple):
    """a = scale R b + t, and how well it fits."""

    R: Float64[np.ndarray, "3 3"]
    """A rotation, or a mirrored one where that was allowed."""
    t: Float64[np.ndarray, "3"]
    scale: float
    residuals: Float64[np.ndarray, "n 3"]
    """What is left of each point, a - (scale R b + t), metres."""
    misfit: float
    """Weighted sum of their squares."""


def procrustes(
    points_a: Float64[np.ndarray, "n 3"],
    points_b: Float64[np.ndarray, "n 3"],
    weights: Float64[np.ndarray, " n"],
    *,
    scaled: bool = False,
    mirrored: bool = False,
) -> SimilarityTransform:
    """Weighted least squares over rotations, shifts and, where asked, scales (Umeyama 1991).

    Args:
        points_a, points_b: the same points in frames a and b; at least two of b's differ.
        weights: of each pair; 1 / sigma^2 makes the misfit a chi-square.
        scaled: solve for the scale too, else it is 1.
        mirrored: take the best mirror image instead of the best rotation.
    """
    share = weights / weights.sum()
    middle_a, middle_b = share @ points_a, share @ points_b
    a, b = points_a - middle_a, points_b - middle_b
    U, stretch, Vt = np.linalg.svd((a * share[:, None]).T @ b)
    hand = np.linalg.det(U) * np.linalg.det(Vt) * (-1 if mirrored else 1)
    signs = np.array([1.0, 1.0, np.sign(hand)])
    R = (U * signs) @ Vt
    scale = float((stretch * signs).sum() / (share @ (b**2).sum(axis=1))) if scaled else 1.0
    t = middle_a - scale * R @ middle_b
    residuals = points_a - (scale * points_b @ R.T + t)
    return SimilarityTransform(R, t, scale, residuals, float(weights @ (residuals**2).sum(axis=1)))
