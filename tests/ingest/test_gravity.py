"""Up is given, logged, or found with the accelerometer, the resting object or the floor's depth."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from ingest.mount import Mount
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, DepthLog, ImuLog
from ingest.trajectory.gravity import find_up, upright
from ingest.trajectory.object_motion import to_object_motion
from ingest.trajectory.plane import back_projected
from ingest.trajectory.rests import axis_of
from ingest.trajectory.trajectory_config import Reading
from omomo_core.errors import InputError
from omomo_core.geometry.runs import min_jerk

T_PHONE_OBJECT = np.eye(4)
T_PHONE_OBJECT[:3, :3] = Rotation.from_rotvec([1.1, -0.4, 0.6]).as_matrix()
T_PHONE_OBJECT[:3, 3] = [0.1, -0.3, 0.2]
MOUNT = Mount(T_PHONE_OBJECT, "test")
FLOOR = -1.1


def _carried(seed: int, rest: float = 1.0, seconds: float = 8.0, lean: float = 0.0) -> np.ndarray:
    """T_zup_object at 60 Hz: upright at rest, lifted, tilted, put down (leaning), at rest."""
    rng = np.random.default_rng(seed)
    clock = np.arange(int(seconds * 60)) / 60
    s = min_jerk((clock - rest) / (seconds - 2 * rest))
    swing = np.sin(np.pi * s) ** 2
    T = np.tile(np.eye(4), (len(clock), 1, 1))
    T[:, :3, 3] = [*rng.uniform(-0.5, 0.5, 2), FLOOR]
    T[:, :2, 3] += s[:, None] * rng.uniform(-1.5, 1.5, 2)
    T[:, 2, 3] += 0.7 * swing
    if rest == 0:
        T[:, :3, 3] += 0.05 * np.sin(np.outer(5 * clock, [1.0, 1.1, 1.3]))
    angles = np.stack([rng.uniform(-3, 3) + 1.5 * s, 0.4 * swing + lean * s], axis=1)
    T[:, :3, :3] = Rotation.from_euler("zx", angles).as_matrix()
    T[:, :3, 3] += rng.normal(scale=2e-4, size=(len(T), 3))
    return T


def _first_frame_session(T_zup_object: np.ndarray) -> CaptureSession:
    """What an app logs whose world is the first frame's."""
    T_zup_phone = T_zup_object @ np.linalg.inv(T_PHONE_OBJECT)
    return CaptureSession(
        app="Record3D",
        source=Path("made up"),
        times=np.arange(len(T_zup_object)) / 60,
        T_world_phone=np.linalg.inv(T_zup_phone[0]) @ T_zup_phone,
        gravity_aligned=False,
    )


def _true_up(T_zup_object: np.ndarray) -> np.ndarray:
    return (T_zup_object[0] @ np.linalg.inv(T_PHONE_OBJECT))[:3, :3].T @ [0, 0, 1]


def _imu(T_zup_object: np.ndarray) -> ImuLog:
    """Core Motion's signs: gravity minus acceleration, device axes, 100 Hz."""
    T = T_zup_object @ np.linalg.inv(T_PHONE_OBJECT)
    logged = np.arange(len(T)) / 60
    times = np.arange(0, logged[-1], 0.01)
    position = np.stack([np.interp(times, logged, p) for p in T[:, :3, 3].T], axis=1)
    smoothed = np.stack([np.convolve(p, np.ones(25) / 25, "same") for p in position.T], axis=1)
    acceleration = np.gradient(np.gradient(smoothed, 0.01, axis=0), 0.01, axis=0)
    acceleration[:30] = acceleration[-30:] = 0
    R = Slerp(logged, Rotation.from_matrix(T[:, :3, :3]))(times)
    accel = R.inv().apply([0, 0, -GRAVITY] - acceleration) @ R_CAMERA_DEVICE
    return ImuLog(times, accel, np.zeros_like(accel))


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1, 1))))


