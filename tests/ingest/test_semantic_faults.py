"""Logs that read well and mean something wrong: each is named, placed, and told how to mend.

What no log can tell, and is therefore not here: a phone that slipped sideways or about the vertical
by less than a few centimetres; a mount that is wrong by exactly the turn from one side of a box to
another; without an IMU, a mirrored world, another scale or another pace. For the last, every log
without an IMU says that they are believed. Permuted quaternion columns keep the speed of rotation, so that
only gravity and the gyroscope tell them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from capture_app.inspection import Inspection, refuse_bad, usable_take
from ingest.formats import arkit_data_logger, ios_logger, scan_capture, stray_scanner, tum
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession
from ingest.trajectory.rests import find_rests
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest import good_take as go
from tests.ingest.good_take import AT, Take


@dataclass(frozen=True)
class Fault:
    """What is done to the session, and the check that tells."""

    name: str
    corrupt: Callable[[CaptureSession], CaptureSession]
    check: str
    refused: bool
    """By a run; if not, the check is amber."""
    at: int | None = None
    """A logged pose that the check's frames hold; the take is not used there."""
    format_: object = stray_scanner


def splits(name: str, corrupt, check: str, at: int = AT, format_=stray_scanner) -> Fault:
    return Fault(name, corrupt, check, refused=False, at=at, format_=format_)


def warns(name: str, corrupt, check: str, format_=stray_scanner) -> Fault:
    return Fault(name, corrupt, check, refused=False, format_=format_)


def refused(name: str, corrupt, check: str, format_=stray_scanner) -> Fault:
    return Fault(name, corrupt, check, refused=True, format_=format_)


def _limited(s: CaptureSession, first: int, last: int) -> CaptureSession:
    ok = np.ones(len(s.times), bool)
    ok[first:last] = False
    return replace(s, tracking_ok=ok, imu=None)


def _hot(s: CaptureSession) -> CaptureSession:
    return go.kept(s, np.concatenate([np.arange(300), np.arange(300, len(s.times), 2)]))


def _paced(s: CaptureSession, factor: float) -> CaptureSession:
    return go.timed(s, s.times[0] + (s.times - s.times[0]) * factor)


def _accel(s: CaptureSession, change) -> CaptureSession:
    assert s.imu is not None
    return go.with_imu(s, accel=change(s.imu.accel))


def _clock(s: CaptureSession, seconds: float) -> CaptureSession:
    assert s.imu is not None
    return go.with_imu(s, times=s.imu.times + seconds)


def _of_another_take(s: CaptureSession) -> CaptureSession:
    assert s.imu is not None
    return go.with_imu(s, accel=s.imu.accel[::-1].copy(), gyro=np.roll(s.imu.gyro, 417, 0)[:, ::-1])


def _no_gravity(s: CaptureSession) -> CaptureSession:
    """The user acceleration of Core Motion: gravity is taken out already."""
    assert s.imu is not None
    R = Slerp(s.times, Rotation.from_matrix(s.T_world_phone[:, :3, :3]))(
        s.imu.times.clip(s.times[0], s.times[-1])
    )
    return _accel(s, lambda a: a - R.inv().apply([0, -GRAVITY, 0]) @ R_CAMERA_DEVICE)


def _jumpy(s: CaptureSession) -> CaptureSession:
    for at in range(100, len(s.times), 100):
        s = go.jumped(s, (0.3, 0, 0), at=at)
    return s


def _wild(s: CaptureSession) -> CaptureSession:
    T = s.T_world_phone.copy()
    T[AT, :3, 3] += [0, 0.7, 0]
    return go.posed(s, T)


def _transposed(s: CaptureSession) -> CaptureSession:
    T = s.T_world_phone.copy()
    T[:, :3, :3] = T[:, :3, :3].transpose(0, 2, 1)
    return go.posed(s, T)


def _swapped(s: CaptureSession, order: list[int]) -> CaptureSession:
    return go.placed(s, lambda p: p[:, order])


