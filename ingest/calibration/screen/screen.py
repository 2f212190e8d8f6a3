"""The mount from a board shown on the phone's own screen, seen by a camera together with the object."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.stats import norm, t

from ingest.calibration.board.board_spec import Board
from ingest.calibration.phone_body import Phone
from ingest.calibration.posterior import Average, average
from ingest.calibration.screen.shown import ScreenPose, screen_of_board
from ingest.mount import Mount
from ingest.uncertainty import of_inverse, of_product
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_KNOWN = 0.05
"""One sigma of the board's size, as a share of it, beyond which it counts as not seen."""
_SIZE_TOLERANCE = 0.02
"""By so much the board may differ: the pixels per inch are rounded, intrinsics a little wrong."""
_TURNED = 0.1
_NOTE = "Holds if the picture's TOP was at the phone's front camera, or turned as stated."
_UNCHECKED = (
    "The size of the picture on the screen was not checked: the camera did not go round it."
)


@dataclass(frozen=True)
class ScreenViews:
    """Pictures in which a camera saw the screen, and a reference fixed on the object."""

    T_camera_board: Float64[np.ndarray, "pictures 4 4"]
    """Of the board on the screen; OpenCV's camera axes."""
    board_covariance: Float64[np.ndarray, "pictures 6 6"]
    T_camera_reference: Float64[np.ndarray, "pictures 4 4"]
    """Of something fixed on the object."""
    reference_covariance: Float64[np.ndarray, "pictures 6 6"]
    T_reference_object: Float64[np.ndarray, "4 4"]
    of_object: Float64[np.ndarray, "6 6"]
    """Covariance of the last, which is shared by all the pictures."""


def mount_from_screen(
    views: ScreenViews,
    board: Board,
    screen: ScreenPose,
    *,
    turned: int = 0,
    scaled: bool = False,
    phone: Phone | None = None,
) -> Mount:
    """Average T_screen_object over the pictures, and put the phone's camera before it.

    Errors of the pictures average out; those of where the screen is in the phone, and of where the
    reference is on the object, do not.

    Args:
        views: one picture or more; several from different sides also show the size of the board.
        board: as it is on the screen (`shown_board`).
        screen: where the screen is in the phone.
        turned: by how many degrees clockwise the picture stood on the screen.
        scaled: the object's frame has no known scale: take it from the board.
        phone: for the message when the size is that of a turned picture, and for the record.

    Raises:
        InputError: "screen-turned", "screen-few", "screen-size" or "screen-scale".
    """
    placed = screen_object(views, board, turned=turned, scaled=scaled, phone=phone)
    T = screen.T_phone_screen @ placed.T
    covariance = of_product(screen.T_phone_screen, screen.covariance, placed.T, placed.covariance)
    residuals = {"used_pictures": float(placed.used), "given_pictures": float(placed.given)}
    if placed.size is not None:
        residuals["size_percent"] = 100 * placed.size.ratio
    return Mount(
        T,
        "screen",
        covariance=covariance,
        residuals=residuals,
        note=_NOTE if placed.size else f"{_NOTE} {_UNCHECKED}",
        phone=phone.name if phone else "",
        object_scale=placed.scale,
    )


class ScreenRegistration(NamedTuple):
    """Pose of the object in the frame of the phone's screen, solved from pictures of both."""

    T: Float64[np.ndarray, "4 4"]
    """T_screen_object."""
    covariance: Float64[np.ndarray, "6 6"]
    scale: float
    """Metres per unit of the object's frame."""
    used: int
    given: int
    size: "Size | None"


def screen_object(
    views: ScreenViews,
    board: Board,
    *,
    turned: int = 0,
    scaled: bool = False,
    phone: Phone | None = None,
) -> ScreenRegistration:
    """Where the object is in the frame of the screen; arguments and errors of `mount_from_screen`."""
    T_screen_board = screen_of_board(board, turned)
    if len(views.T_camera_board) == 0:
        raise InputError(
            "screen-few",
            "No picture shows the screen together with the object.",
            fix="Turn the brightness up, avoid reflections, and film screen and object together.",
        )
    size, scale = board_size(views), 1.0
    if scaled:
        views, scale = _rescaled(views, size)
    else:
        _check_size(size, phone)
    found = _screen_reference(views, T_screen_board)
    T = found.T @ views.T_reference_object
    covariance = of_product(found.T, found.covariance, views.T_reference_object, views.of_object)
    return ScreenRegistration(T, covariance, scale, int(found.kept.sum()), len(found.kept), size)


