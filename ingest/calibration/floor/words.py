"""Sentences that say which directions of a mount the floor determines, and which it leaves open."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from ingest.calibration.floor.level import FloorLevel
from ingest.calibration.floor.noise import placed, tangent
from ingest.calibration.floor.standing import StandingContact
from ingest.calibration.observable import OPEN_M, TILT_IT, open_directions
from ingest.calibration.posterior import Posterior
from ingest.mount import Mount
from ingest.uncertainty import skew

_SURER = 0.7
"""Part of its earlier standard deviation that a direction must come down to, to be told as fixed."""
_SOURCES = {
    "given": "the floor's height as given",
    "tape": "the phone's height over the floor",
    "depth": "the floor in the depth maps",
    "unknown": "rests on several sides",
}


def what_is_open(best: Posterior, standings: Sequence[StandingContact]) -> tuple[str, ...]:
    """The directions that are as good as unknown still."""
    first = standings[0]
    one_side = all(standing.side is first.side for standing in standings)
    vertical = first.contact.down if one_side else None
    return tuple(direction.words for direction in open_directions(best.covariance, vertical))


def what_was_fixed(
    mount: Mount,
    prior: Mount,
    best: Posterior,
    standings: Sequence[StandingContact],
    level: FloorLevel,
) -> str:
    """Which of tilt, heading, height and place are surer now, by how much, and from what."""
    assert prior.covariance is not None
    parts: list[str] = []
    for name, J in _directions(best.T, standings[0]).items():
        turn = name in ("tilt", "heading")
        scale, unit = (180 / np.pi, "deg") if turn else (1e3, "mm")
        before, now = (
            scale * float(np.sqrt(np.linalg.eigvalsh(J @ C @ J.T).max()))
            for C in (prior.covariance, best.covariance)
        )
        if now < _SURER * before:
            parts.append(f"the {name} to {now:.2g} {unit} (before {before:.2g})")
    rests = sum(standing.contact.kind == "rest" for standing in standings)
    pushes, sides = len(standings) - rests, len({id(standing.side) for standing in standings})
    seen = f"{_count(rests, 'rest')} and {_count(pushes, 'push')} on {_count(sides, 'side')}"
    found_text = f"The floor fixed {', '.join(parts)}" if parts else "The floor told nothing new"
    words = [f"{found_text}, each one standard deviation, from {seen}."]
    if any("height" in part for part in parts):
        words.append(f"The height comes from {_SOURCES[level.source]}.")
    elif _height_sd(best, standings[0]) > OPEN_M:
        words.append(f"{TILT_IT} Here a tape does it: --phone-height.")
    if mount.covariance is None:
        words.append(
            "The mount did not say how sure it was: 5 deg and 50 mm on each axis were assumed."
        )
    high = [standing.contact.when for standing in standings if not standing.on_floor]
    if high:
        words.append(f"Not taken for the floor, because it is higher: {', '.join(high[:3])}.")
    return " ".join(words)


def _directions(
    T_phone_object: Float64[np.ndarray, "4 4"], standing: StandingContact
) -> dict[str, Float64[np.ndarray, "n 6"]]:
    """Matrix that maps the mount's error to that of tilt and heading (rad), height and feet (m)."""
    down, across = standing.contact.down, tangent(standing.contact.down).T
    turn, none = np.eye(3), np.zeros((3, 3))
    feet = np.concatenate(
        [-skew(placed(T_phone_object, standing) - T_phone_object[:3, 3]), turn], 1
    )
    turned = np.concatenate([turn, none], axis=1)
    return {
        "tilt": across @ turned,
        "heading": down[None] @ turned,
        "height": down[None] @ feet,
        "horizontal place": across @ feet,
    }


def _height_sd(best: Posterior, standing: StandingContact) -> float:
    J = _directions(best.T, standing)["height"]
    return float(np.sqrt((J @ best.covariance @ J.T).item()))


def _count(n: int, word: str) -> str:
    return f"{n} {word}{'' if n == 1 else 'es' if word.endswith('sh') else 's'}"
