"""How people go down: stooping over straight legs, squatting, sitting on the heels."""

import numpy as np
import pytest

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import load_body
from omomo_core.learning.synthesis.actor import Torso, bent, manner

BODY = load_body()
STANDING = (
    np.array([[0.0, 0.0, 0.92]]),
    np.tile(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]).T, (1, 22, 1, 1)),
)


def down(squat: float, amount: float) -> np.ndarray:
    """Joints of somebody who was standing."""
    still = np.zeros(1)
    torso = Torso(still, manner(np.array([squat])), still, still)
    return joints_of(BODY, *bent(BODY, *STANDING, np.array([amount]), torso))[0]


def test_who_squats_goes_lower_and_stays_more_upright():
    stoop, squat, sit = (down(style, 1.0) for style in (0.0, 1.0, 2.0))
    hips = [j[[1, 2], 2].mean() for j in (stoop, squat, sit)]
    assert hips[0] > hips[1] > hips[2]
    trunk = [j[12] - j[0] for j in (stoop, squat, sit)]
    leans = [np.degrees(np.arctan2(np.linalg.norm(t[:2]), t[2])) for t in trunk]
    assert leans[0] > 75.0
    assert leans[0] > leans[1] > leans[2] > 15.0


@pytest.mark.parametrize("squat", [1.0, 1.5, 2.0])
def test_nobody_sits_lower_than_on_the_heels(squat: float):
    assert down(squat, 1.2)[[1, 2], 2].mean() > 0.2


def test_arms_hang_from_those_who_stoop_only():
    assert manner(np.array([0.0, 0.5, 1.0, 2.0])).hang.tolist() == [1.0, 0.5, 0.0, 0.0]
