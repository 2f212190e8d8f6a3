"""A phone is a plate: where it cannot be, the mount or the mesh is wrong."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.inspection import look_over
from capture_app.simulator.demo_take import box_mesh, carried_box, clamped_phone
from capture_app.simulator.simulated_phone import simulate
from ingest.mount import Mount
from ingest.report.phone_place import phone_place, phone_plate, place_check
from ingest.report.take_report import Check
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion


def _at(position, degrees=(0.0, 0, 0)) -> Mount:
    """A phone in the object's frame: upright, its camera looking to +x; turned after that."""
    T = np.eye(4)
    upright = np.array([[0.0, 0, -1], [0, -1, 0], [-1, 0, 0]])
    T[:3, :3] = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix() @ upright
    T[:3, 3] = position
    return Mount(inverse(T), "hand")


@pytest.fixture(scope="module")
def box() -> ObjectMesh:
    solid = trimesh.creation.box((0.4, 0.4, 0.6))
    return ObjectMesh(np.asarray(solid.vertices), np.asarray(solid.faces), "box")


def test_the_plate_hangs_below_a_camera_that_is_upright():
    T_object_phone = inverse(_at((0, 0, 0)).T_phone_object)
    heights = phone_plate() @ T_object_phone[2, :3]
    assert (heights.min(), heights.max()) == pytest.approx((-0.135, 0.012))


def test_a_phone_at_the_surface_is_well(box: ObjectMesh):
    place = phone_place(box, _at((0.22, 0, 0.2)))
    assert place.distance == pytest.approx(0.016, abs=0.001)
    assert (place.depth, place.hidden) == (0.0, 0.0)
    assert place_check(box, _at((0.22, 0, 0.2))).severity == "ok"


@pytest.mark.parametrize(
    ("mount", "severity", "words"),
    [
        (_at((0.1, 0, 0.2)), "bad", "10 cm inside"),
        (_at((0.22, 0, 0.2), (0, 60, 0)), "bad", "inside"),
        (_at((0.35, 0, 0.2)), "warn", "15 cm from the object's surface, which takes an arm"),
        (_at((0.9, 0, 0.2)), "bad", "from the object's surface"),
        (_at((0.25, 0, 0.0), (0, 0, 180)), "bad", "fill 100% of its camera's view"),
    ],
    ids=["in it", "turned into it", "off it", "far off it", "looks into it"],
)
def test_where_no_phone_can_be(box: ObjectMesh, mount: Mount, severity: str, words: str):
    check = place_check(box, mount)
    assert (check.severity, words in check.message) == (severity, True), check


def test_an_arm_is_believed_where_the_mount_was_measured(box: ObjectMesh):
    measured = replace(_at((0.35, 0, 0.2)), covariance=np.eye(6) * 1e-6)
    assert place_check(box, measured).severity == "ok"


def _inspected(motion: ObjectMotion, mount: Mount | None = None, seed: int = 0) -> dict[str, Check]:
    true = clamped_phone()
    session = replace(simulate(motion, true, seed=seed), imu=None)
    found = look_over(session, box_mesh(), mount or true)
    return {check.name: check for check in found.report.checks if check.severity != "ok"}


def _lifted(height: float, *, from_frame: int = 200) -> ObjectMotion:
    """The carried box that ends higher, and stays there unheld."""
    motion = carried_box()
    T = motion.T_world_object.copy()
    T[:, 2, 3] += height * np.clip((np.arange(len(T)) - from_frame) / FPS, 0, 1)
    return replace(motion, T_world_object=T)


def test_the_good_take_is_good():
    assert _inspected(carried_box()) == {}


def test_what_stays_in_the_air_unheld_is_told():
    assert (
        "0.93 m above the floor, with nobody holding it"
        in _inspected(_lifted(0.9))["height"].message
    )
    assert _inspected(_lifted(1.9))["height"].severity == "bad"


def test_rests_of_different_heights_are_a_slip_or_two_places():
    assert "higher or lower in one rest" in _inspected(_lifted(0.2))["mount slip"].message


def test_what_never_moves_is_no_take():
    motion = carried_box()
    still = replace(motion, T_world_object=np.repeat(motion.T_world_object[:1], 200, axis=0),
                    valid=np.ones(200, bool))  # fmt: skip
    path = _inspected(still)["path"]
    assert path.severity == "bad"
    assert "the object moves by 0." in path.message


def test_what_falls_is_held_by_nobody():
    motion = carried_box()
    T = np.repeat(motion.T_world_object[:1], 240, axis=0)
    clock = np.arange(240) / FPS
    T[:, 2, 3] += 0.4 * (1 - np.cos(np.pi * np.clip((clock - 1.5) / 2, 0, 1)))
    T[150:, 2, 3] = T[0, 2, 3] + np.maximum(0.0, 0.8 - 9.81 / 2 * (clock[150:] - clock[150]) ** 2)
    fall = _inspected(replace(motion, T_world_object=T, valid=np.ones(240, bool)))["fall"]
    assert "falls freely from 5.0" in fall.message
