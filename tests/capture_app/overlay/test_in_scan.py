"""A camera that watched, found again in a scan of the object and its room."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.overlay_film import TimedPictures, Watcher
from capture_app.overlay.placing import by_scan
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.uncertainty import between
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMotion
from tests.simulator.scan_model import drawn_model
from tests.simulator.scan_scene import ScanScene, film, intrinsics, orbit_poses, scan_scene

WIDTH = 480


@dataclass(frozen=True)
class Scanned:
    """A scan of a chair in a room, and the chair's motion in a world of its own."""

    scene: ScanScene
    scan: OverlayRequest
    moved: ObjectMotion
    T_motion_room: np.ndarray


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Scanned:
    folder = tmp_path_factory.mktemp("scan")
    scene = scan_scene(1)
    model = drawn_model(scene, orbit_poses(scene, 8), folder, width=WIDTH, seed=1)
    np.savetxt(folder / "to_object.txt", model.T_object_model)
    T_motion_room = np.eye(4)
    T_motion_room[:2, 3] = [1.0, -2.0]
    T = np.tile(T_motion_room @ scene.T_world_object, (31, 1, 1))
    T[10:, 2, 3] += 0.5  # lifted after a third of a second
    moved = ObjectMotion(scene.mesh, T, np.ones(31, bool))
    scan = OverlayRequest(
        result=folder,
        output=folder / "film.mp4",
        scan=model.sparse,
        scan_images=model.images,
        model_to_object=folder / "to_object.txt",
    )
    return Scanned(scene, scan, moved, T_motion_room)


def watcher(scanned: Scanned, path: np.ndarray, T_rest_room: np.ndarray) -> Watcher:
    """A phone that films the room from each pose (ARKit's axes) of a path."""
    pictures = [picture for picture, _ in film(scanned.scene, path, WIDTH)]
    taken = TimedPictures(
        Path("film"),
        np.arange(len(path)) / 2,
        (WIDTH, pictures[0].shape[0]),
        lambda start, stop: iter(list(enumerate(pictures))[start:stop]),
    )
    K = np.tile(intrinsics(WIDTH), (len(path), 1))
    return Watcher(taken, T_rest_room @ path @ T_OPENCV_ARKIT_CAMERA, K, np.zeros(5))


def walk(scanned: Scanned) -> np.ndarray:
    return orbit_poses(scanned.scene, 24)[[1, 4, 7]]


def test_a_moving_phone_is_found_in_the_world_of_the_motion(scanned: Scanned) -> None:
    T_rest_room = np.eye(4)
    T_rest_room[:3, 3] = [0.3, 0.2, -0.1]
    seen = watcher(scanned, walk(scanned), T_rest_room)
    found = by_scan(scanned.scan, scanned.moved, seen, lambda stage, done: None)
    step = between(scanned.T_motion_room @ inverse(T_rest_room), found[None])[0]
    assert np.degrees(np.linalg.norm(step[:3])) < 0.5
    assert np.linalg.norm(step[3:]) < 0.015


def test_the_time_of_the_scan_is_that_of_the_motion(scanned: Scanned) -> None:
    seen = watcher(scanned, walk(scanned)[:1], np.eye(4))
    late = scanned.scan.model_copy(update={"scanned_at": 1.0})
    found = by_scan(late, scanned.moved, seen, lambda stage, done: None)
    assert found[2, 3] == pytest.approx(0.5, abs=0.03)
    with pytest.raises(InputError) as refused:
        by_scan(
            scanned.scan.model_copy(update={"scanned_at": 9.0}),
            scanned.moved,
            seen,
            lambda stage, done: None,
        )
    assert refused.value.code == "scan-time"