IDENTITY = np.eye(4)
FAULTS = [
    *(
        splits(f"jump of {x} m", lambda s, x=x: go.jumped(s, (x, 0, 0)), "tracking jump")
        for x in (0.05, 0.2, 1.0, 3.0)
    ),
    *(
        splits(f"turn of {x} deg", lambda s, x=x: go.jumped(s, degrees=(0, x, 0)), "tracking jump")
        for x in (8, 30, 180)
    ),
    splits("jump up", lambda s: go.jumped(s, (0, 0.5, 0)), "tracking jump"),
    splits("one wild pose", _wild, "tracking jump"),
    refused("a jump every 1.7 s", _jumpy, "tracking jump"),
    *(
        splits(
            f"gap of {n} poses",
            lambda s, n=n: go.kept(s, np.r_[:AT, AT + n : len(s.times)]),
            "gap in the log",
        )
        for n in (10, 30, 120)
    ),
    splits("limited", lambda s: _limited(s, AT - 20, AT + 20), "limited tracking",
           format_=scan_capture),
    refused("limited throughout", lambda s: _limited(s, 0, 9999), "limited tracking",
            format_=scan_capture),
    splits("frozen in mid-air", lambda s: go.held(s, AT - 25, AT + 25), "frozen tracking"),
    splits("frozen start", lambda s: go.held(s, 0, 150), "frozen tracking", at=100),
    splits("frozen end", lambda s: go.held(s, 450, 679), "frozen tracking", at=500),
    splits("identity start", lambda s: go.held(s, 0, 150, IDENTITY), "frozen tracking", at=100),
    splits("identity within", lambda s: go.held(s, 300, 400, IDENTITY), "frozen tracking"),
    *(
        refused(f"{rate} poses a second", lambda s, r=rate: go.at_rate(s, r), "rate")
        for rate in (1.1, 2, 5, 10)
    ),
    *(
        warns(f"{rate} poses a second", lambda s, r=rate: go.at_rate(s, r), "rate")
        for rate in (15, 20, 120, 240)
    ),
    warns("60 falls to 30", _hot, "steady rate"),
    refused("stamps in ms", lambda s: go.timed(s, s.times * 1e3), "units"),
    refused("stamps count", lambda s: go.timed(s, np.arange(len(s.times)) * 1.0), "units"),
    refused("four times as fast", lambda s: _paced(go.without_imu(s), 0.25), "speed"),
    refused("twice as slow as its IMU", lambda s: _paced(s, 2.0), "turning"),
    warns("two seconds long", lambda s: go.kept(s, slice(60, 180)), "duration"),
    refused("never moves", lambda s: go.kept(s, slice(0, 90)), "path"),
    refused("never rests", lambda s: go.kept(s, slice(120, 540)), "floor"),
    warns("swung at 5 m/s", lambda s: go.shaken(s, 0.8, 1.0), "speed"),
    refused("shaken at 40 m/s^2", lambda s: go.shaken(s, 0.05, 4.5), "acceleration"),
    refused("spun at 700 deg/s", lambda s: go.shaken(s, 0, 1.0, 110), "rotation speed"),
    refused("world upside down", lambda s: go.turned_world(s, "z", 180), "gravity"),
    refused("world z up", lambda s: go.turned_world(s, "x", 90), "gravity"),
    refused("world y and z swapped", lambda s: go.turned_world(s, "x", -90), "gravity"),
    refused("world tilted by 20 deg", lambda s: go.turned_world(s, "x", 20), "gravity"),
    warns("world tilted by 8 deg", lambda s: go.turned_world(s, "x", 8), "gravity"),
    warns("tilts by 25 deg in the middle",
          lambda s: go.jumped(s, degrees=(25, 0, 0)), "gravity"),
    refused("camera of the portrait image", lambda s: go.turned_camera(s, "z", 90), "gravity"),
    refused("camera upside down", lambda s: go.turned_camera(s, "z", 180), "gravity"),
    refused("OpenCV's camera axes", lambda s: go.turned_camera(s, "x", 180), "gravity"),
    refused("world to camera", lambda s: go.posed(s, inverse(s.T_world_phone)), "gravity"),
    refused("quaternion w first", lambda s: go.order_of_quaternions(s, [3, 0, 1, 2]), "gravity"),
    refused("quaternion w first, read last",
            lambda s: go.order_of_quaternions(s, [1, 2, 3, 0]), "gravity"),
    refused("quaternion x and y swapped",
            lambda s: go.order_of_quaternions(s, [1, 0, 2, 3]), "gravity"),
    refused("quaternion conjugated",
            lambda s: go.order_of_quaternions(s, [0, 1, 2, 3], (-1, -1, -1, 1)), "gravity"),
    refused("rotations transposed, with IMU", _transposed, "gravity"),
    refused("rotations transposed, no IMU", _transposed, "standing", format_=arkit_data_logger),
    refused("mirrored in x", lambda s: go.mirrored(s, 0), "turning"),
    refused("mirrored in y", lambda s: go.mirrored(s, 1), "turning"),
    refused("mirrored in z", lambda s: go.mirrored(s, 2), "turning"),
    refused("positions mirrored in x", lambda s: go.placed(s, lambda p: p * [-1, 1, 1]), "moving"),
    refused("positions y and z swapped", lambda s: _swapped(s, [0, 2, 1]), "moving"),
    refused("positions x and y swapped", lambda s: _swapped(s, [1, 0, 2]), "moving"),
    refused("positions x and z swapped", lambda s: _swapped(s, [2, 1, 0]), "moving"),
    refused("positions in cm", lambda s: go.placed(s, lambda p: p * 100), "units"),
    refused("positions in mm", lambda s: go.placed(s, lambda p: p * 1000), "units"),
    refused("positions at a third", lambda s: go.placed(s, lambda p: p / 3), "scale"),
    warns("positions at 1.5", lambda s: go.placed(s, lambda p: p * 1.5), "scale"),
    refused("y and z swapped, no IMU", lambda s: _swapped(go.without_imu(s), [0, 2, 1]), "height"),
    refused("upside down, no IMU",
            lambda s: go.turned_world(go.without_imu(s), "z", 180), "floor"),
    refused("noise of 3 mm on a carry without rests",
            lambda s: go.noisy(go.kept(s, slice(120, 540)), 0.003, 0.3), "floor"),
    refused("accelerometer without gravity", _no_gravity, "gravity"),
    refused("accelerometer upside down", lambda s: _accel(s, lambda a: -a), "gravity"),
    refused("accelerometer's axes swapped", lambda s: _accel(s, lambda a: a[:, ::-1]), "moving"),
    warns("accelerometer of another unit", lambda s: _accel(s, lambda a: 0.5 * a), "gravity"),
    warns("IMU 0.3 s late", lambda s: _clock(s, 0.3), "clocks"),
    warns("IMU an hour apart", lambda s: _clock(s, 3600.0), "clocks"),
    refused("IMU of another take", _of_another_take, "turning"),
    warns("mount slipped by 10 deg", lambda s: go.slipped(s, 10, 0), "mount slip"),
    refused("mount slipped by 25 deg and 3 cm", lambda s: go.slipped(s, 25, 0.03), "standing"),
]  # fmt: skip


