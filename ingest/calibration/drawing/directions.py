"""The phone's rotation from named directions or from numbers, with checks for contradictions."""

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError
from omomo_core.geometry.transforms import nearest_rotation

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
            where="--axes",
            fix=f"Say where two sides of the phone point, as in {_EXAMPLE}.",
        )
    return [(words.strip(), sign, axis, vector) for words, sign, axis, vector in found]


def _side(words: str) -> tuple[int, int]:
    sides = {_SIDES[word] for word in words.split() if word in _SIDES}
    if len(sides) != 1:
        raise InputError(
            "drawing-words",
            f"'{words}' does not name one side of the phone.",
            where="--axes",
            fix=f"Sides are {', '.join(_SIDES)}; write as in {_EXAMPLE}.",
        )
    return sides.pop()


def _direction(sign: str, axis: str, vector: str) -> Float64[np.ndarray, "3"]:
    if axis:
        return np.eye(3)["xyz".index(axis)] * (-1 if sign == "-" else 1)
    direction = numbers(vector, 3, "--axes")
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
            where="--axes",
            fix="Turn one of them round: as you look at the screen with the top up, right is to "
            "your right.",
        )
    return nearest_rotation(matrix)


def _contradiction(what: str) -> InputError:
    return InputError(
        "drawing-axes",
        what,
        where="--axes",
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
            where="--euler",
            fix='Write the order, then degrees: "xyz 0 90 0" about fixed axes, "XYZ 0 90 0" about '
            "axes as turned.",
        )
    angles = numbers(rest, len(order), "--euler")
    return Rotation.from_euler(order, angles.tolist(), degrees=True).as_matrix()


def rotation_of_quaternion(text: str) -> Rotation3:
    """The rotation of four numbers, x y z w.

    Raises:
        InputError: "drawing-quaternion" when its length is not 1.
    """
    q = numbers(text, 4, "--quaternion")
    length = float(np.linalg.norm(q))
    if abs(length - 1) > _UNIT:
        raise InputError(
            "drawing-quaternion",
            f"The quaternion has length {length:.4g} instead of 1.",
            where="--quaternion",
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
