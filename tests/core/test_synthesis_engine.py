"""Synthetic clips: the hands really hold the thing, which rests still before and after."""

from collections import Counter
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import foot_skating
from omomo_core.learning.recordings.quality import judge
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.recordings.splits import cast_of, side_of
from omomo_core.learning.synthesis.action_plan import Action
from omomo_core.learning.synthesis.attempt import attempt, finished
from omomo_core.learning.synthesis.base_motion import (
    mirrored,
    motion_with_stops,
    reversed_in_time,
    survey,
)
from omomo_core.learning.synthesis.base_motion_search import Sources
from omomo_core.learning.synthesis.synthesis_engine import Roster, classes_of, people_of, synthesise
from omomo_core.learning.synthesis.walker.improvise import index
from omomo_core.motion import FPS

COUNT = 8
FRAMES = 240


@cache
def made(folder: Path) -> tuple[list[Clip], list[Clip], Counter[str]]:
    """The mocap, the clips made of it, and why attempts failed."""
    body = load_body()
    mocap = [clip for part in ("02", "13") for clip in build_mocap(folder / part, body)]
    rejected: Counter[str] = Counter()
    return mocap, list(synthesise(mocap, body, COUNT, seed=1, rejected=rejected)), rejected


@pytest.fixture(scope="module")
def folder(shared: Path) -> Path:
    return shared / "data/mocap/cmu_bvh"


def test_clips_are_whole_and_licensed(folder: Path) -> None:
    _, clips, _ = made(folder)
    assert len({clip.name for clip in clips}) == COUNT
    for clip in clips:
        assert clip.source == "synthesis"
        assert "mocap.cs.cmu.edu" in clip.licence
        assert clip.object_motion is not None
        assert len(clip.root) == len(clip.object_motion.T_world_object)
        assert 120 <= len(clip.root) <= 300
        assert np.isfinite(clip.root).all()
        assert clip.hand_contact.max(axis=1).sum() >= 40
        np.testing.assert_allclose(np.linalg.det(clip.rotations), 1.0, atol=1e-6)


@pytest.mark.parametrize(("action", "seed"), [("carry", 2), ("relocate", 10), ("push", 4), ("drag", 12),
                                             ("tip", 3), ("cart", 6)])  # fmt: skip
def test_a_finished_clip_is_sound(folder: Path, action: Action, seed: int) -> None:
    body, rng = load_body(), np.random.default_rng(seed)
    footage = survey(made(folder)[0], body)
    sources = Sources(footage, index(footage, body))
    takes = (attempt(rng, sources, body, action, 1.0) for _ in range(20))
    take = next(take for take in takes if not isinstance(take, str))
    clip = finished(rng, body, take, 1, "0")
    motion = clip.object_motion
    assert motion is not None
    palms = to_local(motion.T_world_object, joints_of(body, clip.root, clip.rotations)[:, 22:])
    surface = sample_surface(motion.mesh, 30_000)
    assert surface.tree.query(palms[clip.hand_contact > 0])[0].max() < 0.03
    quality = judge(clip, body, stride=12)
    assert quality.floating_frames == 0
    broken = {"object in trunk", "elbow broken", "hinge aside", "shoulder wrung", "wrist bent"}
    assert not broken & set(quality.flags)


def test_palms_stay_on_one_place_of_the_object(folder: Path) -> None:
    body = load_body()
    for clip in made(folder)[1]:
        assert clip.object_motion is not None
        T = clip.object_motion.T_world_object
        palms = joints_of(body, clip.root, clip.rotations)[:, 22:]
        local = to_local(T, palms)
        for hand in range(2):
            # A hand may let go and take another place; in one hold it stays where it is.
            for first, last in runs(clip.hand_contact[:, hand] > 0):
                held = local[first:last, hand]
                assert np.linalg.norm(held - np.median(held, axis=0), axis=-1).max() < 0.04
                gaps = np.linalg.norm(clip.object_motion.mesh.vertices - held[0], axis=-1)
                assert gaps.min() < 0.2