@pytest.fixture(scope="module")
def good() -> CaptureSession:
    return go.make_session()


@pytest.fixture
def take(tmp_path: Path, good: CaptureSession) -> Take:
    return go.make_take(tmp_path, good)


def _find(seen: Inspection, fault: Fault, log: int):
    """The check that tells; at the fault's place, where it has one."""
    found = [c for c in seen.report.checks if c.name == fault.check and c.severity != "ok"]
    assert found, [c for c in seen.report.checks if c.severity != "ok"]
    if fault.at is None:
        return found[0]
    placed = [c for c in found if c.frames is not None and c.frames[0] <= log < c.frames[1]]
    assert placed, found
    return placed[0]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_named_placed_and_told_how_to_mend(take: Take, fault: Fault):
    take.write(fault.corrupt(take.good), fault.format_)
    seen = take.inspect()
    check = _find(seen, fault, (fault.at or 0) - 1)
    assert check.severity == ("bad" if fault.refused else "warn")
    assert check.fix
    if fault.refused:
        with pytest.raises(InputError) as caught:
            refuse_bad(seen)
        assert check.name in caught.value.what.lower() or caught.value.code == "gravity-wrong"
        assert caught.value.where
        assert caught.value.fix
        assert seen.verdict == "not usable"
        return
    refuse_bad(seen)
    assert seen.verdict == "usable with limits"
    if fault.at is not None:
        assert seen.take is not None
        when = (seen.session.times[fault.at - 1] - seen.session.times[0]) * 30 + 0.5
        assert not any(start <= when < stop - 1 for start, stop in seen.take.segments)


