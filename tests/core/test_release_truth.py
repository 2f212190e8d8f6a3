"""Random people and objects in the release's layout are read as they were made up."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import load_body
from omomo_core.learning.evaluation.clip_sources import read_truth
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.recordings.omomo_release import (
    ReleaseSequence,
    leg,
    read_release,
    release_clips,
)
from omomo_core.motion import ObjectMotion
from tests.core.release_files import Written, dump, make_up, slipped

NAMES = ["sub2_monitor_001", "sub16_mop_000", "sub17_vacuum_123"]
FRAMES = [0, 11, 29]


def vertices_of(motion: ObjectMotion, frame: int) -> np.ndarray:
    T = motion.T_world_object[frame]
    return motion.mesh.vertices @ T[:3, :3].T + T[:3, 3]


def written(seed: int, name: str, folder: Path) -> Written:
    made = make_up(np.random.default_rng(seed), name, folder)
    dump(folder / "file.p", {0: made.entry})
    return made


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), name=st.sampled_from(NAMES))
def test_truth_is_what_was_written(tmp_path: Path, seed: int, name: str) -> None:
    made = written(seed, name, tmp_path)
    (clip,) = read_truth(tmp_path / "file.p", load_body())
    assert isinstance(clip, RealClip)
    assert clip.name == name
    np.testing.assert_allclose(clip.joints, made.joints, atol=1e-5)
    # The body that the tables put into the clip's poses has this person's bones.
    np.testing.assert_allclose(
        joints_of(clip.body, clip.root, clip.rotations), made.joints, atol=1e-4
    )
    for frame in FRAMES:
        found = vertices_of(clip.motion, frame)
        assert found.shape == made.vertices[frame].shape
        assert KDTree(found).query(made.vertices[frame])[0].max() < 2e-4


@pytest.mark.parametrize("name", NAMES)
def test_a_clip_is_the_scene_in_our_size(tmp_path: Path, name: str) -> None:
    made = written(3, name, tmp_path)
    (sequence,) = read_release(tmp_path / "file.p")
    (clip,) = release_clips(tmp_path / "file.p", load_body())
    assert isinstance(sequence, ReleaseSequence)
    assert not isinstance(clip, Exception)
    assert clip.object_motion is not None
    rest = load_body().rest_joints.double().numpy()
    ours = np.linalg.norm(rest[[4, 5, 7, 8]] - rest[[1, 2, 4, 5]], axis=-1).sum() / 2
    scale = ours / leg(sequence.bones)
    for frame in FRAMES:
        found = vertices_of(clip.object_motion, frame)
        assert KDTree(found).query(made.vertices[frame] * scale)[0].max() < 2e-4


def test_a_lower_part_that_slips_for_a_moment_is_where_it_mostly_is(tmp_path: Path) -> None:
    made = written(5, "sub2_mop_001", tmp_path)
    entry = slipped(made.entry, first=10, last=20, metres=0.2)
    dump(tmp_path / "file.p", {0: entry})
    (clip,) = read_truth(tmp_path / "file.p", load_body())
    assert isinstance(clip, RealClip)
    off = KDTree(vertices_of(clip.motion, 2)).query(made.vertices[2])[0]
    assert off.max() < 2e-4
