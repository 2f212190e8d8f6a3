"""refine: what the floor under an object tells about its mount, how surely, and when it tells nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import CARRY, LIFT, REST, carried_box, clamped_phone
from capture_app.simulator.simulated_phone import NO_NOISE, simulate
from ingest.calibration.floor_contacts import find_contacts, track
from ingest.calibration.floor_fit import refine
from ingest.mount import Mount
from ingest.session import CaptureSession, DepthLog
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMesh
from tests.ingest.calibration.floor_takes import (
    SIDES,
    Stand,
    believed,
    clamped,
    crate,
    phone_height,
    recorded,
    standing_motion,
)

ROUGH = np.diag([np.radians(2.5) ** 2] * 3 + [0.02**2] * 3)
THERE_AND_BACK = [Stand((0, 0), 0.0), Stand((0.6, 0.2), 1.5), Stand((0.1, 0), 3.0)]


def tilt_error(found: Mount, truth: Mount, down_object: np.ndarray) -> float:
    """Degrees between where a direction of the object points under the two mounts."""
    a, b = (m.T_phone_object[:3, :3] @ down_object for m in (found, truth))
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


def height_error(found: Mount, truth: Mount, down_object: np.ndarray, centre: np.ndarray) -> float:
    """Metres by which a point of the object is too high, when that direction of the truth is down."""
    down = truth.T_phone_object[:3, :3] @ down_object
    a, b = (m.T_phone_object[:3, :3] @ centre + m.T_phone_object[:3, 3] for m in (found, truth))
    return float(abs(down @ (a - b)))


DOWN = np.array([0.0, 0, -1])


def test_a_rest_fixes_the_tilt_and_a_tape_the_height():
    rng = np.random.default_rng(0)
    mesh, truth = crate(), clamped(rng)
    motion = standing_motion(mesh, THERE_AND_BACK)
    session = recorded(motion, truth, 0)
    guess = believed(truth, ROUGH + np.diag([0] * 3 + [0.05**2] * 3), rng)
    found = refine(guess, session, mesh, phone_height=phone_height(motion, truth))
    assert tilt_error(guess, truth, DOWN) > 1.5
    assert tilt_error(found, truth, DOWN) < 1.0
    assert height_error(guess, truth, DOWN, np.zeros(3)) > 0.02
    assert height_error(found, truth, DOWN, np.zeros(3)) < 0.015
    assert "the tilt to 0." in found.note
    assert "the height to" in found.note
    assert found.method == "made up, refined by the floor"
    assert set(found.residuals) == {"floor_tilt_deg", "floor_height_mm"}
    # The heading is as it was: nothing on a level floor tells it.
    heading = [m.T_phone_object[:3, :3] @ [1.0, 0, 0] for m in (guess, found)]
    assert np.degrees(np.arccos(heading[0] @ heading[1])) < 3.5


def test_without_the_floor_s_height_pushing_leaves_the_height_free():
    rng = np.random.default_rng(1)
    mesh, truth = crate(), clamped(rng)
    pushed = [Stand((0, 0), 0.0, push=True), Stand((0.8, 0.3), 1.0, push=True), Stand((0, 0.9), 2)]
    session = recorded(standing_motion(mesh, pushed), truth, 1)
    guess = believed(truth, ROUGH + np.diag([0] * 3 + [0.2**2] * 3), rng)
    found = refine(guess, session, mesh)
    assert tilt_error(found, truth, DOWN) < 1.0
    assert "3 rests and 2 pushes on 1 side" in found.note
    assert "Pushing on the floor leaves the height free" in found.note
    assert "tilt the object by 20 degrees" in found.note
    assert "the height of the object" in found.free
    down = truth.T_phone_object[:3, :3] @ DOWN
    shift = between(guess.T_phone_object, found.T_phone_object)[3:]
    assert abs(shift @ down) < 0.01


def test_rests_on_three_sides_fix_everything():
    rng = np.random.default_rng(2)
    mesh, truth = crate(), clamped(rng)
    stands = [Stand((0.2 * k, 0), 0.3 * k, SIDES[k % 3]) for k in range(5)]
    session = recorded(standing_motion(mesh, stands), truth, 2)
    wide = np.diag([np.radians(3) ** 2] * 3 + [0.06**2] * 3)
    guess = believed(truth, wide, rng)
    found = refine(guess, session, mesh)
    assert found.covariance is not None
    assert bounds_95(found.covariance).deg < 1.6
    step = between(found.T_phone_object, truth.T_phone_object)
    assert np.degrees(np.linalg.norm(step[:3])) < 1.6
    assert "the heading to" in found.note
    assert "rests on several sides" in found.note
    # Three heights over one floor that nobody knows are two differences.
    assert len(found.free) == 1
    height = phone_height(standing_motion(mesh, stands), truth)
    placed = refine(guess, session, mesh, phone_height=height)
    shift = between(placed.T_phone_object, truth.T_phone_object)[3:]
    assert np.linalg.norm(shift) < 0.03
    assert placed.covariance is not None
    assert bounds_95(placed.covariance).mm < 40
    assert placed.free == ()


def _looking_down() -> Mount:
    """A phone on top of the crate that looks ahead and down."""
    T_object_phone = np.eye(4)
    ahead = Rotation.from_matrix([[0, 0, -1.0], [-1, 0, 0], [0, 1, 0]])
    down = Rotation.from_euler("x", -40, degrees=True)
    T_object_phone[:3, :3] = (ahead * down).as_matrix()
    T_object_phone[:3, 3] = [0.2, 0, 0.55]
    return Mount(inverse(T_object_phone), "made up")


def _with_depth(session: CaptureSession, truth: Mount, floor: float) -> CaptureSession:
    """With depth maps that show a level floor below the phone, wherever it is, and nothing else."""
    height, width = 48, 64
    K, size = session.intrinsics, session.image_size
    assert K is not None
    assert size is not None
    frames = np.arange(0, len(session.times), 30)
    v, u = np.mgrid[:height, :width]
    maps = []
    for k in frames:
        fx, fy, cx, cy = K[k]
        rays = np.stack(
            [
                ((u + 0.5) * size[0] / width - 0.5 - cx) / fx,
                -((v + 0.5) * size[1] / height - 0.5 - cy) / fy,
                -np.ones((height, width)),
            ],
            axis=-1,
        )
        T = session.T_world_phone[k]
        falling = (rays @ T[:3, :3].T)[..., 1]
        depth = (floor - T[1, 3]) / np.where(falling < -0.05, falling, -np.inf)
        maps.append(np.where(depth < 5, depth, 0).astype(np.float32))
    files = tuple(Path(str(k)) for k in range(len(maps)))
    log = DepthLog(session.times[frames], files, lambda path: maps[int(path.name)])
    return replace(session, depth=log)


def test_depth_maps_and_a_given_floor_tell_the_height_as_well():
    rng = np.random.default_rng(3)
    mesh, truth = crate(), _looking_down()
    motion = standing_motion(mesh, THERE_AND_BACK)
    session = simulate(motion, truth, seed=3, noise=NO_NOISE)
    floor = float(session.T_world_phone[0, 1, 3]) - phone_height(motion, truth)
    guess = believed(truth, ROUGH + np.diag([0] * 3 + [0.05**2] * 3), rng)
    shown = refine(guess, _with_depth(session, truth, floor), mesh)
    given = refine(guess, session, mesh, floor=floor)
    for found, words in ((shown, "the floor in the depth maps"), (given, "height as given")):
        assert words in found.note
        assert height_error(found, truth, DOWN, np.zeros(3)) < 0.008
        assert tilt_error(found, truth, DOWN) < 0.3


def test_a_perfect_take_with_little_known_before_is_nearly_exact():
    truth = clamped(np.random.default_rng(4))
    mesh = crate()
    motion = standing_motion(mesh, [Stand((0.2 * k, 0), 0.3 * k, SIDES[k % 3]) for k in range(4)])
    session = simulate(motion, truth, seed=4, noise=NO_NOISE)
    step = np.array([0.05, -0.06, 0.04, 0.03, 0.05, -0.04])
    T = moved(truth.T_phone_object, step)
    found = refine(Mount(T, "drawing"), session, mesh, phone_height=phone_height(motion, truth))
    assert "5 deg and 50 mm on each axis were assumed" in found.note
    left = between(found.T_phone_object, truth.T_phone_object)
    assert np.degrees(np.linalg.norm(left[:3])) < 0.2
    assert np.linalg.norm(left[3:]) < 0.004


def test_a_rest_on_a_table_tells_the_tilt_and_not_the_height():
    rng = np.random.default_rng(5)
    mesh, truth = crate(), clamped(rng)
    motion = standing_motion(mesh, THERE_AND_BACK)
    T = motion.T_world_object.copy()
    lifted = 0.4 * np.clip((np.arange(len(T)) - 100) / 40, 0, 1)
    T[:, 2, 3] += lifted * (np.arange(len(T)) < 150)  # the last rest but one is on a table
    T[:, 2, 3] += 0.4 * np.clip((190 - np.arange(len(T))) / 40, 0, 1) * (np.arange(len(T)) >= 150)
    session = simulate(replace(motion, T_world_object=T), truth, seed=5, noise=NO_NOISE)
    found = refine(
        believed(truth, ROUGH, rng), session, mesh, phone_height=phone_height(motion, truth)
    )
    assert height_error(found, truth, DOWN, np.zeros(3)) < 0.008


@pytest.mark.parametrize("seed", range(3))
def test_a_floor_that_contradicts_the_mount_is_an_error(seed: int):
    rng = np.random.default_rng(seed)
    mesh, truth = crate(), clamped(rng)
    motion = standing_motion(mesh, THERE_AND_BACK)
    session = recorded(motion, truth, seed)
    tight = np.diag([np.radians(0.4) ** 2] * 3 + [0.003**2] * 3)
    across = truth.T_phone_object[:3, :3] @ [1.0, 0, 0]
    turned = moved(truth.T_phone_object, np.array([*np.radians(6) * across, 0, 0, 0]))
    with pytest.raises(InputError, match="The floor contradicts the mount") as caught:
        refine(replace(truth, T_phone_object=turned, covariance=tight), session, mesh)
    assert caught.value.code == "floor-contradicts-mount"
    assert caught.value.where == "simulated"
    assert "deg and move it by" in caught.value.what
    sure = believed(truth, tight, rng)
    with pytest.raises(InputError, match="contradicts"):
        refine(sure, session, mesh, phone_height=phone_height(motion, truth) + 0.06)
    assert refine(sure, session, mesh, phone_height=phone_height(motion, truth)).note


def _refused(code: str, mesh: ObjectMesh, stands: list[Stand], truth: Mount, **more) -> InputError:
    session = recorded(standing_motion(mesh, stands), truth, 0)
    with pytest.raises(InputError) as caught:
        refine(replace(truth, covariance=ROUGH), session, mesh, **more)
    assert caught.value.code == code
    assert caught.value.fix
    return caught.value


def test_what_cannot_tell_is_refused_in_words():
    truth = clamped(np.random.default_rng(6))
    leaning = Rotation.from_euler("x", 30, degrees=True)
    error = _refused("floor-no-side", crate(), [Stand((0, 0), 0.0, leaning)], truth)
    assert "leans by 30 deg" in error.what or "leans by 29 deg" in error.what
    assert "castors" in error.fix
    two = [Stand((0, 0), 0.0), Stand((0.3, 0), 0.5, Rotation.from_euler("x", 6, degrees=True))]
    error = _refused("floor-rests-disagree", crate(), two, truth)
    assert "6." in error.what or "5." in error.what
    _refused("floor-twice", crate(), [Stand((0, 0), 0.0)], truth, phone_height=0.4, floor=-0.4)
    _refused("floor-height", crate(), [Stand((0, 0), 0.0)], truth, phone_height=30.0)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_carried_object_is_never_taken_for_one_on_the_floor(seed: int):
    """The carry of the demonstration has level stretches of more than a second."""
    motion, truth = carried_box(), replace(clamped_phone(), covariance=ROUGH)
    carry = slice(round((REST + LIFT) * FPS), round((REST + LIFT + CARRY) * FPS))
    T = motion.T_world_object[carry]
    aloft = replace(motion, T_world_object=T, valid=np.ones(len(T), bool))
    session = recorded(aloft, truth, seed)
    assert {contact.kind for contact in find_contacts(track(session))} == {"push"}
    with pytest.raises(InputError) as caught:
        refine(truth, session, motion.mesh)
    assert caught.value.code == "floor-no-contact"
    whole = refine(truth, recorded(motion, truth, seed), motion.mesh)
    assert "2 rests and 0 pushes" in whole.note


def test_a_log_without_gravity_says_nothing():
    truth = clamped(np.random.default_rng(8))
    session = recorded(standing_motion(crate(), THERE_AND_BACK), truth, 0)
    guess = replace(truth, covariance=ROUGH)
    with pytest.raises(InputError) as caught:
        refine(guess, replace(session, gravity_aligned=False, imu=None), crate())
    assert caught.value.code == "floor-gravity"
    # The accelerometer stands in for it.
    found = refine(guess, replace(session, gravity_aligned=False), crate())
    assert tilt_error(found, truth, DOWN) < 1.5


def test_the_refined_mount_is_that_of_the_same_object():
    rng = np.random.default_rng(9)
    truth = clamped(rng)
    motion = standing_motion(crate(), THERE_AND_BACK)
    session = recorded(motion, truth, 9)
    guess = replace(believed(truth, ROUGH, rng), phone="iPhone 15", residuals={"rms_mm": 2.0})
    found = refine(guess, session, crate())
    assert found.object_id.startswith("crate, 40 x 30 x 50 cm")
    assert (found.phone, found.residuals["rms_mm"]) == ("iPhone 15", 2.0)
    assert inverse(found.T_phone_object)[3, 3] == 1
