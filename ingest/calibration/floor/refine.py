"""refine: a mount is corrected by the object's own contact with the floor."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64
from scipy.stats import chi2

from ingest.calibration.difference import DISAGREE, FINEST
from ingest.calibration.floor.contacts import find_contacts, track
from ingest.calibration.floor.level import FloorLevel, floor_level
from ingest.calibration.floor.noise import contact_covariance, placed, tangent
from ingest.calibration.floor.sides import flat_sides
from ingest.calibration.floor.standing import StandingContact, standings
from ingest.calibration.floor.words import what_is_open, what_was_fixed
from ingest.calibration.posterior import Misfit, Posterior, belief, joined, posterior, whitener
from ingest.mount import Mount, object_id
from ingest.session import CaptureSession
from ingest.uncertainty import between, bounds_95, skew
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

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
    """Of `errors`."""

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
        InputError: "floor-contradicts-mount", and those of `ingest.calibration.floor.contacts.track`,
            `ingest.calibration.floor.standing.standings` and `ingest.calibration.floor.level.floor_level`.
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
    chances = [chi2.sf(far, int(known.sum())) if known.any() else 1.0]
    chances.append(chi2.sf(best.cost, len(problem.covariance)))
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
