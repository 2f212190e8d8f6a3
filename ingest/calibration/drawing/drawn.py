"""A pose as a drawing states it: a place and one of several ways to say how it is turned."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.calibration.drawing.directions import (
    numbers,
    rotation_in_words,
    rotation_of_euler,
    rotation_of_quaternion,
)
from ingest.calibration.drawing.drawing import camera_of_body
from ingest.calibration.pose_file import load_pose
from omomo_core.errors import InputError


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
        T[:3, 3] = numbers(self.xyz or "", 3, "--xyz")
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
                where="--matrix",
                fix="Give --matrix alone, or --xyz with one rotation.",
            )
        if count > 1:
            raise InputError(
                "drawing-twice",
                "The rotation is given more than once.",
                fix="Give one of --axes, --euler and --quaternion.",
            )
        if self.matrix is None and (count == 0 or self.xyz is None):
            missing = "place (--xyz)" if self.xyz is None else "rotation (--axes, --euler, ...)"
            raise InputError(
                "drawing-incomplete",
                f"The {missing} is missing.",
                fix='Write --xyz "0 0.12 0.31" --axes "screen faces +y, top edge points +z", or '
                "give a --matrix file.",
            )
