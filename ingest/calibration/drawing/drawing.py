"""The mount from a drawing: the phone's pose in the object's frame, given in numbers."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.calibration.phone.body import Phone, body_point, phone_body
from ingest.calibration.points.picked import MAX_OFFSET
from ingest.mount import Mount
from ingest.session import R_CAMERA_DEVICE
from ingest.uncertainty import of_inverse, of_product
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse


@dataclass(frozen=True)
class Precision:
    """How well a place and a direction are given, one sigma along and about each axis."""

    metres: float
    radians: float

    @property
    def covariance(self) -> Float64[np.ndarray, "6 6"]:
        """Covariance of rotation and translation."""
        return np.diag([self.radians**2] * 3 + [self.metres**2] * 3)


PRINTED = Precision(0.001, np.radians(1.0))
"""A holder printed or milled after the drawing."""
MEASURED = Precision(0.003, np.radians(3.0))
"""Taken with a ruler."""


def camera_mount(
    T_object_phone: Float64[np.ndarray, "4 4"], precision: Precision = PRINTED
) -> Mount:
    """The mount of a drawing that gives the pose of the phone's camera.

    Args:
        T_object_phone: maps the camera's ARKit axes into the object's frame, metres.
        precision: of that pose.

    Raises:
        InputError: "drawing-units".
    """
    _check_units(T_object_phone)
    T = inverse(T_object_phone)
    return Mount(T, "drawing", covariance=of_inverse(T_object_phone, precision.covariance))


def body_mount(
    phone: Phone,
    R_object_body: Float64[np.ndarray, "3 3"],
    at: Float64[np.ndarray, "3"],
    point: str = "centre front",
    precision: Precision = PRINTED,
) -> Mount:
    """The mount of a drawing that gives the pose of the phone's body.

    Args:
        phone: its model, which says where the camera is in the body.
        R_object_body: turns the body's axes (x right, y to the top edge, z out of the screen) into
            the object's.
        at: where `point` is in the object's frame, metres.
        point: of the phone, as in `ingest.calibration.phone.body.body_point`.
        precision: of the body's pose; what is known of the camera in the body comes on top.

    Raises:
        InputError: "drawing-units" or "phone-point".
    """
    T_object_point, T_body_point = np.eye(4), np.eye(4)
    T_object_point[:3, :3], T_object_point[:3, 3] = R_object_body, at
    _check_units(T_object_point)
    T_body_point[:3, 3] = body_point(phone, point)
    T_phone_body, of_body = phone_body(phone)
    of_point = of_product(T_phone_body, of_body, T_body_point, np.zeros((6, 6)))
    T_phone_point, T_point_object = T_phone_body @ T_body_point, inverse(T_object_point)
    of_object = of_inverse(T_object_point, precision.covariance)
    covariance = of_product(T_phone_point, of_point, T_point_object, of_object)
    return Mount(T_phone_point @ T_point_object, "drawing", covariance=covariance, phone=phone.name)


def body_of_camera(R_object_phone: Float64[np.ndarray, "3 3"]) -> Float64[np.ndarray, "3 3"]:
    """R_object_body of a rotation that is given for the camera's ARKit axes."""
    return R_object_phone @ R_CAMERA_DEVICE


def camera_of_body(R_object_body: Float64[np.ndarray, "3 3"]) -> Float64[np.ndarray, "3 3"]:
    """R_object_phone of a rotation that is given for the body's axes."""
    return R_object_body @ R_CAMERA_DEVICE.T


def _check_units(T: Float64[np.ndarray, "4 4"]) -> None:
    distance = float(np.linalg.norm(T[:3, 3]))
    if not distance < MAX_OFFSET:
        raise InputError(
            "drawing-units",
            f"The drawing puts the phone {distance:.4g} m from the object's origin.",
            fix="Give metres; drawings are often in millimetres.",
        )
