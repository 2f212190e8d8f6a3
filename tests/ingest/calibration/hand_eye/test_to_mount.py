"""From two streams to a mount: the body's place on the object, slips between the halves."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.hand_eye.hand_eye import solve
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.calibration.hand_eye.to_mount import calibrate_by_motion
from ingest.uncertainty import between
from omomo_core.errors import InputError
from tests.ingest.calibration.hand_eye.two_trackers import two_trackers

NONE = np.zeros((6, 6))


def _body() -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [0.3, -0.2, 1.0]).as_matrix()
    T[:3, 3] = [0.1, -0.3, 0.25]
    return T


def test_the_mount_is_that_of_the_object_not_of_the_body_on_it():
    take = two_trackers(1)
    mount = calibrate_by_motion(take.phone, take.target, _body(), NONE, "tracker")
    truth = take.T_phone_target @ _body()
    step = between(mount.T_phone_object, truth)
    assert mount.covariance is not None
    assert step @ np.linalg.solve(mount.covariance, step) < chi2.ppf(0.999, 6)
    assert np.linalg.norm(step[3:]) < 0.005
    assert mount.method == "tracker"
    assert mount.residuals["clock offset_s"] == pytest.approx(take.offset, abs=0.005)


def test_the_mount_says_the_drift_and_what_is_left_with_the_world_held_still():
    take = two_trackers(1, drift=0.01)
    told = calibrate_by_motion(take.phone, take.target, _body(), NONE, "tracker").residuals
    found = solve(take.phone, take.target)
    assert told["drift taken out_m"] == pytest.approx(found.drift.metres, abs=1e-4)
    assert told["drift per metre walked_mm"] == pytest.approx(1e3 * found.drift.per_metre, abs=0.01)
    assert told["rms_mm"] < told["world held still_mm"] == pytest.approx(found.rest_mm, abs=1e-3)
    assert (
        told["rms_deg"] <= told["world held still_deg"] == pytest.approx(found.rest_deg, abs=1e-4)
    )


def test_how_sure_the_bodys_place_is_counts():
    take = two_trackers(1)
    sure = calibrate_by_motion(take.phone, take.target, _body(), NONE, "board")
    place = np.diag([0.01] * 3 + [0.004] * 3) ** 2
    unsure = calibrate_by_motion(take.phone, take.target, _body(), place, "board")
    assert sure.covariance is not None
    assert unsure.covariance is not None
    more = unsure.covariance - sure.covariance
    np.testing.assert_allclose(np.linalg.eigvalsh(more), np.sort(np.diag(place)), rtol=1e-6)


def test_a_clamp_that_gives_way_half_way_is_noticed():
    take = two_trackers(2, seconds=30)
    middle = np.median(take.target.times)
    slipped = take.target.T.copy()
    slip = np.eye(4)
    slip[:3, :3] = Rotation.from_euler("x", 4, degrees=True).as_matrix()
    slip[:3, 3] = [0, 0.02, 0]
    later = take.target.times > middle
    slipped[later] = slipped[later] @ slip
    target = PoseStream(take.target.times, slipped, take.target.covariance)
    with pytest.raises(InputError) as caught:
        calibrate_by_motion(take.phone, target, _body(), NONE, "tracker")
    assert caught.value.code in ("mount-slipped", "calibration-apart")


def test_one_that_holds_is_not_called_slipped():
    for seed in range(6):
        take = two_trackers(seed, seconds=24)
        calibrate_by_motion(take.phone, take.target, _body(), NONE, "tracker")