def learned_screen(placed: ScreenRegistration, mount: Mount) -> ScreenPose:
    """Where the screen of this phone is, from a mount found in another way at the same clamping.

    Raises:
        InputError: "mount-covariance" when the mount does not say how sure it is.
    """
    if mount.covariance is None:
        raise InputError(
            "mount-covariance",
            f"The mount ({mount.method}) does not say how sure it is.",
            where="--learn",
            fix="Learn from a mount of `omocap calibrate board`.",
        )
    T_object_screen = inverse(placed.T)
    of_object = of_inverse(placed.T, placed.covariance)
    T = mount.T_phone_object @ T_object_screen
    of = of_product(mount.T_phone_object, mount.covariance, T_object_screen, of_object)
    return ScreenPose(T, of)


class Size(NamedTuple):
    """How large the board on the screen is, by the object's scale, as a share of what it should be."""

    ratio: float
    sigma: float


def board_size(views: ScreenViews) -> Size | None:
    """The size of the board on the screen as the object's scale shows it.

    A board of another size is as many times nearer or farther in each picture, and so moves about
    on the object as the camera goes round it. None where the camera did not go round.
    """
    T_reference_camera = inverse(views.T_camera_reference)
    rays = np.einsum("pij,pj->pi", T_reference_camera[:, :3, :3], views.T_camera_board[:, :3, 3])
    spread = rays - rays.mean(axis=0)
    places = T_reference_camera[:, :3, 3] - T_reference_camera[:, :3, 3].mean(axis=0)
    weight = float((spread**2).sum())
    freedom = 3 * len(rays) - 4
    if freedom < 1 or weight == 0:
        return None
    ratio = -float((spread * places).sum()) / weight
    off = ratio * spread + places
    few = float(t.ppf(0.975, freedom) / norm.ppf(0.975))
    sigma = few * float(np.sqrt((off**2).sum() / freedom / weight))
    return Size(ratio, sigma) if sigma < _KNOWN else None


def _check_size(size: Size | None, phone: Phone | None) -> None:
    if size is None or abs(size.ratio - 1) < _SIZE_TOLERANCE + 3 * size.sigma:
        return
    across, down = phone.pixels if phone and phone.pixels else (0, 1)
    turned = abs(size.ratio * down / max(across, 1) - 1) < _TURNED
    raise InputError(
        "screen-size",
        f"The board on the screen is {size.ratio:.3f} times as large as it should be.",
        fix="The phone turned the picture and shrank it: lock its rotation and hold it upright, or "
        "pass --turned 90 or --turned 270."
        if turned
        else "Show the picture made for this model full screen, not zoomed, pass the right --phone, "
        "and the true size of the board on the object; if a model has no scale, pass --scale.",
    )


def _rescaled(views: ScreenViews, size: Size | None) -> tuple[ScreenViews, float]:
    """The views in metres, and metres per unit of the object's frame."""
    if size is None:
        raise InputError(
            "screen-scale",
            "The pictures do not show the scale of the object's frame.",
            fix="Take pictures of the screen from several sides.",
        )
    scale = 1 / size.ratio
    T, T_ro = views.T_camera_reference.copy(), views.T_reference_object.copy()
    T[:, :3, 3] *= scale
    T_ro[:3, 3] *= scale
    return replace(views, T_camera_reference=T, T_reference_object=T_ro), scale


def _screen_reference(views: ScreenViews, T_screen_board: Float64[np.ndarray, "4 4"]) -> Average:
    """T_screen_reference, each picture by itself, then averaged."""
    exact = np.zeros((6, 6))
    poses: list[np.ndarray] = []
    covariances: list[np.ndarray] = []
    for T_cb, of_cb, T_cr, of_cr in zip(
        views.T_camera_board,
        views.board_covariance,
        views.T_camera_reference,
        views.reference_covariance,
        strict=True,
    ):
        T_bc, of_bc = inverse(T_cb), of_inverse(T_cb, of_cb)
        of_sc = of_product(T_screen_board, exact, T_bc, of_bc)
        T_sc = T_screen_board @ T_bc
        poses.append(T_sc @ T_cr)
        covariances.append(of_product(T_sc, of_sc, T_cr, of_cr))
    return average(np.array(poses), np.array(covariances))