def _check_upright(take, T_zup_object: np.ndarray, degrees: float) -> None:
    """The object's attitude is the true one but for a heading, so the height of its axes is."""
    frames = min(len(take.motion.valid), len(T_zup_object) // 2)
    found = take.motion.T_world_object[:frames, 2, :3]
    np.testing.assert_allclose(
        found, T_zup_object[: 2 * frames : 2, 2, :3], atol=np.radians(degrees)
    )


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_the_named_axis_of_the_resting_object_rights_the_world(box, seed: int):
    T = _carried(seed)
    take = to_object_motion(_first_frame_session(T), box, MOUNT, Reading(up="object:z"))
    assert take.up.source == "given"
    assert _angle(take.up.direction, _true_up(T)) < 0.2
    _check_upright(take, T, 0.3)
    assert take.floor.source == "rest"
    assert take.motion.T_world_object[5, 2, 3] == pytest.approx(0, abs=0.004)


@pytest.mark.parametrize(("top", "axis"), [("object:-y", [0, -1, 0]), ("object:x", [1, 0, 0])])
def test_every_axis_can_be_named(top, axis):
    np.testing.assert_array_equal(axis_of(top), axis)


def test_a_box_may_rest_on_sides_that_keep_it_over_its_floor_so_its_user_is_asked(box):
    """On its head it would have sunk into the floor when it was lifted."""
    with pytest.raises(InputError) as caught:
        to_object_motion(_first_frame_session(_carried(1)), box, MOUNT)
    assert caught.value.code == "gravity-ambiguous"
    assert "on 5 of its sides" in caught.value.what
    assert "-x of the mesh up (‹up›" in caught.value.what
    assert "‹up› object:z" in caught.value.fix


def test_each_answer_that_is_offered_can_be_given(box):
    T = _carried(1)
    session = _first_frame_session(T)
    with pytest.raises(InputError) as caught:
        to_object_motion(session, box, MOUNT)
    offered = re.findall(r"(-?[xyz]) of the mesh up \(‹up› ([^)]*)\)", caught.value.what)
    ups = {axis: [float(x) for x in numbers.split(",")] for axis, numbers in offered}
    assert set(ups) == {"x", "-x", "y", "-y", "z"}
    assert _angle(np.array(ups["z"]) / np.linalg.norm(ups["z"]), _true_up(T)) < 1.0
    for up in ups.values():
        to_object_motion(session, box, MOUNT, Reading(up=tuple(up)))


def _in_a_world(T_zup_object: np.ndarray, up: str) -> CaptureSession:
    """What a tracker logs whose world is z up or y up, and which does not say so."""
    session = _first_frame_session(T_zup_object)
    T = T_zup_object @ np.linalg.inv(T_PHONE_OBJECT)
    if up == "y":
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler("x", -90, degrees=True).as_matrix()
        T = turn @ T
    return replace(session, T_world_phone=T, world_axes=True)


@pytest.mark.parametrize("up", ["y", "z"])
def test_of_a_world_s_axes_the_one_is_taken_on_which_the_object_stands(box, up: str):
    T = _carried(2)
    T[:, :3, :3] = Rotation.from_euler("z", 30, degrees=True).as_matrix() @ T[:, :3, :3]
    take = to_object_motion(_in_a_world(T, up), box, MOUNT)
    assert take.up.source == "rest"
    _check_upright(take, T, 0.3)
    assert take.notes[0].startswith(f"{up} is taken to be up")


def test_an_object_that_stands_along_neither_axis_is_asked_about(box):
    T = _carried(2)
    lean = np.eye(4)
    lean[:3, :3] = Rotation.from_euler("xy", [30, 40], degrees=True).as_matrix()
    with pytest.raises(InputError) as caught:
        to_object_motion(_in_a_world(lean @ T, "z"), box, MOUNT)
    assert caught.value.code == "gravity-ambiguous"


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_the_accelerometer_rights_the_world(box, seed: int):
    T = _carried(seed, lean=1.2)
    session = replace(_first_frame_session(T), imu=_imu(T))
    take = to_object_motion(session, box, MOUNT)
    assert take.up.source == "accelerometer"
    assert _angle(take.up.direction, _true_up(T)) < 1.5
    assert "accelerometer" in take.notes[0]


@settings(max_examples=20)
@example(seed=0, vector=(0.0, -1.0, 4.4e-161))
@given(
    seed=st.integers(0, 10**6),
    vector=st.tuples(*[st.floats(-5, 5)] * 3).filter(lambda v: np.linalg.norm(v) > 0.01),
)
def test_a_given_up_wins(box, seed: int, vector: tuple[float, float, float]):
    """Over the log's, and over an accelerometer that says something else."""
    T = _carried(seed)
    session = replace(_first_frame_session(T), imu=_imu(T), gravity_aligned=bool(seed % 2))
    take = to_object_motion(session, box, MOUNT, Reading(up=vector, floor=-1.0))
    assert take.notes == ()
    up = np.array(vector) / np.linalg.norm(vector)
    np.testing.assert_allclose(take.T_world_arkit[:3, :3] @ up, [0, 0, 1], atol=1e-7)
    np.testing.assert_allclose(np.linalg.det(take.T_world_arkit), 1, atol=1e-9)


def test_y_up_is_turned_as_ever(box):
    session = _first_frame_session(_carried(0))
    up = find_up(session, session.T_world_phone, np.ones(480, bool), box, (0.0, 3.0, 0.0))
    np.testing.assert_allclose(upright(up)[:3, :3], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (float("nan"), 1.0, 0.0)])
