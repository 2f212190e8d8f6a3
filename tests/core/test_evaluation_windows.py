"""Clips to evaluate on: what can be read, and how it is cut."""

from pathlib import Path

import numpy as np
import pytest

from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clip_sources import clip_of, read_recorded, windows_of
from omomo_core.learning.evaluation.evaluated_methods import RecordedPeople
from omomo_core.learning.evaluation.metrics import paired_bootstrap
from omomo_core.learning.recordings.clips import Clip, save_clips
from tests.core.movers import mover

BODY = load_body()


@pytest.mark.parametrize(
    ("frames", "cut"),
    [
        (30, [(0, 30)]),
        (89, [(0, 89)]),
        (90, [(0, 90), (60, 30)]),
        (120, [(0, 120), (60, 60)]),
        (250, [(0, 120), (60, 120), (120, 120), (180, 70)]),
    ],
)
def test_windows_overlap_by_half_and_end_with_the_clip(frames: int, cut: list[tuple[int, int]]):
    clip = mover("sub16_mop_001", frames)
    windows = windows_of(clip)
    assert [(int(w.name.split("@")[1]), len(w.root)) for w in windows] == cut
    assert {clip_of(w.name) for w in windows} == {clip.name}
    start, length = cut[-1]
    np.testing.assert_array_equal(windows[-1].joints, clip.joints[start : start + length])
    T = windows[-1].motion.T_world_object
    np.testing.assert_array_equal(T, clip.motion.T_world_object[start : start + length])
    assert len(windows[-1].rotations) == len(windows[-1].motion.valid) == length


def test_a_clip_without_a_window_is_named():
    with pytest.raises(InputError, match="29 frames") as caught:
        windows_of(mover("sub16_mop_001", 29))
    assert caught.value.where == "sub16_mop_001"


def save(path: Path, *names: str, moves: bool = True) -> None:
    clips: list[Clip] = []
    for name in names:
        m = mover(name, 40)
        contact, feet = np.zeros((40, 2)), np.zeros((40, 4))
        moved = m.motion if moves else None
        clips.append(Clip(name, "synthesis", "", m.root, m.rotations, contact, feet, moved))
    save_clips(path, clips)


def test_training_clips_and_recorded_ones_are_read_together(tmp_path: Path, write_clip):
    data = tmp_path / "data"
    data.mkdir()
    save(data / "clips_00000.npz", "sub16_mop_001", "sub17_mop_002")
    save(data / "recorded.npz", "walking", moves=False)
    write_clip("sub1_box_001")
    np.savez(tmp_path / "sub1_box_002.npz", joints=np.zeros((3, 22, 3)))
    found = read_recorded([data, tmp_path], BODY)
    names = ["sub16_mop_001", "sub17_mop_002", "sub1_box_001"]
    assert [clip.name for clip in found.clips] == names
    (reason,) = found.skipped.values()
    assert "clip-keys" in reason
    clip = found.clips[0]
    np.testing.assert_allclose(clip.joints, mover(clip.name, 40).joints, atol=1e-5)
    assert clip.body is BODY
    single = read_recorded([data / "clips_00000.npz"], BODY)
    assert [clip.name for clip in single.clips] == names[:2]


def test_what_gives_no_clip_is_refused(tmp_path: Path):
    save(tmp_path / "walks.npz", "walking", moves=False)
    save(tmp_path / "twice.npz", "sub16_mop_001")
    (tmp_path / "broken.p").write_bytes(b"\x80\x04.")
    for source, code in (
        ([tmp_path / "walks.npz"], "no-usable-clips"),
        ([tmp_path / "none"], "no-clips"),
        ([tmp_path / "twice.npz"] * 2, "clip-named-twice"),
    ):
        with pytest.raises(InputError) as caught:
            read_recorded(source, BODY)
        assert caught.value.code == code
    with pytest.raises(InputError):
        read_recorded([tmp_path / "broken.p"], BODY)


def test_recorded_people_answer_with_the_truth():
    clip = mover("sub1_box_001", 30)
    (person,) = RecordedPeople().sample(clip, 5, 0, first_frame=False)
    np.testing.assert_allclose(person.joints, clip.joints, atol=1e-6)


def test_a_difference_in_every_clip_is_sure_and_one_of_a_single_clip_is_not():
    rng = np.random.default_rng(0)
    base = rng.uniform(size=40)
    clips = [f"clip{k // 4}" for k in range(40)]
    sure = paired_bootstrap(list(base + 0.1), list(base), clips)
    assert (sure.mean, sure.low, sure.high) == pytest.approx((0.1, 0.1, 0.1))
    lucky = base.copy()
    lucky[:4] += 1.0
    chance = paired_bootstrap(list(lucky), list(base), clips)
    assert chance.mean == pytest.approx(0.1)
    assert chance.low == pytest.approx(0)
    assert chance.mean < chance.high
    # Windows of one clip are drawn together: one clip of ten is missed in a third of the draws.
    assert paired_bootstrap(list(base), list(lucky), clips).high == pytest.approx(0)
