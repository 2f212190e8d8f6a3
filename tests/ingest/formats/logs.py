"""Sessions of every format: where their poses lie, how to damage them, how the error names it."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
from hypothesis import strategies as st

from ingest.formats import (
    anysense,
    arkit_data_logger,
    arkit_recorder,
    arkitscenes,
    ios_logger,
    iphumi,
    nerfcapture,
    nerfstudio,
    polycam,
    pose_table,
    record3d,
    scan_capture,
    scanner_3d,
    scannetpp,
    spectacular,
    stray_scanner,
    tum,
)
from ingest.formats.registry import FORMATS, Format, read_session
from ingest.formats.still_images import load_millimetres, save_millimetres
from ingest.session import CaptureSession, DepthLog
from omomo_core.errors import InputError
from tests.log_writers import write_session

MakeTake = Callable[[int], CaptureSession]

TEXT = (
    stray_scanner,
    ios_logger,
    arkit_data_logger,
    scan_capture,
    anysense,
    pose_table,
    tum,
    arkitscenes,
)
"""A line for each pose."""
PICTURES = (record3d, polycam, scanner_3d, nerfcapture, nerfstudio)
"""Single images beside the log."""
OBJECTS = (*PICTURES, arkit_recorder, iphumi, scannetpp)
"""A JSON object, or one for each pose."""
JSON = (*OBJECTS, spectacular)

ROW = 20
"""The pose that the tests damage, of the 37 of a take."""

seeds = st.integers(0, 2**32 - 1)


class Layout(NamedTuple):
    """Where the poses of a format lie."""

    files: str
    """The pose file, or all of them where each pose has its own."""
    place: str
    """What an error adds to the file to name pose ROW."""


LAYOUT = {
    stray_scanner.NAME: Layout("odometry.csv", f":{ROW + 2}"),
    ios_logger.NAME: Layout("ARposes.txt", f":{ROW + 1}"),
    arkit_data_logger.NAME: Layout("ARKit_camera_pose.txt", f":{ROW + 2}"),
    scan_capture.NAME: Layout("poses.txt", f":{ROW + 2}"),
    anysense.NAME: Layout("AR_Pose_omocap.txt", f":{ROW + 1}"),
    pose_table.NAME: Layout("poses.csv", f":{ROW + 4}"),
    tum.NAME: Layout("trajectory.txt", f":{ROW + 4}"),
    arkitscenes.NAME: Layout("lowres_wide.traj", f":{ROW + 1}"),
    record3d.NAME: Layout("metadata", f", frame {ROW}"),
    polycam.NAME: Layout("keyframes/cameras/*.json", ""),
    scanner_3d.NAME: Layout("frame_*.json", ""),
    nerfcapture.NAME: Layout("transforms.json", f", frame {ROW}"),
    nerfstudio.NAME: Layout("transforms.json", f", frame {ROW}"),
    arkit_recorder.NAME: Layout("omocap.json", f", {65575.5 + ROW / 30:.6f}.jpg"),
    iphumi.NAME: Layout("omocap.json", f", pose {ROW}"),
    scannetpp.NAME: Layout("pose_intrinsic_imu.json", f", frame_{ROW:06d}"),
    spectacular.NAME: Layout("data.jsonl", f", line {ROW + 1}"),
}


def each(*formats: Format) -> pytest.MarkDecorator:
    """Run a test for each of these formats."""
    return pytest.mark.parametrize("format_", formats, ids=lambda f: f.NAME)


every_format = each(*FORMATS)


def pose_file(format_: Format, folder: Path) -> Path:
    """The pose file of a session, that of pose ROW where each pose has its own."""
    files = sorted(folder.glob(LAYOUT[format_.NAME].files))
    return files[ROW] if len(files) > 1 else files[0]


def write_log(format_: Format, session: CaptureSession, folder: Path) -> Path:
    """Write a session; returns its pose file."""
    return pose_file(format_, write_session(format_, session, folder))


def place(format_: Format, log: Path) -> str:
    """How an error names pose ROW of a log."""
    return f"{log}{LAYOUT[format_.NAME].place}"


def error_of(path: Path, read: Callable[[Path], object] = read_session) -> InputError:
    """The error that reading a session (or one of its depth maps) gives."""
    with pytest.raises(InputError) as caught:
        read(path)
    return caught.value


def edit_line(log: Path, line: int, change: Callable[[str], str]) -> None:
    """Change a line, counted from 1."""
    lines = log.read_text().split("\n")
    lines[line - 1] = change(lines[line - 1])
    log.write_text("\n".join(lines))


def edit_row(format_: Format, log: Path, change: Callable[[str], str]) -> None:
    """Change the line of pose ROW in a text log."""
    edit_line(log, int(LAYOUT[format_.NAME].place.removeprefix(":")), change)


def separator(format_: Format) -> str:
    """What stands between the fields of a text log."""
    return " " if format_ in (arkit_data_logger, tum, arkitscenes) else ","


def put(format_: Format, column: int, value: str) -> Callable[[str], str]:
    """Puts a value into a column of a line."""

    def change(line: str) -> str:
        fields = line.split(separator(format_))
        fields[column] = value
        return separator(format_).join(fields)

    return change


def edit_json(log: Path, change: Callable[[Any], object]) -> None:
    """Change the value of a JSON log in place."""
    value = json.loads(log.read_text())
    change(value)
    log.write_text(json.dumps(value))


LANDSCAPE = (48, 36)


def picture() -> np.ndarray:
    """Smooth colours, different in every corner; height, width and channels."""
    v, u = np.mgrid[: LANDSCAPE[1], : LANDSCAPE[0]]
    return np.stack([4 * u, 5 * v, 2 * (u + v)], axis=-1).astype(np.uint8)


def with_pictures(session: CaptureSession, folder: Path) -> CaptureSession:
    """An image at every third pose and a depth map at every fifth, in landscape."""
    folder.mkdir()
    images, maps = [], []
    for i in range(0, len(session.times), 3):
        images.append(folder / f"{i}.png")
        cv2.imwrite(str(images[-1]), picture())
    for i in range(0, len(session.times), 5):
        maps.append(folder / f"depth {i}.png")
        save_millimetres(np.full((6, 8), 1 + i / 1000, dtype=np.float32), maps[-1])
    assert session.intrinsics is not None
    return replace(
        session,
        image_size=LANDSCAPE,
        intrinsics=session.intrinsics / 40,
        images=tuple(images),
        video_times=session.times[::3],
        depth=DepthLog(session.times[::5], tuple(maps), load_millimetres),
    )
