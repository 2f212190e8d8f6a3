"""Where the board is on the object: from picked points and from a matrix."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.board.board_place import load_place, place_from_points
from ingest.calibration.board.board_spec import PRESETS
from ingest.uncertainty import between
from omomo_core.errors import InputError

BOARD = PRESETS["A4"]
PLACE = np.eye(4)
PLACE[:3, :3] = Rotation.from_euler("xyz", [80, 10, -30], degrees=True).as_matrix()
PLACE[:3, 3] = [0.1, -0.2, 0.4]
NUMBERS = [0, 3, 20, 23]


def on_object(points: np.ndarray) -> np.ndarray:
    return points @ PLACE[:3, :3].T + PLACE[:3, 3]


def test_points_of_a_json_file(tmp_path: Path):
    outer = np.array([[175.0, 0], [0, 245.0]])
    metres = np.concatenate([outer / 1e3, np.zeros((2, 1))], axis=1)
    rows = [{"corner": n, "object": on_object(BOARD.corners[n]).tolist()} for n in (0, 23)]
    rows += [
        {"board_mm": mm.tolist(), "object": on_object(m).tolist()}
        for mm, m in zip(outer, metres, strict=True)
    ]
    (tmp_path / "place.json").write_text(json.dumps({"points": rows, "sigma_mm": 1.0}))
    place = load_place(tmp_path / "place.json", BOARD)
    np.testing.assert_allclose(place.T_object_board, PLACE, atol=1e-9)
    assert place.rms < 1e-9
    assert 1e-7 < place.covariance[3, 3] < 2e-6


@pytest.mark.parametrize("header", ["corner,x,y,z", "board_x_mm,board_y_mm,x,y,z"])
def test_points_of_a_csv_file(tmp_path: Path, header):
    lines = [header]
    for n in NUMBERS:
        x, y, z = on_object(BOARD.corners[n])
        first = str(n) if header[0] == "c" else ",".join(f"{1e3 * v}" for v in BOARD.corners[n][:2])
        lines.append(f"{first},{x},{y},{z}")
    (tmp_path / "place.csv").write_text("\n".join(lines) + "\n")
    np.testing.assert_allclose(
        load_place(tmp_path / "place.csv", BOARD).T_object_board, PLACE, atol=1e-9
    )


def test_a_matrix(tmp_path: Path):
    np.savetxt(tmp_path / "place.txt", PLACE)
    place = load_place(tmp_path / "place.txt", BOARD)
    np.testing.assert_allclose(place.T_object_board, PLACE, atol=1e-9)
    assert np.sqrt(np.diag(place.covariance)) == pytest.approx([np.radians(1)] * 3 + [0.002] * 3)


def test_it_is_as_sure_as_it_says():
    rng = np.random.default_rng(2)
    points = BOARD.corners[NUMBERS]
    far = []
    for _ in range(300):
        place = place_from_points(points, on_object(points) + rng.normal(0, 0.002, (4, 3)))
        step = between(place.T_object_board, PLACE)
        far.append(step @ np.linalg.solve(place.covariance, step))
    assert np.mean(np.array(far) < chi2.ppf(0.95, 6)) > 0.92


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ('{"points": 3}', "place-unreadable"),
        ('{"points": [{"corner": 0}]}', "place-unreadable"),
        ('{"points": [{"corner": 99, "object": [0, 0, 0]}]}', "place-corner"),
        ('{"points": [{"corner": 0, "object": [0, 0, 0]}]}', "points-few"),
        ("corner,x,y\n0,0,0\n", "place-unreadable"),
        ("1 2 3", "pose-unreadable"),
    ],
)
def test_what_is_no_place_is_refused(tmp_path: Path, text, code):
    (tmp_path / "place").write_text(text)
    with pytest.raises(InputError) as error:
        load_place(tmp_path / "place", BOARD)
    assert error.value.code == code


def test_a_missing_file_shows_an_example(tmp_path: Path):
    with pytest.raises(InputError) as error:
        load_place(tmp_path / "place.json", BOARD)
    assert '"board_mm"' in error.value.fix
