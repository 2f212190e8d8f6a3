"""Method drawing: a holder whose drawing says where the phone is on the object."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.calibration.phone_body import Phone, body_point, phone_body
from ingest.calibration.picked_points import MAX_OFFSET
from ingest.calibration.pose_file import load_pose
from ingest.mount import Mount
from ingest.session import R_CAMERA_DEVICE
from ingest.uncertainty import of_inverse, of_product
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse, nearest_rotation

_SIDES = {
    "screen": (2, 1),
    "front": (2, 1),
    "back": (2, -1),
    "camera": (2, -1),
    "lens": (2, -1),
    "top": (1, 1),
    "bottom": (1, -1),
    "port": (1, -1),
    "right": (0, 1),
    "left": (0, -1),
}
"""Word of a side of the phone: axis of its body, and which way."""
_VECTOR = r"\(([^()]*)\)"
_STATEMENT = re.compile(rf"([a-z][a-z ]*?)(?:(?:\s+|(?=[+-]))([+-]?)([xyz])\b|\s*{_VECTOR})")
_SQUARE = np.radians(2.0)
"""What is stated as perpendicular may be off by so much: numbers are rounded."""
_UNIT = 0.02
_EXAMPLE = '"screen faces +x, top edge points +z"'
Rotation3 = Float64[np.ndarray, "3 3"]


def rotation_in_words(text: str) -> Rotation3:
    """R_object_body of statements such as "screen faces +x, top edge points +z".

    Each says where a side of the phone points in the object's frame: an axis, or a vector in
    brackets, "back faces (0, 0.5, -0.87)". Sides are screen (front), back (camera), top, bottom
    (port), left and right as you look at the screen. Two sides are enough; a third is checked.

    Raises:
        InputError: "drawing-words" (not understood), "drawing-axes" (too few sides, one side twice,
            the same direction twice, not perpendicular) or "drawing-mirrored" (left-handed).
    """
    axes_given: dict[int, np.ndarray] = {}
    texts: dict[int, str] = {}
    for words, sign, axis, vector in _statements(text):
        which, way = _side(words)
        if which in axes_given:
            raise _contradiction(f"Both '{texts[which]}' and '{words}' say where one axis points.")
        axes_given[which], texts[which] = way * _direction(sign, axis, vector), words
    if len(axes_given) < 2:
        raise _contradiction("One side alone leaves the phone free to turn about it.")
    _check_square(axes_given, texts)
    return _complete(axes_given)


def _statements(text: str) -> list[tuple[str, str, str, str]]:
    found = [match.groups("") for match in _STATEMENT.finditer(text.lower())]
    rest = re.sub(r"[\s,;.]|and", "", _STATEMENT.sub("", text.lower()))
    if rest or not found:
        raise InputError(
            "drawing-words",
            f"'{rest or text}' is not understood.",
            field="axes",
            fix=f"Say where two sides of the phone point, as in {_EXAMPLE}.",
        )
    return [(words.strip(), sign, axis, vector) for words, sign, axis, vector in found]


def _side(words: str) -> tuple[int, int]:
    sides = {_SIDES[word] for word in words.split() if word in _SIDES}
    if len(sides) != 1:
        raise InputError(
            "drawing-words",
            f"'{words}' does not name one side of the phone.",
            field="axes",
            fix=f"Sides are {', '.join(_SIDES)}; write as in {_EXAMPLE}.",
        )
    return sides.pop()


def _direction(sign: str, axis: str, vector: str) -> Float64[np.ndarray, "3"]:
    if axis:
        return np.eye(3)["xyz".index(axis)] * (-1 if sign == "-" else 1)
    direction = numbers(vector, 3, "‹axes›")
    length = float(np.linalg.norm(direction))
    if length < 1e-6:
        raise _contradiction("A direction of length 0 points nowhere.")
    return direction / length


def _check_square(axes_given: dict[int, np.ndarray], texts: dict[int, str]) -> None:
    axes = sorted(axes_given)
    for k, i in enumerate(axes):
        for j in axes[k + 1 :]:
            angle = float(np.degrees(np.arccos(np.clip(axes_given[i] @ axes_given[j], -1, 1))))
            if abs(np.radians(angle - 90)) > _SQUARE:
                raise _contradiction(
                    f"'{texts[i]}' and '{texts[j]}' are at right angles on a phone, but the "
                    f"directions given are {min(angle, 180 - angle):.0f} deg from being parallel."
                )


def _complete(axes_given: dict[int, np.ndarray]) -> Rotation3:
    """The rotation nearest to the axes told, the missing one by the right-hand rule."""
    columns = [axes_given.get(i, np.zeros(3)) for i in range(3)]
    for i in range(3):
        if i not in axes_given:
            columns[i] = np.cross(columns[(i + 1) % 3], columns[(i + 2) % 3])
    matrix = np.stack(columns, axis=1)
    if np.linalg.det(matrix) < 0:
        raise InputError(
            "drawing-mirrored",
            "The three directions are those of a mirrored phone (a left-handed frame).",
            field="axes",
            fix="Turn one of them round: as you look at the screen with the top up, right is to "
            "your right.",
        )
    return nearest_rotation(matrix)


def _contradiction(what: str) -> InputError:
    return InputError(
        "drawing-axes",
        what,
        field="axes",
        fix=f"Say where two sides at right angles point, as in {_EXAMPLE}.",
    )


def rotation_of_euler(text: str) -> Rotation3:
    """The rotation of "xyz 0 90 0": the order of the axes, then as many angles in degrees.

    Small letters turn about the fixed axes, capitals about the axes as already turned, as in scipy.

    Raises:
        InputError: "drawing-euler".
    """
    order, _, rest = text.strip().partition(" ")
    right = re.fullmatch(r"[xyz]{1,3}|[XYZ]{1,3}", order)
    if right is None or any(a == b for a, b in pairwise(order)):
        raise InputError(
            "drawing-euler",
            f"'{order}' is no order of axes.",
            field="euler",
            fix='Write the order, then degrees: "xyz 0 90 0" about fixed axes, "XYZ 0 90 0" about '
            "axes as turned.",
        )
    angles = numbers(rest, len(order), "‹euler›")
    return Rotation.from_euler(order, angles.tolist(), degrees=True).as_matrix()


def rotation_of_quaternion(text: str) -> Rotation3:
    """The rotation of four numbers, x y z w.

    Raises:
        InputError: "drawing-quaternion" when its length is not 1.
    """
    q = numbers(text, 4, "‹quaternion›")
    length = float(np.linalg.norm(q))
    if abs(length - 1) > _UNIT:
        raise InputError(
            "drawing-quaternion",
            f"The quaternion has length {length:.4g} instead of 1.",
            field="quaternion",
            fix="Write x y z w, all four, as unit quaternion; w comes last.",
        )
    return Rotation.from_quat(q).as_matrix()


def numbers(text: str, count: int, where: str) -> Float64[np.ndarray, " count"]:
    """So many finite numbers with blanks or commas between them.

    Raises:
        InputError: "drawing-numbers".
    """
    try:
        values: Sequence[float] = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(
            "drawing-numbers",
            f"'{text.strip()}' is not {count} numbers.",
            where=where,
            fix="Write them with blanks or commas between.",
        )
    return np.array(values)


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
        point: of the phone, as in `ingest.calibration.phone_body.body_point`.
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


@dataclass(frozen=True)
class Drawn:
    """What was given, as it was written; a matrix alone, or a place with one rotation."""

    xyz: str | None = None
    axes: str | None = None
    """Words, which are about the phone's body."""
    euler: str | None = None
    quaternion: str | None = None
    matrix: Path | None = None

    def of_body(self) -> Float64[np.ndarray, "4 4"]:
        """T_object_body, or of whatever the numbers are for.

        Raises:
            InputError: "drawing-incomplete", "drawing-twice", or of what is read.
        """
        self._check()
        if self.matrix:
            return load_pose(self.matrix)
        T = np.eye(4)
        T[:3, 3] = numbers(self.xyz or "", 3, "‹xyz›")
        if self.axes is not None:
            T[:3, :3] = rotation_in_words(self.axes)
        elif self.euler is not None:
            T[:3, :3] = rotation_of_euler(self.euler)
        else:
            T[:3, :3] = rotation_of_quaternion(self.quaternion or "")
        return T

    def of_camera(self) -> Float64[np.ndarray, "4 4"]:
        """T_object_phone, in the camera's ARKit axes; words still are about the body.

        Raises:
            InputError: as `of_body`.
        """
        T = self.of_body()
        if self.axes is not None:
            T[:3, :3] = camera_of_body(T[:3, :3])
        return T

    def _check(self) -> None:
        turns = [self.axes, self.euler, self.quaternion]
        count = sum(turn is not None for turn in turns)
        if self.matrix is not None and (count or self.xyz is not None):
            raise InputError(
                "drawing-twice",
                "The matrix gives the whole pose, and there is another beside it.",
                field="matrix",
                fix="Give ‹matrix› alone, or ‹xyz› with one rotation.",
            )
        if count > 1:
            raise InputError(
                "drawing-twice",
                "The rotation is given more than once.",
                fix="Give one of ‹axes›, ‹euler› and ‹quaternion›.",
            )
        if self.matrix is None and (count == 0 or self.xyz is None):
            missing = "place (‹xyz›)" if self.xyz is None else "rotation (‹axes›, ‹euler›, ...)"
            raise InputError(
                "drawing-incomplete",
                f"The {missing} is missing.",
                fix='Write ‹xyz› "0 0.12 0.31" ‹axes› "screen faces +y, top edge points +z", or '
                "give a ‹matrix› file.",
            )
