"""WitnessCamera: intrinsics and distortion of the second camera, and the files that hold them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float64

from omomo_core import strict_json
from omomo_core.errors import InputError, in_words

_ORDER = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_LENGTHS = (0, 4, 5, 8, 12, 14)
"""Lengths of the lists of coefficients that OpenCV knows."""
_MATRIX_NAMES = ("camera_matrix", "cameraMatrix", "K", "intrinsics")
_DISTORTION_NAMES = ("distortion_coefficients", "distCoeffs", "dist_coeffs", "distortion", "D")
_MAX_BYTES = 2**20
_SAME_SHAPE = 0.01


@dataclass(frozen=True)
class WitnessCamera:
    """A pinhole with OpenCV's distortion; (0, 0) is the centre of the top left pixel."""

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    """OpenCV's k1 k2 p1 p2 k3 ...; none is none."""
    size: tuple[int, int] | None = None
    """Width and height of the pictures that the numbers are for, where known."""
    sigmas: tuple[float, float, float, float] | None = None
    """One sigma of fx, fy, cx, cy, pixels, where they were calibrated from the board."""
    source: str = "given"

    @property
    def K(self) -> Float64[np.ndarray, "3 3"]:
        """The camera matrix."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def lens(self) -> Float64[np.ndarray, " coefficients"]:
        """The distortion as OpenCV takes it."""
        return np.array(self.distortion if any(self.distortion) else (0.0,) * 5, float)

    def at(self, width: int, height: int) -> "WitnessCamera":
        """The same camera for pictures of another size.

        Raises:
            InputError: "camera-size" when their shape differs: they were cropped or turned.
        """
        if self.size is None or self.size == (width, height):
            return self
        scale = width / self.size[0]
        if abs(height / self.size[1] / scale - 1) > _SAME_SHAPE:
            turned = self.size == (height, width)
            raise InputError(
                "camera-size",
                f"The camera was calibrated for {self.size[0]}x{self.size[1]} pictures, these are "
                f"{width}x{height}.",
                where=self.source,
                fix="Calibrate it with pictures turned as the video stores them."
                if turned
                else "Calibrate it in the mode in which it films the board.",
            )
        return WitnessCamera(
            self.fx * scale,
            self.fy * scale,
            # The middle of a pixel is at a whole number: edges scale, middles do not.
            (self.cx + 0.5) * scale - 0.5,
            (self.cy + 0.5) * scale - 0.5,
            self.distortion,
            (width, height),
            None if self.sigmas is None else tuple(scale * s for s in self.sigmas),  # pyright: ignore[reportArgumentType]
            self.source,
        )


def load_camera(path: Path) -> WitnessCamera:
    """Read a calibration: our JSON, or YAML as OpenCV's and ROS's calibrators write it.

    The JSON is {"fx": ..., "fy": ..., "cx": ..., "cy": ..., "k1": 0, ..., "width": ..., "height": ...};
    distortion and size may be left out.

    Raises:
        InputError: "camera-missing", "camera-unreadable" or "camera-values".
    """
    if not path.is_file():
        raise InputError(
            "camera-missing",
            "There is no camera file.",
            where=str(path),
            fix='Write one: {"fx": 1450, "fy": 1450, "cx": 960, "cy": 540, "k1": 0.1, "k2": -0.2, '
            '"p1": 0, "p2": 0, "k3": 0, "width": 1920, "height": 1080}; or leave it out to '
            "calibrate the camera from the video of the board.",
        )
    text = path.read_bytes()[:_MAX_BYTES].decode("utf-8", "replace").removeprefix("\ufeff")
    try:
        camera = _from_json(text, path) if text.lstrip().startswith("{") else _from_yaml(text, path)
    except (ValueError, KeyError, TypeError, OverflowError) as problem:
        raise InputError(
            "camera-unreadable",
            f"The camera file cannot be read: {in_words(problem)}.",
            where=str(path),
            fix="It needs fx, fy, cx, cy (JSON), or camera_matrix and distortion_coefficients as "
            "OpenCV and ROS write them (YAML).",
        ) from None
    _check(camera)
    return camera


def _from_json(text: str, path: Path) -> WitnessCamera:
    table = cast(Mapping[str, Any], strict_json.parse(text))
    given = table.get("distortion")
    named = [float(table.get(name, 0.0)) for name in _ORDER]
    if given is None:
        given = named if any(named[5:]) else named[:5]
    fx, fy, cx, cy = (float(table[name]) for name in ("fx", "fy", "cx", "cy"))
    return WitnessCamera(
        fx, fy, cx, cy, tuple(float(k) for k in given), _json_size(table), source=str(path)
    )


def _json_size(table: Mapping[str, object]) -> tuple[int, int] | None:
    width, height = table.get("width"), table.get("height")
    return (int(str(width)), int(str(height))) if width and height else None


def _from_yaml(text: str, path: Path) -> WitnessCamera:
    """Both calibrators write matrices as name: ... data: [numbers]; more YAML is not needed."""
    model = re.search(r"(?:distortion_model|camera_model)\s*:\s*[\"']?(\w+)", text)
    if model and model[1].lower() in ("equidistant", "fisheye", "kannala_brandt"):
        raise ValueError(f"the lens model {model[1]} is not supported; use plumb_bob")
    matrix = _numbers(text, _MATRIX_NAMES)
    if matrix is None or len(matrix) != 9:
        raise ValueError("there is no camera_matrix of nine numbers")
    width, height = (
        re.search(rf"image_?{side}\s*:\s*(\d+)", text, re.IGNORECASE)
        for side in ("width", "height")
    )
    size = (int(width[1]), int(height[1])) if width and height else None
    lens = tuple(_numbers(text, _DISTORTION_NAMES) or ())
    return WitnessCamera(matrix[0], matrix[4], matrix[2], matrix[5], lens, size, source=str(path))


def _numbers(text: str, names: tuple[str, ...]) -> list[float] | None:
    for name in names:
        found = re.search(rf"^\s*{name}\s*:[^\[\]]*?data\s*:\s*\[([^\]]*)\]", text, re.MULTILINE)
        if found:
            return [float(number) for number in re.split(r"[,\s]+", found[1].strip()) if number]
    return None


def _check(camera: WitnessCamera) -> None:
    numbers = [camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion]
    problem = ""
    if not np.isfinite(numbers).all():
        problem = "a number is NaN or infinity"
    elif min(camera.fx, camera.fy) <= 1:
        problem = "the focal lengths must be in pixels"
    elif len(camera.distortion) not in _LENGTHS:
        problem = f"OpenCV knows no lens with {len(camera.distortion)} coefficients"
    elif camera.size and not (
        -0.5 * camera.size[0] < camera.cx < 1.5 * camera.size[0]
        and -0.5 * camera.size[1] < camera.cy < 1.5 * camera.size[1]
    ):
        problem = "the principal point is far outside the picture"
    if problem:
        raise InputError(
            "camera-values",
            f"The camera cannot be right: {problem}.",
            where=camera.source,
            fix="Give fx, fy, cx, cy in pixels of the pictures, and k1 k2 p1 p2 k3.",
        )