def test_no_direction(box, vector):
    with pytest.raises(InputError) as caught:
        to_object_motion(_first_frame_session(_carried(0)), box, MOUNT, Reading(up=vector))
    assert caught.value.code == "up-invalid"


def test_rests_that_disagree_are_named(box):
    session = _first_frame_session(_carried(1, lean=1.2))
    with pytest.raises(InputError) as caught:
        to_object_motion(session, box, MOUNT, Reading(up="object:z"))
    assert caught.value.code == "gravity-ambiguous"
    assert "0.0 to" in caught.value.where
    assert "to 8.0 s" in caught.value.where
    assert "‹up›" in caught.value.fix


def test_an_object_that_leans_where_it_rests_tells_nothing(box):
    with pytest.raises(InputError) as caught:
        to_object_motion(_first_frame_session(_carried(1, lean=0.6)), box, MOUNT)
    assert caught.value.code == "gravity-ambiguous"
    assert "cannot stand by itself" in caught.value.what


def test_without_any_hint_it_is_refused(box):
    with pytest.raises(InputError) as caught:
        to_object_motion(_first_frame_session(_carried(2, rest=0.0)), box, MOUNT)
    assert caught.value.code == "gravity-unknown"
    assert "Rest the object" in caught.value.fix
    assert "Record3D" in caught.value.what


@pytest.mark.parametrize(("degrees", "code"), [(1, None), (9, "note"), (25, "gravity-wrong")])
def test_a_log_whose_accelerometer_disagrees(box, degrees: float, code: str | None):
    T = _carried(3)
    T_arkit_zup = np.eye(4)
    wrong = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    T_arkit_zup[:3, :3] = wrong @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    session = replace(
        _first_frame_session(T),
        T_world_phone=T_arkit_zup @ T @ np.linalg.inv(T_PHONE_OBJECT),
        gravity_aligned=True,
        imu=_imu(T),
    )
    if code == "gravity-wrong":
        with pytest.raises(InputError) as caught:
            to_object_motion(session, box, MOUNT)
        assert caught.value.code == code
        assert "25 deg" in caught.value.what
        return
    take = to_object_motion(session, box, MOUNT)
    assert take.up.source == "log"
    assert [note for note in take.notes if "accelerometer" in note] == (
        ["The accelerometer and the poses differ about up by 9 deg."] if code else []
    )


def test_an_accelerometer_of_another_take_is_refused(box):
    T = _carried(4)
    imu = _imu(T)
    other = Rotation.from_euler("x", 0.8 * imu.times[:, None]).apply(imu.accel)
    session = replace(_first_frame_session(T), imu=replace(imu, accel=other))
    with pytest.raises(InputError) as caught:
        to_object_motion(session, box, MOUNT)
    assert caught.value.code == "gravity-wrong"


INTRINSICS, IMAGE_SIZE, MAP_SIZE = np.array([1460.0, 1450, 950, 725]), (1920, 1440), (64, 48)


