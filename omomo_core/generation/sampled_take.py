"""A take of which all K people are sampled and none is solved: which one to solve first, and solving one.

Solving costs far more than sampling, and of K people one is shown. So a take is sampled as a whole, and a
person is solved when somebody wants to see them.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets, penetration_depth
from omomo_core.compute import torch_threads
from omomo_core.generation.decoding import finish_people, interaction_targets
from omomo_core.generation.generation_config import RECORDED
from omomo_core.generation.generation_options import SolvedPrefix
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.person import GrowingPerson, Person, join, shift_spans, stretch
from omomo_core.generation.sample_chunks import SampledChunk
from omomo_core.generation.solving.bodies import SolvedBodies, continue_hands, solve_bodies
from omomo_core.generation.solving.solving_config import BODY_SOLVING
from omomo_core.motion import HumanMotion
from omomo_core.skeleton import FINGER_JOINTS
from omomo_core.system import give_back_memory, one_blas_thread

DEPTH_STRIDE = 2
"""The penetration depth of people who are not solved is measured in one frame of so many."""


@dataclass(frozen=True)
class SampledTake:
    """K people of a take as they are sampled, with all that solving needs."""

    chunks: Sequence[SampledChunk]
    """In the order of time; each begins with frames of the one before."""
    object_model: ObjectModel
    body: BodyModel
    folder: Path | None = None
    """Folder in which the arrays of people lie, in files without names; None for memory."""

    @property
    def samples(self) -> int:
        """How many people there are."""
        return len(self.chunks[0].hands)

    @property
    def must_hold(self) -> Bool[np.ndarray, " frames"]:
        """Frames in which somebody must hold the object."""
        return np.concatenate([s.clip.must_hold[_own(s)] for s in self.chunks])

    def as_sampled(self, k: int) -> Person:
        """Return a person who is not solved: palms may miss the object, and fingers are straight."""
        made = (_as_sampled(s, k, self.object_model, self.body) for s in self.chunks)
        return join(made, self.folder)

    def solve(self, k: int, progress: Callable[[float], None] = lambda done: None) -> Person:
        """Return a person, solved; the same whenever and in whichever order people are asked for.

        With two threads, bodies of a chunk are solved while hands of the one before are laid.

        Args:
            k: index of the sample.
            progress: called with the fraction done.
        """
        beside = torch.get_num_threads() > 1
        with one_blas_thread(), torch_threads(1), ThreadPoolExecutor(1) as pool:
            return _solved(self, k, pool if beside else None, progress)


def _own(sample: SampledChunk) -> slice:
    """Return the frames that a chunk yields."""
    return slice(sample.chunk.prefix_frames, sample.chunk.stop)


@torch.inference_mode()
def _as_sampled(sample: SampledChunk, k: int, object_model: ObjectModel, body: BodyModel) -> Person:
    own, hands = _own(sample), sample.hands[k]
    root, R = (x[k, own].double() for x in (sample.bodies.root, sample.bodies.rotations))
    joints = forward_kinematics(body, root, R).numpy()
    T = torch.from_numpy(sample.clip.take.motion.T_world_object[own][::DEPTH_STRIDE])
    thinned = (root[None, ::DEPTH_STRIDE], R[None, ::DEPTH_STRIDE])
    depth = penetration_depth(body, *thinned, T, object_model.obstacle)[0].double().numpy()
    contact = hands.contact[own]
    miss = np.linalg.norm(joints[:, 22:] - hands.palms[own], axis=-1)
    human = HumanMotion(
        root=root.numpy(),
        rotations=R.numpy(),
        fingers=np.tile(np.eye(3), (len(root), len(FINGER_JOINTS), 1, 1)),
        joints=joints,
        hand_contact=contact,
        foot_contact=sample.bodies.foot_contact[k, own].double().numpy(),
    )
    return Person(
        human,
        shift_spans(sample.segments[k], own.start, own.stop),
        np.where(contact > BODY_SOLVING.full_hold, miss, 0.0),
        np.repeat(depth, DEPTH_STRIDE)[: len(root)],
    )


@dataclass(frozen=True)
class _Laid:
    """A chunk of one person whose hands are laid."""

    person: Person
    """The frames that the chunk yields."""
    prefix: SolvedPrefix
    """The last of them: the hands of the next chunk begin so."""


def _begun(pool: ThreadPoolExecutor | None, lay: Callable[[], _Laid]) -> "Future[_Laid]":
    """Return what will be laid by the pool, or is laid when this returns."""
    if pool is not None:
        return pool.submit(lay)
    done = Future[_Laid]()
    done.set_result(lay())
    return done


def _solved(
    take: SampledTake,
    k: int,
    pool: ThreadPoolExecutor | None,
    progress: Callable[[float], None],
) -> Person:
    person = GrowingPerson(take.folder)
    prefix: SolvedPrefix | None = None
    laid: Future[_Laid] | None = None
    for n, chunk in enumerate(take.chunks):
        sample, frames = chunk.select(slice(k, k + 1)), chunk.chunk.handed_on(RECORDED.context)

        def told(done: float, n: int = n) -> None:
            progress((n + done) / len(take.chunks))

        targets, bodies = _solved_bodies(sample, take, prefix, told)
        # Before the hands are laid, which changes the rotations.
        prefix = replace(bodies.prefix(frames), rotations=bodies.rotations[:, frames].clone())
        if laid is not None:
            person.add(laid.result().person)
            give_back_memory()
        before = sample.posed if laid is None else laid.result().prefix
        laid = _begun(pool, partial(_with_hands, sample, take, targets, bodies, before))
    assert laid is not None
    person.add(laid.result().person)
    progress(1.0)
    return person.whole()


@torch.inference_mode()
def _solved_bodies(
    sample: SampledChunk,
    take: SampledTake,
    prefix: SolvedPrefix | None,
    progress: Callable[[float], None],
) -> tuple[InteractionTargets, SolvedBodies]:
    bodies, known = sample.bodies, sample.palms_known
    targets = interaction_targets(
        bodies.rotations,
        sample.hands,
        sample.segments,
        sample.clip,
        take.object_model,
        palms_known=known,
    )
    return targets, solve_bodies(
        take.body,
        bodies.root,
        bodies.rotations,
        bodies.foot_contact,
        targets,
        sample.posed if prefix is None else prefix,
        on_progress=progress,
    )


@torch.inference_mode()
def _with_hands(
    sample: SampledChunk,
    take: SampledTake,
    targets: InteractionTargets,
    bodies: SolvedBodies,
    before: SolvedPrefix | None,
) -> _Laid:
    if before is not None:
        bodies = continue_hands(take.body, bodies, before)
    with torch_threads(1):
        people, laid = finish_people(
            bodies,
            targets,
            sample.bodies.foot_contact,
            sample.hands,
            sample.segments,
            take.object_model,
            take.body,
            before,
        )
    frames = sample.chunk.handed_on(RECORDED.context)
    fingers = torch.from_numpy(people[0].human.fingers[frames][None])
    own = _own(sample)
    return _Laid(
        stretch(people[0], own.start, own.stop), replace(laid.prefix(frames), fingers=fingers)
    )
