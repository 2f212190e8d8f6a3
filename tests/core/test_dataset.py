"""Data sets: whole files, gone on with where they stop, never mixed from two recipes."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from omomo_core.errors import InputError
from omomo_core.learning.recordings import dataset
from omomo_core.learning.recordings.clips import Clip, load_clips, read_index, save_clips
from omomo_core.learning.recordings.dataset import (
    DatasetRecipe,
    digest,
    missing_indices,
    open_dataset,
    shards,
    write_card,
    write_shards,
)
from omomo_core.motion import ObjectMesh, ObjectMotion

RECIPE = DatasetRecipe(seed=0, version=1, mocap="abc", shard=3)
MESH = ObjectMesh(np.eye(3), np.array([[0, 1, 2]]), "box")


def clip(k: int, *, with_object: bool = True, frames: int = 30) -> Clip:
    rng = np.random.default_rng(k)
    moved = ObjectMotion(MESH, np.tile(np.eye(4), (frames, 1, 1)), np.ones(frames, bool))
    return Clip(
        name=f"sub1_box_0_{k:05d} {'carry' if k % 2 else 'push'}",
        source="test",
        licence="CC0",
        root=rng.normal(size=(frames, 3)),
        rotations=np.tile(np.eye(3), (frames, 22, 1, 1)),
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.zeros((frames, 4)),
        object_motion=moved if with_object else None,
    )


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data set that has just been started, of files of three clips."""
    monkeypatch.setattr(dataset, "SHARD", 3)
    open_dataset(tmp_path / "set", RECIPE, [clip(100, with_object=False)])
    return tmp_path / "set"


def fill(folder: Path, count: int, stop_at: int | None = None) -> None:
    indices, rejected = missing_indices(folder, count), Counter[str]()

    def clips():
        for index in indices:
            if index == stop_at:
                raise KeyboardInterrupt
            rejected["palm-off"] += 2
            yield clip(index)

    for _ in write_shards(folder, indices, clips(), rejected):
        pass


def test_an_interrupted_set_is_gone_on_with_and_ends_the_same(folder: Path, tmp_path: Path):
    with pytest.raises(KeyboardInterrupt):
        fill(folder, 8, stop_at=5)
    assert [f.name for f in shards(folder)] == ["clips_00000.npz"]
    assert missing_indices(folder, 8) == [3, 4, 5, 6, 7]
    fill(folder, 8)
    names = [c.name for c in load_clips(folder)]
    assert names == [*(clip(k).name for k in range(8)), clip(100).name]
    summary = write_card(folder, RECIPE)
    assert (summary.clips, summary.rejected) == (8, Counter({"palm-off": 16}))
    assert summary.licences == {"CC0": 8}
    np.testing.assert_allclose(summary.minutes["carry", "box"], 4 * 30 / 1800)


def test_a_file_that_is_lost_is_made_again_alone(folder: Path):
    fill(folder, 9)
    (folder / "clips_00001.npz").unlink()
    assert missing_indices(folder, 9) == [3, 4, 5]
    fill(folder, 9)
    assert [c.name for c in load_clips(folder)[:9]] == [clip(k).name for k in range(9)]


def test_a_set_may_grow_but_not_shrink(folder: Path):
    fill(folder, 4)
    assert missing_indices(folder, 4) == []
    assert missing_indices(folder, 7) == [3, 4, 5, 6]
    with pytest.raises(InputError, match="dataset-larger"):
        missing_indices(folder, 3)


@pytest.mark.parametrize("other", [{"seed": 1}, {"version": 2}, {"mocap": "def"},
                                   {"people": "1-15"}, {"objects": "mop"}])  # fmt: skip
def test_other_options_are_refused_by_name(folder: Path, other: dict[str, int | str]):
    open_dataset(folder, RECIPE, [])
    with pytest.raises(InputError, match="dataset-differs") as caught:
        open_dataset(folder, replace(RECIPE, **other), [])
    (value,) = other.values()
    assert f"not {value}" in caught.value.what


def test_a_set_that_says_nothing_of_choices_is_of_all(folder: Path):
    card = json.loads((folder / "dataset.json").read_text())
    for choice, value in {"people": "1-17", "objects": "all"}.items():
        assert card["recipe"].pop(choice) == value
    (folder / "dataset.json").write_text(json.dumps(card))
    open_dataset(folder, RECIPE, [])


@pytest.mark.parametrize("digest", [None, "abc"])
def test_a_set_of_a_version_that_knew_furniture(folder: Path, digest: str | None):
    """Earlier versions could add meshes of furniture; sets without them can be resumed."""
    card = json.loads((folder / "dataset.json").read_text())
    card["recipe"]["furniture"] = digest
    (folder / "dataset.json").write_text(json.dumps(card))
    if digest is None:
        open_dataset(folder, RECIPE, [])
    else:
        with pytest.raises(InputError, match="furniture abc, not none"):
            open_dataset(folder, RECIPE, [])


def test_folders_of_something_else_are_refused(tmp_path: Path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="output-exists"):
        open_dataset(tmp_path, RECIPE, [])
    (tmp_path / "dataset.json").write_text("{}")
    with pytest.raises(InputError, match="dataset-damaged"):
        open_dataset(tmp_path, RECIPE, [])


def test_digest_is_of_the_motion_not_of_where_it_is_kept(tmp_path: Path):
    clips = [clip(1), clip(2, with_object=False)]
    save_clips(tmp_path / "clips.npz", clips)
    stored = load_clips(tmp_path / "clips.npz")
    assert stored[0].root.dtype == np.float32
    assert digest(stored) == digest(clips)
    assert digest(clips[::-1]) != digest(clips)


def test_notes_and_rows_are_read_without_the_motion(tmp_path: Path):
    save_clips(tmp_path / "clips.npz", [clip(1), clip(2, with_object=False)], {"seconds": 1.5})
    rows, notes = read_index(tmp_path / "clips.npz")
    assert [row["object"] for row in rows] == ["box", None]
    assert notes == {"seconds": 1.5}


def test_an_empty_folder_has_no_clips(tmp_path: Path):
    for path in (tmp_path, tmp_path / "none.npz"):
        with pytest.raises(InputError, match="clips-missing"):
            load_clips(path)
