"""The paper's rule: a hand that touches stays."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.geometry.transforms import to_local
from omomo_core.stages.hands_paper import constrain
from omomo_core.stages.stage_config import CONTACT_RULE
from tests.core.contact.box import FRAMES, MESH, carried


@given(seed=st.integers(0, 500), first=st.integers(1, FRAMES - 2))
@settings(max_examples=25)
def test_paper_rule_holds_from_the_first_touch_to_the_end(seed: int, first: int):
    T = carried(seed)
    palms = np.random.default_rng(seed).normal(size=(FRAMES, 2, 3)) + 5.0
    palms[first, 0] = T[first, :3, :3] @ (MESH.vertices[0] * 1.01) + T[first, :3, 3]
    out = constrain(palms, MESH.vertices, T)
    np.testing.assert_array_equal(out.palms[:first], palms[:first])
    np.testing.assert_array_equal(out.palms[:, 1], palms[:, 1])
    local = to_local(T, out.palms)[first:, 0]
    np.testing.assert_allclose(local, np.tile(local[0], (len(local), 1)), atol=1e-9)
    assert out.contact[:, 0].tolist() == [float(f >= first) for f in range(FRAMES)]
    assert CONTACT_RULE.touch == 0.03
