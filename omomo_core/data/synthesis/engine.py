"""The synthesis engine: mocap in, clips of people carrying and pushing things out."""

import multiprocessing
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.data.clips import Clip
from omomo_core.data.grounding import foot_contacts, sole_points
from omomo_core.data.retarget import joints_of
from omomo_core.data.synthesis.actor import Performance, perform
from omomo_core.data.synthesis.footage import (
    Footage,
    Stretch,
    mirrored,
    reversed_in_time,
    survey,
)
from omomo_core.data.synthesis.hands import Hands, forearms, plan_hands
from omomo_core.data.synthesis.review import fault, walked_through
from omomo_core.data.synthesis.script import Action, Script, draw_action, write_script
from omomo_core.data.synthesis.shapes import joined
from omomo_core.data.synthesis.stage import Stage, rehearse
from omomo_core.data.synthesis.trajectory import Handling, direct
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh, ObjectMotion

FRAMES = 240
"""Length of every clip: 8 s."""
_TRIES = 60
_STAGE_TRIES = 20
_SHORTEST_HOLD = 80
"""Frames in the hands: a clip in which hardly anything is moved teaches little."""
_BACKWARD: dict[Action, float] = {"pull": 0.8, "push": 0.05}
"""Chance to play the walk backward."""

Take = tuple[Stretch, Stage, Script, Handling, Hands, Performance]


def synthesise(
    clips: Sequence[Clip],
    body: BodyModel,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    *,
    workers: int = 1,
    rejected: Counter[str] | None = None,
) -> Iterator[Clip]:
    """Make clips of people carrying, pushing, pulling, lifting and turning things.

    Args:
        clips: mocap on our skeleton, from `build_mocap`.
        body: whose proportions the clips have.
        count: how many clips to make.
        seed: together with a clip's index it fixes the clip, whatever the number of workers.
        progress: called with clips done and clips in all.
        workers: processes to use.
        rejected: counts the attempts that were thrown away, by reason.

    Returns:
        Clips of 240 frames with objects, source ``synthesis``, under the licence of their mocap.

    Raises:
        InputError: ``synthesis-footage`` when the mocap has no usable stretch.
    """
    footage = survey(clips, body)
    if not footage.stretches:
        raise InputError(
            "synthesis-footage",
            "The mocap has no stretch of calm walking or standing of 1.5 s.",
            fix="Give more or longer clips.",
        )
    make = partial(_clip, footage, body, seed)
    if workers == 1:
        yield from _reported(map(make, range(count)), count, progress, rejected)
        return
    # Spawned, not forked: a forked process may hang in torch's threads.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _start_worker, (make,)) as pool:
        results = pool.map(_work, range(count), chunksize=4)
        yield from _reported(results, count, progress, rejected)


def _reported(
    results: Iterator[tuple[Clip, Counter[str]]],
    count: int,
    progress: Callable[[int, int], None] | None,
    rejected: Counter[str] | None,
) -> Iterator[Clip]:
    for done, (clip, reasons) in enumerate(results, start=1):
        if rejected is not None:
            rejected.update(reasons)
        if progress is not None:
            progress(done, count)
        yield clip


_Maker = Callable[[int], tuple[Clip, Counter[str]]]
_maker: list[_Maker] = []
"""In a worker process: what makes a clip. The footage is sent once, not with every clip."""


def _start_worker(make: _Maker) -> None:
    torch.set_num_threads(1)
    _maker[:] = [make]


def _work(index: int) -> tuple[Clip, Counter[str]]:
    return _maker[0](index)


def _clip(footage: Footage, body: BodyModel, seed: int, index: int) -> tuple[Clip, Counter[str]]:
    """The clip of one index, and why earlier attempts at it failed."""
    rng = np.random.default_rng([seed, index])
    reasons: Counter[str] = Counter()
    action = draw_action(rng)
    while True:
        take = attempt(rng, footage, body, action)
        if not isinstance(take, str):
            return _finished(rng, body, take, f"synthesis_{seed}_{index:05d}"), reasons
        reasons[take] += 1
        if reasons.total() >= _TRIES:
            raise InputError(
                "synthesis-footage",
                f"No clip came out of {_TRIES} attempts; the mocap does not suit.",
                where=f"clip {index}",
                fix="Give more mocap of walking, turning and standing.",
            )


def attempt(
    rng: np.random.Generator, footage: Footage, body: BodyModel, action: Action
) -> Take | str:
    """One try at a clip: all its pieces, or why it is no good."""
    script = write_script(rng, action)
    for _ in range(_STAGE_TRIES):
        stretch = footage.stretches[rng.choice(len(footage.stretches), p=footage.chances)]
        if rng.random() < 0.5:
            stretch = mirrored(stretch)
        if rng.random() < _BACKWARD.get(script.action, 0.12):
            stretch = reversed_in_time(stretch)
        stage = rehearse(rng, stretch, FRAMES, script.pause_frames)
        if stage is None:
            continue
        first, last = script.contact_frames(stage.pauses, FRAMES)
        if last - first >= _SHORTEST_HOLD:
            break
    else:
        return "no-stage"
    handling = direct(rng, body, stage, script)
    if walked_through(body, stage, script, handling):
        return "walked-through"
    hands = plan_hands(script, handling)
    performance = perform(body, stage, script, hands)
    if script.grasp.fingers is None:
        joints = joints_of(body, performance.root, performance.rotations)
        hands = plan_hands(script, handling, forearms(handling, joints))
        performance = perform(body, stage, script, hands)
    reason = fault(body, stage, script, handling, hands, performance)
    return reason or (stretch, stage, script, handling, hands, performance)


def _finished(rng: np.random.Generator, body: BodyModel, take: Take, name: str) -> Clip:
    stretch, _, script, handling, hands, performance = take
    soles = sole_points(body, performance.root, performance.rotations)
    mesh, T_object_prop = _mesh(rng, script)
    T_world_object = handling.T_world_prop @ np.linalg.inv(T_object_prop)
    centre = np.array([*performance.root[0, :2], 0.0])
    T_world_object[:, :3, 3] -= centre
    return Clip(
        name=f"{name} {script.action} {script.prop.name}",
        source="synthesis",
        licence=stretch.licence,
        root=performance.root - centre,
        rotations=performance.rotations,
        hand_contact=hands.contact,
        foot_contact=foot_contacts(soles).astype(float),
        object_motion=ObjectMotion(mesh, T_world_object, np.ones(FRAMES, bool)),
    )


def _mesh(rng: np.random.Generator, script: Script) -> tuple[ObjectMesh, Float[np.ndarray, "4 4"]]:
    """The prop's surface in an object frame of its own: any origin near it, any yaw."""
    vertices, faces = joined(script.prop.parts)
    yaw = rng.uniform(-np.pi, np.pi)
    c, s = np.cos(yaw), np.sin(yaw)
    T = np.eye(4)
    T[:3, :3] = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    middle = (script.prop.low + script.prop.high) / 2
    T[:3, 3] = -T[:3, :3] @ middle + rng.normal(0.0, 0.05, 3)
    moved = vertices @ T[:3, :3].T + T[:3, 3]
    return ObjectMesh(moved, faces, script.prop.name), T
