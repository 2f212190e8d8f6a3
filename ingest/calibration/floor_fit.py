"""Method floor: the mount's tilt and height refined by rests on the floor."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from ingest.calibration.combine import DISAGREE, FINEST
from ingest.calibration.floor_contacts import (
    FloorLevel,
    StandingContact,
    find_contacts,
    flat_sides,
    floor_level,
    standings,
    track,
)
from ingest.calibration.posterior import (
    OPEN_M,
    TILT_IT,
    Misfit,
    Posterior,
    belief,
    joined,
    open_directions,
    posterior,
    whitener,
)
from ingest.distributions import chi2_tail
from ingest.mount import Mount, object_id
from ingest.session import CaptureSession
from ingest.uncertainty import between, bounds_95, skew
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_GRAVITY = np.radians(0.4)
"""Error of ARKit's gravity over a whole session, on each axis; phones differ by 0.3 to 1 deg."""
_CONTACT_TILT = np.radians(0.3)
"""From one contact to the next: gravity wanders, floors are not flat."""
_CONTACT_HEIGHT = 0.002
_MESH_HEIGHT = 0.003
"""Metres that a side of the mesh is off."""
_DRIFT = 0.004
"""Metres of height per metre that the phone has gone in the take."""


def tangent(direction: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 2"]:
    """Two unit vectors square to a unit vector and to each other."""
    return np.linalg.svd(direction[None])[2][1:].T


def contact_covariance(
    standings: Sequence[StandingContact],
    level: FloorLevel,
    T_phone_object: Float64[np.ndarray, "4 4"],
) -> Float64[np.ndarray, "n n"]:
    """Covariance of the residuals of `ingest.calibration.floor_fit`: two tilts each, then all heights.

    What several contacts share (the session's gravity, a side of the mesh, drift) makes them err
    alike, so that a hundred contacts are not ten times as sure as one.
    """
    low = [k for k, standing in enumerate(standings) if standing.on_floor]
    bases = [tangent(standing.contact.down) for standing in standings]
    gravity, own = _gravity(standings, bases, low, level, T_phone_object)
    sources = [
        _GRAVITY * gravity,
        _CONTACT_TILT * own,
        _sides(standings, bases, low, T_phone_object),
        _heights(standings, low, level),
    ]
    A = np.concatenate(sources, axis=1)
    return A @ A.T


def _gravity(
    standings: Sequence[StandingContact],
    bases: list[Float64[np.ndarray, "3 2"]],
    low: list[int],
    level: FloorLevel,
    T_phone_object: Float64[np.ndarray, "4 4"],
) -> tuple[Float64[np.ndarray, "n 2"], Float64[np.ndarray, "n own"]]:
    """What 1 rad of the session's gravity does, and what one of each contact's own does."""
    sways = [standing.contact.sway for standing in standings]
    feet = [placed(T_phone_object, standings[k]) for k in low]
    # A world that is tilted also rises from where the floor's height is known to the contact.
    rises = [standings[k].contact.place[:2] - level.place for k in low]
    tilts = [base.T @ sway for base, sway in zip(bases, sways, strict=True)]
    heights = [foot @ sways[k] + rise for foot, k, rise in zip(feet, low, rises, strict=True)]
    alone = np.zeros((len(low), 2 * len(standings)))
    for row, k in enumerate(low):
        alone[row, 2 * k : 2 * k + 2] = feet[row] @ bases[k]
    return np.vstack([*tilts, *heights]), np.vstack([np.eye(2 * len(standings)), alone])


def placed(
    T_phone_object: Float64[np.ndarray, "4 4"], standing: StandingContact
) -> Float64[np.ndarray, "3"]:
    """Return the plane of the side on the floor, in the phone's frame."""
    return T_phone_object[:3, :3] @ standing.side.centre + T_phone_object[:3, 3]


def _sides(
    standings: Sequence[StandingContact],
    bases: list[Float64[np.ndarray, "3 2"]],
    low: list[int],
    T_phone_object: Float64[np.ndarray, "4 4"],
) -> Float64[np.ndarray, "n sources"]:
    """What errors of the mesh do: each side is tilted and moved as one."""
    columns: list[np.ndarray] = []
    for side in {id(standing.side): standing.side for standing in standings}.values():
        turned = side.sd * T_phone_object[:3, :3] @ tangent(side.down)
        own = [float(standing.side is side) for standing in standings]
        tilts = [on * base.T @ turned for base, on in zip(bases, own, strict=True)]
        columns.append(np.vstack([*tilts, np.zeros((len(low), 2))]))
        moved = [_MESH_HEIGHT * own[k] for k in low]
        columns.append(np.concatenate([np.zeros(2 * len(own)), moved])[:, None])
    return np.concatenate(columns, axis=1)


def _heights(
    standings: Sequence[StandingContact], low: list[int], level: FloorLevel
) -> Float64[np.ndarray, "n sources"]:
    """What errors of heights do: each its own, all that of the floor, and drift along the path."""
    paths = np.array([standings[k].contact.path for k in low])
    stops = np.unique([*paths, level.path])
    walked = _DRIFT * np.sqrt(np.diff(stops) * stops[-1])
    first, last = np.minimum(paths, level.path), np.maximum(paths, level.path)
    between = (first[:, None] <= stops[:-1]) & (stops[1:] <= last[:, None])
    errors = [
        _CONTACT_HEIGHT * np.eye(len(low)),
        np.full((len(low), 1), level.sd),
        between * walked,
    ]
    heights = np.concatenate(errors, axis=1)
    return np.vstack([np.zeros((2 * len(standings), heights.shape[1])), heights])


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
        words.append(f"{TILT_IT} Here a tape does it: ‹phone_height›.")
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


WEAK = np.diag([np.radians(5.0) ** 2] * 3 + [0.05**2] * 3)
"""What is believed of a mount that does not say how sure it is."""
_INFORMED = 0.05
"""Part of a prior's variance that must go for a direction to count as told by the floor."""


@dataclass(frozen=True)
class FloorProblem:
    """Least squares for the mount from contacts with the floor, with the prior mount."""

    prior: Mount
    """With a covariance."""
    standings: Sequence[StandingContact]
    level: FloorLevel
    covariance: Float64[np.ndarray, "n n"]
    """Covariance of `errors`."""

    def errors(self, T: Float64[np.ndarray, "4 4"]) -> Float64[np.ndarray, " n"]:
        """Tilt (rad, two each) of every contact, and height (m) of those on the floor, that are left.

        Args:
            T: T_phone_object.
        """
        tilts = [
            tangent(contact.down).T @ (T[:3, :3] @ side.down - contact.down)
            for contact, side, _ in self.standings
        ]
        heights = [
            s.contact.height - s.contact.down @ placed(T, s) - self.level.height
            for s in self.standings
            if s.on_floor
        ]
        return np.concatenate([*tilts, heights])

    def jacobian(self, T: Float64[np.ndarray, "4 4"]) -> Float64[np.ndarray, "n 6"]:
        """Jacobian of `errors` by a step of `ingest.uncertainty.moved`."""
        none = np.zeros((2, 3))
        tilts = [
            np.hstack([-tangent(contact.down).T @ skew(T[:3, :3] @ side.down), none])
            for contact, side, _ in self.standings
        ]
        heights = [
            s.contact.down @ np.hstack([skew(T[:3, :3] @ s.side.centre), -np.eye(3)])[None]
            for s in self.standings
            if s.on_floor
        ]
        return np.concatenate([*tilts, *heights])


def refine(
    mount: Mount,
    session: CaptureSession,
    mesh: ObjectMesh,
    *,
    phone_height: float | None = None,
    floor: float | None = None,
) -> Mount:
    """The mount that fits both its own covariance and the floor under the object.

    Where the object stands, gravity tells two of the mount's three turns and, if the floor's height
    is known, the object's height. On another side it tells the others. What the floor cannot tell
    stays as the mount had it.

    Args:
        mount: of the same clamping; without a covariance, `WEAK` is taken for it.
        session: a take in which the object rests on the floor, or is pushed over it.
        mesh: of the object, metres: the mount's `object_scale` is in it already.
        phone_height: metres of the lens over the floor where the object first rests.
        floor: the floor's height in the session's world, metres.

    Raises:
        InputError: "floor-contradicts-mount", and those of `ingest.calibration.floor_contacts.track`,
            `ingest.calibration.floor_contacts.standings` and `ingest.calibration.floor_contacts.floor_level`.
    """
    where = str(session.source)
    prior = mount if mount.covariance is not None else replace(mount, covariance=WEAK)
    seen = track(session)
    found = standings(find_contacts(seen), flat_sides(mesh), prior, where)
    level = floor_level(session, seen, [s.contact for s in found], phone_height, floor)
    covariance = contact_covariance(found, level, prior.T_phone_object)
    problem = FloorProblem(prior, found, level, covariance)
    best = solve(problem)
    check_plausible(problem, best, where)
    return _told(mount, mesh, problem, best)


def solve(problem: FloorProblem) -> Posterior:
    """The most likely mount, given the prior and the contacts."""
    prior = problem.prior
    assert prior.covariance is not None
    before = belief(prior.T_phone_object, prior.covariance + FINEST)
    W = whitener(problem.covariance)

    def misfit(T: Float64[np.ndarray, "4 4"]) -> Misfit:
        return joined(before(T), Misfit(W @ problem.errors(T), W @ problem.jacobian(T)))

    return posterior(misfit, prior.T_phone_object)


def check_plausible(problem: FloorProblem, best: Posterior, where: str) -> None:
    """Refuse a step that the prior rules out, and contacts that do not fit together.

    Raises:
        InputError: "floor-contradicts-mount".
    """
    prior = problem.prior
    assert prior.covariance is not None
    W = whitener(prior.covariance + FINEST)
    step = between(prior.T_phone_object, best.T)
    # In the prior's own units: what share of each direction the floor has told, and its step there.
    shares, axes = np.linalg.eigh(np.eye(6) - W @ best.covariance @ W.T)
    moved = axes.T @ W @ step
    known = shares > _INFORMED
    far = float((moved[known] ** 2 / shares[known]).sum())
    chances = [chi2_tail(far, int(known.sum())) if known.any() else 1.0]
    chances.append(chi2_tail(best.cost, len(problem.covariance)))
    if 2 * min(chances) > DISAGREE:
        return
    bounds = bounds_95(prior.covariance)
    raise InputError(
        "floor-contradicts-mount",
        f"The floor contradicts the mount: it would turn it by "
        f"{np.degrees(np.linalg.norm(step[:3])):.1f} deg and move it by "
        f"{1e3 * np.linalg.norm(step[3:]):.0f} mm, and the mount claims to be right within "
        f"{bounds.deg:.1f} deg and {bounds.mm:.0f} mm (95 %). Honest errors come to that in fewer "
        f"than 1 of {1 / DISAGREE:,.0f} cases.",
        where=where,
        fix="Check that the object stood on its own feet on the bare floor, that the floor's height "
        "is right, and that the mesh and the clamp are as they were; then calibrate the mount again.",
    )


def _told(mount: Mount, mesh: ObjectMesh, problem: FloorProblem, best: Posterior) -> Mount:
    """The refined mount with what there is to say about it."""
    n = 2 * len(problem.standings)
    errors = problem.errors(best.T)
    residuals = {"floor_tilt_deg": float(np.degrees(np.sqrt(2 * (errors[:n] ** 2).mean())))}
    if problem.level.source != "unknown" and len(errors) > n:
        residuals["floor_height_mm"] = 1e3 * float(np.sqrt((errors[n:] ** 2).mean()))
    return replace(
        mount,
        T_phone_object=best.T,
        covariance=best.covariance,
        method=f"{mount.method}, refined by the floor",
        residuals={**mount.residuals, **residuals},
        free=what_is_open(best, problem.standings),
        note=what_was_fixed(mount, problem.prior, best, problem.standings, problem.level),
        object_id=mount.object_id or object_id(mesh, mount.object_scale),
        picture="",
    )