def test_a_free_object_rests(folder: Path) -> None:
    for clip in made(folder)[1]:
        assert clip.object_motion is not None
        T, mesh = clip.object_motion.T_world_object, clip.object_motion.mesh
        free = clip.hand_contact.max(axis=1) == 0
        both = free[1:] & free[:-1]
        assert np.abs(np.diff(T, axis=0))[both].max(initial=0.0) < 1e-12
        world = np.einsum("tij,vj->tvi", T[::8, :3, :3], mesh.vertices) + T[::8, None, :3, 3]
        assert world[..., 2].min() > -0.02
        speed = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=-1) * FPS
        assert speed.max() < 4.0


def test_feet_neither_skate_nor_sink(folder: Path) -> None:
    body = load_body()
    for clip in made(folder)[1]:
        soles = sole_points(body, clip.root, clip.rotations)
        assert foot_skating(soles, clip.foot_contact > 0) < 0.15
        assert soles[..., 2].min() > -0.1


def test_seed_and_index_fix_the_clip(folder: Path) -> None:
    mocap, clips, _ = made(folder)
    again = list(islice(synthesise(mocap, load_body(), 2, seed=1), 2))
    for a, b in zip(clips, again, strict=False):
        assert a.name == b.name
        np.testing.assert_array_equal(a.rotations, b.rotations)
    other = next(synthesise(mocap, load_body(), 1, seed=2))
    assert not np.array_equal(other.root, clips[0].root)


def test_held_out_people_and_objects_are_kept_out(folder: Path) -> None:
    mocap, clips, _ = made(folder)
    casts = [cast_of(clip.name) for clip in clips]
    for clip, cast in zip(clips, casts, strict=True):
        assert cast is not None
        assert clip.object_motion is not None
        assert cast.object == clip.object_motion.mesh.name
    assert len({cast.person for cast in casts if cast}) > 2
    roster = Roster(people_of("16-17"), classes_of("unseen"))
    held_out = synthesise(mocap, load_body(), 4, seed=1, roster=roster)
    assert {side_of(clip.name) for clip in held_out} == {"unseen"}


def test_workers_make_the_same_clips(folder: Path) -> None:
    mocap, clips, _ = made(folder)
    steps: list[tuple[int, int]] = []
    parallel = list(
        synthesise(
            mocap, load_body(), 2, 1, lambda done, total: steps.append((done, total)), workers=2
        )
    )
    assert steps == [(1, 2), (2, 2)]
    for a, b in zip(parallel, clips, strict=False):
        np.testing.assert_allclose(a.rotations, b.rotations, atol=1e-9)


def test_useless_mocap_is_refused(folder: Path) -> None:
    clip = made(folder)[0][0]
    short = Clip(
        "short", "cmu_bvh", "", clip.root[:20], clip.rotations[:20],
        clip.hand_contact[:20], clip.foot_contact[:20], None,
    )  # fmt: skip
    with pytest.raises(InputError) as caught:
        next(synthesise([short], load_body(), 1, seed=0))
    assert caught.value.code == "synthesis-footage"


def test_mirroring_exchanges_the_sides(folder: Path) -> None:
    body = load_body()
    stretch = survey(made(folder)[0], body).stretches[0]
    twin = mirrored(stretch)
    joints, other = (joints_of(body, s.root, s.rotations) for s in (stretch, twin))
    flip = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(other[:, 20], joints[:, 21] * flip, atol=0.02)
    np.testing.assert_allclose(other[:, 7], joints[:, 8] * flip, atol=0.02)
    back = reversed_in_time(reversed_in_time(stretch))
    np.testing.assert_array_equal(back.root, stretch.root)


def test_a_rehearsed_stage_stands_still_where_asked(folder: Path) -> None:
    body = load_body()
    rng = np.random.default_rng(0)
    footage = survey(made(folder)[0], body)
    stages = [
        motion_with_stops(rng, s, FRAMES, [40, 50]) for s in footage.stretches for _ in range(4)
    ]
    found = [stage for stage in stages if stage is not None]
    assert found
    for stage in found:
        assert len(stage.root) == FRAMES
        (a, b), (c, d) = stage.pauses
        assert b - a in (39, 40, 41)
        assert d - c in (49, 50, 51)
        assert b < c
        for first, last in stage.pauses:
            middle = stage.root[max(first + 15, 0) : min(last - 15, FRAMES)]
            assert np.ptp(middle, axis=0).max() < 0.01
