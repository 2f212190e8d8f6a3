"""A few images of a session prove the axes of its poses, or name how they were misread."""

from dataclasses import replace
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from capture_app.inspection import inspect_take
from capture_app.simulator.demo_take import DEMO, SESSION
from ingest.formats import (
    arkit_recorder,
    arkitscenes,
    ios_logger,
    iphumi,
    scan_capture,
    scannetpp,
    spectacular,
    stray_scanner,
)
from ingest.formats.registry import Format, read_session
from ingest.report.checked_session import CheckedSession
from ingest.report.sight import explained, sight
from ingest.report.take_inspection import inspect_session
from ingest.report.take_report import Check
from ingest.session import CaptureSession
from ingest.session_images import pictures
from omomo_core.geometry.transforms import inverse
from tests.ingest.formats.logs import PICTURES, each
from tests.ingest.good_take import kept, posed, turned_camera, turned_world
from tests.log_writers import write_session

FILMED = (stray_scanner, ios_logger, iphumi, scan_capture, scannetpp, spectacular)
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def filmed() -> CaptureSession:
    """The demo: 679 images of 320 x 240 pixels in a video, intrinsics for 1920 x 1440."""
    return read_session(DEMO / SESSION)


@pytest.fixture(scope="module")
def film(filmed: CaptureSession) -> list[np.ndarray]:
    """Every image of its video, in colour."""
    with av.open(str(filmed.video)) as container:
        return [frame.to_ndarray(format="bgr24") for frame in container.decode(video=0)]


@pytest.fixture(scope="module")
def photographed(
    filmed: CaptureSession, film: list[np.ndarray], tmp_path_factory: pytest.TempPathFactory
) -> CaptureSession:
    """Ten poses a second, an image of each in a file of its own."""
    folder = tmp_path_factory.mktemp("photographs")
    session = kept(filmed, slice(None, None, 6))
    files = tuple(folder / f"{i}.png" for i in range(len(session.times)))
    for file, picture in zip(files, film[::6], strict=True):
        cv2.imwrite(str(file), picture)
    return replace(session, video=None, imu=None, images=files)


def _seen(session: CaptureSession) -> Check:
    return sight(CheckedSession(session))


def _transposed(T: np.ndarray) -> np.ndarray:
    other = T.copy()
    other[:, :3, :3] = T[:, :3, :3].swapaxes(1, 2)
    return other


def test_the_demo_fits_its_images(filmed: CaptureSession):
    check = _seen(filmed)
    assert check.severity == "ok", check.message
    assert int(check.message.split("%")[0]) > 70


def test_photographs_fit_too(photographed: CaptureSession):
    assert _seen(photographed).severity == "ok"


@pytest.mark.parametrize(
    ("misread", "name"),
    [
        (lambda T: T @ FLIP, "with OpenCV axes"),
        (inverse, "from world to camera"),
        (lambda T: FLIP @ inverse(T), "from world to camera with OpenCV axes"),
        (_transposed, "with transposed rotations"),
    ],
)
def test_misread_axes_are_named(photographed: CaptureSession, misread, name: str):
    check = _seen(posed(photographed, misread(photographed.T_world_phone)))
    assert check.severity == "bad"
    assert f"the images fit poses {name} (" in check.message
    assert check.fix


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_a_turned_camera_is_named_by_the_turn_that_mends_it(filmed: CaptureSession, degrees: int):
    check = _seen(turned_camera(filmed, "z", 360 - degrees))
    assert check.severity == "bad"
    assert f"poses turned by {degrees} deg about the viewing axis" in check.message


def test_where_the_world_begins_does_not_matter(filmed: CaptureSession):
    elsewhere = turned_world(filmed, "zyx", [100, 30, -50])
    elsewhere.T_world_phone[:, :3, 3] += [5.0, -3.0, 40.0]
    assert _seen(elsewhere) == _seen(filmed)


@each(*FILMED)
def test_each_layout_with_a_video_keeps_its_axes(
    filmed: CaptureSession, tmp_path: Path, format_: Format
):
    back = read_session(write_session(format_, filmed, tmp_path / "take"))
    assert back.video is not None
    check = _seen(back)
    assert check.severity == "ok", check.message
    assert "fit the poses" in check.message


@each(*PICTURES, arkit_recorder, arkitscenes)
def test_each_layout_with_images_keeps_its_axes(
    photographed: CaptureSession, tmp_path: Path, format_: Format
):
    small = replace(
        photographed, image_size=(320, 240), intrinsics=(photographed.intrinsics + 0.5) / 6 - 0.5
    )
    back = read_session(write_session(format_, small, tmp_path / "take"))
    check = _seen(back)
    assert check.severity == "ok", check.message
    assert "fit the poses" in check.message


