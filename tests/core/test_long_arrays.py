"""Arrays that grow in files, and what is computed of them block by block."""

import numpy as np
import pytest

from omomo_core.array_archive import ArrayBlocks, array_archive, read_arrays
from omomo_core.long_arrays import BLOCK, GrowingArray, in_blocks, let_go


@pytest.mark.parametrize("in_file", [False, True])
def test_an_array_that_grows_is_its_stretches_one_after_another(in_file, tmp_path):
    parts = [np.random.default_rng(k).normal(size=(5 + k, 2, 3)) for k in range(3)]
    growing = GrowingArray(tmp_path if in_file else None)
    for part in parts:
        growing.add(part[:, :, ::-1])
    whole = growing.whole()
    np.testing.assert_array_equal(whole, np.concatenate(parts)[:, :, ::-1])
    let_go(whole)
    np.testing.assert_array_equal(whole, np.concatenate(parts)[:, :, ::-1])
    assert whole.flags.writeable
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("rows", [4, BLOCK, BLOCK + 1, BLOCK + 3, 3 * BLOCK - 2])
def test_what_is_computed_in_blocks_is_what_is_computed_at_once(rows):
    x = np.random.default_rng(rows).normal(size=(rows, 2, 3))
    jerk = in_blocks(lambda some: np.diff(some, n=3, axis=0), x, lost=3)
    np.testing.assert_array_equal(jerk, np.diff(x, n=3, axis=0))


@pytest.mark.parametrize("compressed", [False, True])
def test_an_archive_is_the_file_that_numpy_writes(compressed, tmp_path):
    arrays = {
        "x": np.random.default_rng(1).normal(size=(2 * BLOCK, 3)).round(1),
        "name": np.array("a chair"),
        "none": np.zeros((0, 3), np.float32),
    }
    made = ArrayBlocks((2 * BLOCK, 3), np.dtype(np.float32), iter(np.split(arrays["x"], 8)))
    with array_archive(tmp_path / "ours.npz", compressed=compressed) as archive:
        archive.write({**arrays, "single": made})
    save = np.savez_compressed if compressed else np.savez
    save(tmp_path / "numpys.npz", **arrays, single=arrays["x"].astype(np.float32))
    assert (tmp_path / "ours.npz").read_bytes() == (tmp_path / "numpys.npz").read_bytes()
    assert list(read_arrays(tmp_path / "ours.npz", lambda name: name == "none")) == ["none"]
