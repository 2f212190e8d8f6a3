"""Smooth corrections: cubic B-splines in time, and least squares over their coefficients."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.linalg import solveh_banded
from torch import Tensor

from omomo_core.blas import one_blas_thread
from omomo_core.body.trajectory_optimization.config import SOLVER

_ORDER = 4
"""Coefficients that touch one frame."""


@dataclass(frozen=True)
class Spline:
    """A uniform cubic B-spline with a coefficient every `spacing` frames."""

    frames: int
    spacing: float

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return max(1, int(np.ceil((self.frames - 1) / self.spacing))) + _ORDER - 1

    def basis(self, frames: Float[np.ndarray, " times"]) -> Float[Tensor, "times coefficients"]:
        """Return the weight of every coefficient at some frames."""
        return self._weights(frames, 0)

    def bending(self) -> Float[Tensor, "coefficients coefficients"]:
        """Return the quadratic form of the mean squared second derivative in time, per frame^4."""
        B = self._weights(np.arange(self.frames, dtype=float), 2)
        return B.T @ B / self.frames

    def _weights(
        self, frames: Float[np.ndarray, " times"], derivative: int
    ) -> Float[Tensor, "times coefficients"]:
        at = frames / self.spacing
        first = np.minimum(np.floor(at).astype(int), self.count - _ORDER)
        u = (at - first)[:, None]
        if derivative == 0:
            w = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
            scale = 1 / 6
        else:
            w = [1 - u, 3 * u - 2, 1 - 3 * u, u]
            scale = 1 / self.spacing**2
        out = np.zeros((len(frames), self.count))
        rows = np.arange(len(frames))[:, None]
        out[rows, first[:, None] + np.arange(_ORDER)] = np.concatenate(w, axis=1) * scale
        return torch.as_tensor(out, dtype=torch.float32)


def gauss_newton_step(
    basis: Float[Tensor, "times coefficients"],
    hessian: Float[Tensor, "times n n"],
    gradient: Float[Tensor, "times n"],
    bending: Float[Tensor, "coefficients coefficients"],
    stiffness: Float[Tensor, "n n"],
    now: Float[Tensor, "coefficients n"],
) -> Float[Tensor, "coefficients n"]:
    """Return one Gauss-Newton step of the coefficients.

    Args:
        basis: weights of the coefficients at the frames that were looked at.
        hessian: of the cost of each frame in the value of the spline there.
        gradient: likewise.
        bending: quadratic form of the spline's second derivative.
        stiffness: its weight, a quadratic form of the n values.
        now: the present coefficients.
    """
    count, n = now.shape
    bands = _pairs(basis).mT.reshape(-1, len(basis)) @ hessian.flatten(1)
    bands = bands.view(_ORDER, count, n, n)
    stiff = torch.stack([_filled(bending.diagonal(k), count) for k in range(_ORDER)])
    bands.add_(stiff[..., None, None] * stiffness)
    slope = basis.T @ gradient + (bending @ now) @ stiffness
    with one_blas_thread():
        step = solveh_banded(
            _lower(bands), -slope.flatten().double().numpy(), lower=True, check_finite=False,
            overwrite_ab=True, overwrite_b=True,
        )  # fmt: skip
    return torch.as_tensor(step, dtype=now.dtype).reshape(count, n)


def _pairs(basis: Float[Tensor, "times coefficients"]) -> Float[Tensor, "order times coefficients"]:
    """Return the weight of each coefficient times that of the coefficient k after it, for each k."""
    count = basis.shape[1]
    return torch.stack([basis * _filled(basis[:, k:], count) for k in range(_ORDER)])


def _filled(x: Float[Tensor, "*b some"], count: int) -> Float[Tensor, "*b count"]:
    """Return `x` with zeros appended up to `count` entries."""
    return torch.nn.functional.pad(x, (0, count - x.shape[-1]))


def _lower(bands: Float[Tensor, "order count n n"]) -> Float[np.ndarray, "rows unknowns"]:
    """Return a symmetric block-banded matrix in LAPACK's lower band storage, with the ridge.

    Column (i, a) holds the entries (i + k, b) below it, which are entry (a, b) of band k.
    """
    order, count, n, _ = bands.shape
    column = bands.permute(1, 2, 0, 3).reshape(count, n, order * n).numpy()
    # Columns lie one after the other, as LAPACK wants them: nothing is copied again.
    out = np.empty((count, n, order * n))
    for a in range(n):
        out[:, a, : order * n - a] = column[:, a, a:]
        out[:, a, order * n - a :] = 0.0
    out[:, :, 0] += SOLVER.ridge
    return out.reshape(count * n, order * n).T