def test_portrait_images_are_turned_first(photographed: CaptureSession, tmp_path: Path):
    assert photographed.images is not None
    files = tuple(tmp_path / file.name for file in photographed.images)
    for source, file in zip(photographed.images, files, strict=True):
        cv2.imwrite(str(file), np.ascontiguousarray(np.rot90(cv2.imread(str(source)), -1)))
    portrait = replace(photographed, images=files)
    assert _seen(replace(portrait, image_turns=1)) == _seen(photographed)
    assert _seen(portrait).severity == "warn"


@pytest.mark.parametrize("blank", [slice(None), slice(1, None)])
def test_blank_walls_prove_nothing(photographed: CaptureSession, tmp_path: Path, blank: slice):
    wall = tmp_path / "wall.png"
    cv2.imwrite(str(wall), np.full((240, 320), 128, np.uint8))
    images = list(photographed.images or ())
    images[blank] = [wall] * len(images[blank])
    check = _seen(replace(photographed, images=tuple(images)))
    assert check.severity == "warn"
    assert "too few" in check.message


def test_images_of_another_take_are_amber(photographed: CaptureSession):
    check = _seen(replace(photographed, images=(photographed.images or ())[::-1]))
    assert check.severity == "warn"
    assert "belong to this log" in check.fix


def test_a_phone_that_lies_still_proves_nothing(filmed: CaptureSession):
    still = posed(filmed, np.repeat(filmed.T_world_phone[:1], len(filmed.times), axis=0))
    assert _seen(still).severity == "warn"


def test_damaged_images_are_amber(photographed: CaptureSession, filmed: CaptureSession, tmp_path):
    damaged = tmp_path / "damaged"
    damaged.write_bytes(b"no picture")
    images = (damaged,) * len(photographed.images or ())
    assert _seen(replace(photographed, images=images)).severity == "warn"
    assert _seen(replace(filmed, video=damaged)).severity == "warn"


def test_no_images_or_no_camera_is_no_fault(filmed: CaptureSession):
    assert _seen(replace(filmed, video=None)) == Check("sight", "ok", "no images")
    assert _seen(replace(filmed, intrinsics=None)).severity == "ok"


def test_wanted_frames_are_those_of_the_whole_video(filmed: CaptureSession, film: list[np.ndarray]):
    # The video has key frames at 0, 250 and 500.
    wanted = [0, 3, 247, 248, 249, 250, 251, 499, 500, 678]
    found = pictures(filmed, wanted)
    assert sorted(found) == wanted
    for index, picture in found.items():
        grey = cv2.cvtColor(film[index], cv2.COLOR_BGR2GRAY)
        assert np.abs(picture.astype(int) - grey).mean() < 12
        assert np.corrcoef(picture.ravel(), grey.ravel())[0, 1] > 0.999


def test_a_video_without_its_first_frame_is_not_out_of_step(filmed: CaptureSession):
    before = filmed.times[0] - 1 / 60
    dropped = replace(filmed, video_times=np.concatenate([[before], filmed.times]))
    assert set(pictures(dropped, [0, 1, 300])) == {1, 300}
    np.testing.assert_array_equal(pictures(dropped, [300])[300], pictures(filmed, [299])[299])


def test_points_in_front_are_explained_and_no_others():
    rng = np.random.default_rng(1)
    T = np.eye(4)
    T[:3, 3] = [0.3, 0.1, -0.05]
    points = rng.uniform([-1, -1, -4], [1, 1, -2], (50, 3))
    moved = points - T[:3, 3]
    ours, theirs = (p / np.linalg.norm(p, axis=1, keepdims=True) for p in (points, moved))
    assert explained(ours, theirs, T).all()
    assert not explained(ours, theirs, inverse(T)).any()
    raised = theirs + np.array([0.0, 0.03, 0.0])
    raised /= np.linalg.norm(raised, axis=1, keepdims=True)
    assert explained(ours, raised, T).mean() < 0.3


def test_it_runs_only_when_asked_for(filmed: CaptureSession):
    assert "sight" not in {check.name for check in inspect_session(filmed).checks}
    asked = inspect_take(DEMO / SESSION, images=True)
    assert [check.severity for check in asked.report.checks if check.name == "sight"] == ["ok"]