def _depth_of_room(T_zup_phone: np.ndarray) -> np.ndarray:
    """What a depth sensor sees of a floor, a ceiling and two walls: metres along the view."""
    width, height = MAP_SIZE
    v, u = np.mgrid[:height, :width]
    x = ((u + 0.5) * IMAGE_SIZE[0] / width - 0.5 - INTRINSICS[2]) / INTRINSICS[0]
    y = ((v + 0.5) * IMAGE_SIZE[1] / height - 0.5 - INTRINSICS[3]) / INTRINSICS[1]
    rays = np.stack([x, -y, -np.ones_like(x)], axis=-1) @ T_zup_phone[:3, :3].T
    nearest = np.full(x.shape, np.inf)
    for axis, place in ((2, FLOOR), (2, FLOOR + 2.4), (0, 3.0), (0, -3.0), (1, 3.0), (1, -3.0)):
        with np.errstate(divide="ignore", invalid="ignore"):
            d = (place - T_zup_phone[axis, 3]) / rays[..., axis]
        nearest = np.where((d > 0) & (d < nearest), d, nearest)
    return np.where(nearest < 5, nearest, 0).astype(np.float32)


def _with_depth(session: CaptureSession, T_zup_object: np.ndarray, turns: int) -> CaptureSession:
    """A map for every tenth pose, stored turned as the app stores its images."""
    T_zup_phone = T_zup_object @ np.linalg.inv(T_PHONE_OBJECT)
    maps = {Path(f"{i}"): i for i in range(0, len(T_zup_phone), 10)}

    def load(path: Path) -> np.ndarray:
        return np.rot90(_depth_of_room(T_zup_phone[maps[path]]), -turns).copy()

    return replace(
        session,
        intrinsics=np.tile(INTRINSICS, (len(session.times), 1)),
        image_size=IMAGE_SIZE,
        image_turns=turns,
        depth=DepthLog(session.times[::10], tuple(maps), load),
    )


@pytest.mark.parametrize("turns", [0, 1, 3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_floor_in_depth_maps_rights_the_world(box, seed: int, turns: int):
    T = _carried(seed, rest=0.0)
    session = _with_depth(_first_frame_session(T), T, turns)
    take = to_object_motion(session, box, MOUNT, Reading(up="object:z"))
    assert take.up.source == "depth"
    assert _angle(take.up.direction, _true_up(T)) < 0.5
    _check_upright(take, T, 0.6)
    assert take.floor.source == "depth"
    height = take.motion.T_world_object[10, 2, 3] - (T[20, 2, 3] - FLOOR)
    assert height == pytest.approx(0, abs=0.02)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_floor_under_the_resting_object_says_which_side_it_stands_on(box, seed: int):
    T = _carried(seed)
    take = to_object_motion(_with_depth(_first_frame_session(T), T, 0), box, MOUNT)
    assert take.up.source == "rest"
    assert "depth maps" in take.up.note
    assert _angle(take.up.direction, _true_up(T)) < 0.5


def test_maps_while_tracking_is_lost_do_not_count(box):
    T = _carried(0, rest=0.0)
    session = _with_depth(_first_frame_session(T), T, 0)
    assert session.depth is not None
    lost = np.ones(len(T), bool)
    lost[:60] = False
    loaded: list[Path] = []

    def load(path: Path) -> np.ndarray:
        loaded.append(path)
        return session.depth.load(path)  # type: ignore[union-attr]

    watched = replace(session, tracking_ok=lost, depth=replace(session.depth, load=load))
    to_object_motion(watched, box, MOUNT, Reading(up="object:z"))
    assert min(int(path.name) for path in loaded) >= 60


def test_back_projection_is_the_pinhole_camera():
    depth = np.zeros((48, 64), np.float32)
    depth[:] = 2.0
    points = back_projected(depth, np.array([1460.0, 1460, 959.5, 719.5]), IMAGE_SIZE)
    np.testing.assert_allclose(points[:, 2], -2.0)
    # The corner pixels' centres, by hand: 30 pixels of the image for each of the map.
    assert points[:, 0].min() == pytest.approx(-(959.5 - 14.5) / 1460 * 2)
    assert points[:, 1].max() == pytest.approx((719.5 - 14.5) / 1460 * 2)
    np.testing.assert_array_equal(points[0, :2] < 0, [True, False])
    assert len(back_projected(depth * 0, INTRINSICS, IMAGE_SIZE)) == 0


def test_one_rest_is_enough_to_ask(box):
    """The take ends in the air."""
    T = _carried(1)[:300]
    with pytest.raises(InputError) as caught:
        to_object_motion(_first_frame_session(T), box, MOUNT)
    assert caught.value.code == "gravity-ambiguous"
    assert "z of the mesh up" in caught.value.what
