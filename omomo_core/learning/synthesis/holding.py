"""How the holds of one episode follow each other."""

from omomo_core.learning.synthesis.action_plan import Episode, Span
from omomo_core.learning.synthesis.holds import Hold

_OFF_REACH = 10
"""Frames a hand takes to come off and to come back."""


def holds_of(episode: Episode, span: Span) -> list[Hold]:
    """Every palm's contacts in one episode.

    Args:
        episode: which grasp, which hands, and whether one lets go for a while.
        span: frames with the prop in the hands.
    """
    first, last = span
    grasp = episode.grasp
    holds: list[Hold] = []
    for hand, used in enumerate(episode.hands):
        if not used:
            continue
        late = episode.late[hand]
        begin, end = first + late * episode.takes, last - late * episode.leaves
        reach = (episode.reach + late // 2) * episode.takes
        release = (episode.release + late // 2) * episode.leaves
        place = (grasp.points[hand], grasp.inward[hand], grasp.fingers)
        gone = episode.off
        if gone is None or hand != free_hand(episode) or not _fits(gone, begin, end):
            holds.append(Hold(hand, begin, end, *place, reach, release))
            continue
        leave, back = begin + gone[0], begin + gone[0] + gone[1]
        holds.append(Hold(hand, begin, leave, *place, reach, _OFF_REACH))
        holds.append(Hold(hand, back, end, *place, _OFF_REACH, release))
    return holds


def both_come(episode: Episode, span: Span) -> bool:
    """Whether the later hand arrives before it has to leave, in the frames with the prop in the hands."""
    first, last = span
    return first + max(episode.late) * (episode.takes + episode.leaves) < last


def free_hand(episode: Episode) -> int:
    """The hand that lets go where one does."""
    return int(episode.late[0] > episode.late[1])


def _fits(off: Span, begin: int, end: int) -> bool:
    return begin + sum(off) + 10 < end
