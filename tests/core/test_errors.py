"""Errors say what is wrong wherever they are raised."""

import pickle

from omomo_core.errors import InputError


def test_an_error_of_a_worker_process_arrives_whole():
    """What cannot be unpickled breaks the pool, and nobody learns what was wrong."""
    problem = InputError("clip-short", "It is short.", where="a.npz", fix="Take another.")
    arrived = pickle.loads(pickle.dumps(problem))
    assert type(arrived) is InputError
    assert (str(arrived), arrived.code) == (str(problem), "clip-short")