@pytest.mark.parametrize("format_", [arkit_data_logger, tum], ids=lambda f: f.NAME)
def test_a_log_without_an_accelerometer_is_good_and_says_what_it_believes(take: Take, format_):
    take.write(go.without_imu(take.good), format_)
    seen = take.inspect()
    assert seen.verdict == "good", seen.report.of("warn") + seen.report.of("bad")
    assert seen.reason == ""
    told = {check.name: check.message for check in seen.report.checks}["gravity"]
    assert "no accelerometer" in told
    assert "believed" in told


@pytest.mark.parametrize("rate", [30, 60])
@pytest.mark.parametrize(("metres", "degrees"), [(0.001, 0.1), (0.002, 0.2), (0.003, 0.3)])
def test_rests_are_found_under_noise(take: Take, rate: int, metres: float, degrees: float):
    take.write(go.noisy(go.at_rate(take.good, rate), metres, degrees))
    seen = take.inspect()
    assert seen.take is not None
    assert seen.take.floor.source == "rest"
    take.write(take.good)
    quiet = take.inspect().take
    assert quiet is not None
    assert seen.take.floor.height == pytest.approx(quiet.floor.height, abs=0.004)
    found = find_rests(seen.take.motion.T_world_object, seen.take.motion.valid)
    assert sum(stop - start for start, stop in found) > 90  # of the 102 frames at rest
    assert seen.verdict != "not usable"


@pytest.mark.parametrize("format_", [stray_scanner, ios_logger], ids=lambda f: f.NAME)
@pytest.mark.parametrize("rate", [30, 60])
def test_the_good_take_is_good(take: Take, format_, rate: int):
    take.write(go.at_rate(take.good, rate), format_)
    seen = take.inspect()
    assert seen.verdict == "good", seen.report.of("warn") + seen.report.of("bad")
    assert seen.advice == ""
    refuse_bad(seen)


def test_turned_and_moved_takes_are_good_too(take: Take):
    """Heading and origin are the session's own."""
    for heading in (40, 130, 250):
        turned = go.turned_world(take.good, "y", heading)
        take.write(go.placed(turned, lambda p: p + Rotation.random(rng=0).apply([3.0, 1, 2])))
        assert take.inspect().verdict == "good"


def test_force_uses_a_bad_take_but_none_without_a_motion(take: Take):
    take.write(go.placed(take.good, lambda p: p / 3))
    seen = take.inspect()
    with pytest.raises(InputError, match="Scale") as caught:
        usable_take(seen)
    assert "‹force›" in caught.value.fix
    assert usable_take(seen, force=True) is seen.take
    for hopeless in (go.timed(take.good, take.good.times * 1e3), go.at_rate(take.good, 5)):
        take.write(hopeless)
        with pytest.raises(InputError) as caught:
            usable_take(take.inspect(), force=True)
        assert "‹force›" not in caught.value.fix


def test_there_is_a_table_to_speak_of():
    assert len(FAULTS) >= 72
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)
