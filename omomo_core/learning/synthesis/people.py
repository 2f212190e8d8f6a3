"""The people of the synthesis: as many as the release has, each of a stature of their own."""

_OURS = 1.72
STATURES = {
    1: 1.67, 2: 1.82, 3: 1.55, 4: 1.72, 5: 1.77, 6: 1.61, 7: 1.91, 8: 1.68, 9: 1.73,
    10: 1.58, 11: 1.85, 12: 1.70, 13: 1.49, 14: 1.75, 15: 1.65, 16: 1.63, 17: 1.79,
}  # fmt: skip
"""Metres: the 17 quantiles of adults of both sexes (mean 1.70, deviation 0.11), in no order."""


def our_scale(person: int) -> float:
    """Our stature over that of a person: props are scaled by it."""
    return _OURS / STATURES[person]
