"""How long a scan will take is said before it starts."""

import pytest

from capture_app.scanning.scan_folder import estimate_seconds, in_words


def test_more_pictures_take_longer_and_a_draft_is_short(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    assert estimate_seconds(40, draft=False) < estimate_seconds(80, draft=False) < 6 * 60
    assert estimate_seconds(80, draft=True) < 60


@pytest.mark.parametrize(("seconds", "words"), [(4.0, "10 s"), (34.0, "30 s"), (130.0, "2 min")])
def test_lengths_of_time_are_said_in_round_numbers(seconds, words):
    assert in_words(seconds) == words
