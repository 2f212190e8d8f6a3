"""The witness's intrinsics: files of ours, OpenCV's and ROS's; calibrated from the board itself."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.calibration.board.board_lens import calibrate_camera
from ingest.calibration.board.board_spec import PRESETS
from ingest.calibration.board.camera_file import WitnessCamera, load_camera
from omomo_core.errors import InputError
from tests.ingest.calibration.board.filmed import poses
from tests.simulator.witness import corner_observations, save_camera

BOARD = PRESETS["A4"]
CAMERA = WitnessCamera(1400.0, 1410.0, 955.0, 548.0, (0.1, -0.2, 0.001, -0.001, 0.02), (1920, 1080))
ROS = """image_width: 1920
image_height: 1080
camera_name: webcam
camera_matrix:
  rows: 3
  cols: 3
  data: [1400, 0, 955, 0, 1410, 548, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, -0.001, 0.02]
"""


def same(a: WitnessCamera, b: WitnessCamera) -> bool:
    names = ("fx", "fy", "cx", "cy", "distortion", "size")
    return all(getattr(a, n) == getattr(b, n) for n in names)


def test_what_is_written_is_read(tmp_path: Path):
    save_camera(CAMERA, tmp_path / "camera.json")
    assert same(load_camera(tmp_path / "camera.json"), CAMERA)


def test_named_coefficients_and_no_size(tmp_path: Path):
    (tmp_path / "c.json").write_text('{"fx": 1400, "fy": 1410, "cx": 955, "cy": 548, "k1": 0.1}')
    camera = load_camera(tmp_path / "c.json")
    assert camera.distortion == (0.1, 0, 0, 0, 0)
    assert camera.size is None
    assert camera.at(640, 480) == camera


def test_ros_yaml(tmp_path: Path):
    (tmp_path / "c.yaml").write_text(ROS)
    assert same(load_camera(tmp_path / "c.yaml"), CAMERA)


def test_opencv_yaml(tmp_path: Path):
    path = tmp_path / "c.yml"
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("image_width", 1920)
    file.write("image_height", 1080)
    file.write("camera_matrix", CAMERA.K)
    file.write("distortion_coefficients", np.array([CAMERA.distortion]))
    file.release()
    assert same(load_camera(path), CAMERA)


def test_another_size_is_scaled_about_the_middle_of_pixels():
    half = CAMERA.at(960, 540)
    # The edge of the picture (-1/2) stays the edge.
    assert (half.fx, half.cx + 0.5) == (700, (955 + 0.5) / 2)
    with pytest.raises(InputError, match="1440"):
        CAMERA.at(1920, 1440)
    with pytest.raises(InputError) as error:
        CAMERA.at(1080, 1920)
    assert "turned" in error.value.fix


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "camera-unreadable"),
        ("{", "camera-unreadable"),
        ('{"fx": 1400}', "camera-unreadable"),
        ('{"fx": "x", "fy": 1, "cx": 1, "cy": 1}', "camera-unreadable"),
        ('{"fx": NaN, "fy": 1400, "cx": 900, "cy": 500}', "camera-values"),
        ('{"fx": 0.8, "fy": 0.8, "cx": 0.5, "cy": 0.5}', "camera-values"),
        (
            '{"fx": 900, "fy": 900, "cx": 9000, "cy": 5, "width": 640, "height": 480}',
            "camera-values",
        ),
        (ROS.replace("plumb_bob", "equidistant"), "camera-unreadable"),
        (ROS.replace("camera_matrix", "matrix"), "camera-unreadable"),
    ],
)
def test_files_that_are_no_camera_are_refused(tmp_path: Path, text, code):
    (tmp_path / "c").write_text(text)
    with pytest.raises(InputError) as error:
        load_camera(tmp_path / "c")
    assert error.value.code == code


def test_a_missing_file_shows_an_example(tmp_path: Path):
    with pytest.raises(InputError) as error:
        load_camera(tmp_path / "c.json")
    assert '"fx"' in error.value.fix


def calibrated(T: np.ndarray, camera: WitnessCamera, sigma: float, seed: int) -> WitnessCamera:
    rng = np.random.default_rng(seed)
    pixels, numbers = corner_observations(T, BOARD, camera, rng, sigma=sigma)
    assert camera.size is not None
    return calibrate_camera(pixels, numbers, BOARD, camera.size)


def test_a_camera_is_found_within_what_it_says():
    far = []
    for seed in range(5):
        T = poses(25, np.random.default_rng(seed))
        camera = WitnessCamera(
            1400.0, 1410.0, 955.0, 548.0, (0.1, -0.2, 5e-4, -5e-4, 0.0), (1920, 1080)
        )
        found = calibrated(T, camera, 0.3, seed)
        assert found.sigmas is not None
        errors = [getattr(found, n) - getattr(camera, n) for n in ("fx", "fy", "cx", "cy")]
        far.append(np.array(errors) / found.sigmas)
        assert abs(found.fx / camera.fx - 1) < 0.01
    assert np.abs(far).max() < 4
    assert 0.4 < np.sqrt(np.mean(np.square(far))) < 1.6


def test_views_that_are_alike_are_refused():
    T = np.tile(poses(1, np.random.default_rng(3), tilt=12), (60, 1, 1))
    T[:, 0, 3] += np.linspace(-0.01, 0.01, 60)
    with pytest.raises(InputError) as error:
        calibrated(T, CAMERA, 0.3, 0)
    assert error.value.code == "camera-calibration"
    assert "Tilt" in error.value.fix


def test_few_views_are_refused():
    with pytest.raises(InputError, match="only 5 pictures"):
        calibrated(poses(5, np.random.default_rng(3)), CAMERA, 0.3, 0)
