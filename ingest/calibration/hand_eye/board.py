"""The mount from a witness camera that watched a board on the object while the phone logged."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.camera import WitnessCamera
from ingest.calibration.board.place import BoardPlace
from ingest.calibration.board.track import BoardTrack, with_camera
from ingest.calibration.hand_eye.samples import PHONE_SD
from ingest.calibration.hand_eye.solve import solve
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.calibration.hand_eye.to_mount import calibrate_by_motion
from ingest.mount import Mount
from ingest.uncertainty import between, of_inverse, of_product
from omomo_core.geometry.transforms import inverse


def calibrate_by_board(phone: PoseStream, track: BoardTrack, place: BoardPlace) -> Mount:
    """The mount; errors of the camera's intrinsics, which all poses share, are in its covariance.

    Args:
        phone: T_world_phone of the clamped phone.
        track: of the board on the object.
        place: where the board is on the object.

    Raises:
        InputError: those of `calibrate_by_motion`.
    """
    T_board_object = inverse(place.T_object_board)
    mount = calibrate_by_motion(
        phone,
        stream_of(track),
        T_board_object,
        of_inverse(place.T_object_board, place.covariance),
        "board",
    )
    assert mount.covariance is not None
    shared = _of_intrinsics(phone, track, T_board_object)
    residuals = mount.residuals | {
        "corners_px": round(float(np.sqrt((track.rms**2).mean())), 3),
        "board place_mm": round(1e3 * place.rms, 3),
    }
    return replace(mount, covariance=mount.covariance + shared, residuals=residuals)


def stream_of(track: BoardTrack) -> PoseStream:
    """The board's poses in what rests: the camera, or the world of a phone that filmed it."""
    if track.T_world_camera is None:
        return PoseStream(track.times, track.T_camera_board, track.covariance)
    own = np.diag(PHONE_SD**2)
    pairs = zip(track.T_world_camera, track.T_camera_board, track.covariance, strict=True)
    covariance = np.stack([of_product(W, own, T, C) for W, T, C in pairs])
    return PoseStream(track.times, track.T_world_camera @ track.T_camera_board, covariance)


def _of_intrinsics(
    phone: PoseStream, track: BoardTrack, T_board_object: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "6 6"]:
    """Covariance of the mount from the uncertainty of focal length and principal point."""
    total = np.zeros((6, 6))
    if track.camera.sigmas is None:
        return total
    found = solve(phone, stream_of(track)).T_phone_target @ T_board_object
    for camera in _one_sigma_off(track.camera):
        other = solve(phone, stream_of(with_camera(track, camera)))
        step = between(found, other.T_phone_target @ T_board_object)
        total += np.outer(step, step)
    return total


def _one_sigma_off(camera: WitnessCamera) -> list[WitnessCamera]:
    """The focal lengths together, for they err together, and each number of the principal point."""
    assert camera.sigmas is not None
    fx, _, cx, cy = camera.sigmas
    zoom = 1 + fx / camera.fx
    return [
        replace(camera, fx=camera.fx * zoom, fy=camera.fy * zoom),
        replace(camera, cx=camera.cx + cx),
        replace(camera, cy=camera.cy + cy),
    ]
