"""A clamp that gives way: between two calibrations, and between two rests of a take."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import carried_box, clamped_phone
from capture_app.simulator.simulated_phone import simulate
from ingest.calibration.still import refuse_slip, slip_between
from ingest.mount import Mount
from ingest.report.checked_session import CheckedSession
from ingest.report.stance import object_checks
from ingest.report.take_report import Check
from ingest.trajectory.object_motion import to_object_motion
from ingest.uncertainty import moved
from omomo_core.errors import InputError
from tests.ingest.calibration.floor_takes import Stand, clamped, crate, recorded, standing_motion
from tests.simulator.gravity_error import unlevel
from tests.simulator.slipping import slipping

SURE = np.diag([np.radians(0.4) ** 2] * 3 + [0.004**2] * 3)


def test_between_two_calibrations_only_what_is_beyond_their_errors_is_a_slip():
    rng = np.random.default_rng(0)
    truth = clamped(rng).T_phone_object
    slipped = moved(truth, np.array([np.radians(4), 0, 0, 0.0, 0.02, 0]))
    cried = noticed = 0
    for _ in range(200):
        errors = rng.multivariate_normal(np.zeros(6), SURE, 3)
        first, held, moved_on = (
            Mount(moved(T, e), "x", SURE)
            for T, e in zip((truth, truth, slipped), errors, strict=True)
        )
        cried += slip_between(first, held) is not None
        found = slip_between(first, moved_on)
        noticed += found is not None
        if found is not None:
            assert 2 < found.deg < 6.5
            assert found.p < 0.001
    assert cried <= 2
    assert noticed >= 195


def test_a_direction_that_is_open_shows_no_slip():
    rng = np.random.default_rng(1)
    truth = clamped(rng).T_phone_object
    up = np.eye(6)[4]
    first = Mount(truth, "start", SURE + 0.3**2 * np.outer(up, up))
    along, across = (Mount(moved(truth, 0.1 * np.eye(6)[k]), "end", SURE) for k in (4, 3))
    assert slip_between(first, along) is None
    assert slip_between(first, across) is not None
    with pytest.raises(InputError, match=r"slipped during the take: by 100 mm") as caught:
        refuse_slip(first, across)
    assert caught.value.code == "mount-slipped"
    refuse_slip(first, along)
    with pytest.raises(InputError, match="does not say how sure"):
        slip_between(first, replace(along, covariance=None))


def _checked(degrees: float, axis: tuple[float, float, float], at: float, seed: int) -> Check:
    """The check of a take of the carried box whose clamp gives way, turning about a box axis."""
    motion, mount = carried_box(), clamped_phone()
    T = mount.T_phone_object.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(np.radians(degrees) * np.array(axis)).as_matrix()
    seen = slipping(motion, mount, replace(mount, T_phone_object=T), at)
    session = unlevel(simulate(seen, mount, seed=seed), seed=seed)
    take = to_object_motion(session, motion.mesh, mount)
    check = object_checks(CheckedSession(session, motion.mesh, mount, take))[-1]
    assert check.name == "mount slip"
    return check


@pytest.mark.parametrize(("degrees", "at"), [(5, 5.0), (8, 6.5), (12, 8.0), (30, 4.0)])
def test_a_slip_in_mid_air_is_noticed_and_timed(degrees: float, at: float):
    for seed in range(2):
        check = _checked(degrees, (0.6, 0.8, 0.0), at, seed)
        assert check.severity == "warn"
        told = float(check.message.split("differs by ")[1].split()[0])
        assert told == pytest.approx(degrees, abs=2.0)
        moment = float(check.message.split("at about ")[1].split()[0])
        assert moment == pytest.approx(at + 0.15, abs=0.4)
        assert "clamp" in check.fix


def test_a_clamp_that_holds_is_not_suspected_whatever_gravity_does():
    assert [_checked(0, (1, 0, 0), 5.0, seed).severity for seed in range(12)] == ["ok"] * 12


def test_a_turn_about_the_vertical_does_not_show():
    assert _checked(20, (0, 0, 1), 5.0, 0).severity == "ok"


def _stands_checked(stands: list[Stand], lift: float = 0.0) -> Check:
    """Of a crate that stands here and there, its phone sliding down by `lift` after the first rest."""
    motion, mount = standing_motion(crate(), stands), clamped(np.random.default_rng(2))
    down = moved(mount.T_phone_object, np.zeros(6))
    down[:3, 3] += mount.T_phone_object[:3, 2] * lift
    seen = slipping(motion, mount, replace(mount, T_phone_object=down), at=1.6)
    session = recorded(seen, mount, seed=0)
    take = to_object_motion(session, motion.mesh, mount)
    return object_checks(CheckedSession(session, motion.mesh, mount, take))[-1]


def test_a_slide_along_the_vertical_shows_where_the_object_comes_back():
    there = [Stand((0, 0), 0.0), Stand((0.2, 0), 0.3)]
    assert _stands_checked(there).severity == "ok"
    check = _stands_checked(there, lift=0.05)
    assert check.severity == "warn"
    assert "lowest point is" in check.message
    assert "equally high" in check.fix


def test_rests_are_compared_with_the_last_one_on_the_same_side():
    on_its_side = Rotation.from_euler("x", 90, degrees=True)
    alone = [Stand((0, 0), 0.0), Stand((0.5, 0), 0.3, on_its_side)]
    assert "only once" in _stands_checked(alone).message
    check = _stands_checked([*alone, Stand((0, 0.5), 2.0)])
    assert check.severity == "ok"
    assert "would show" in check.message
