"""A take for the tests of formats."""

import pytest

from tests.ingest.formats.logs import MakeTake


@pytest.fixture(scope="session")
def take(wander) -> MakeTake:
    """A take that is long enough and no longer: 37 poses, 30 a second."""
    return lambda seed: wander(seed, seconds=1.2, rate=30.0)
