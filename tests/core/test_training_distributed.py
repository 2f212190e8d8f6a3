"""Processes that train one network together: equal weights, and those of one process alone."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.training.corpus import Corpus
from omomo_core.learning.training.training_loop import ProcessGroup, process_group, start, train
from omomo_core.learning.training.training_task import TrainOptions
from tests.core.test_training import CLIPS, MAKES

OPTIONS = TrainOptions(steps=6, batch=8, warmup=1)
CPU = torch.device("cpu")


def run(group: ProcessGroup, file: Path) -> None:
    """Train and write the weights of this process, before and after."""
    corpus = Corpus(CLIPS, load_body(), synthesis_share=0.7)
    state = start(MAKES["body of capture"], corpus, OPTIONS, group)
    before = {f"before.{k}": v.clone() for k, v in state.task.network.state_dict().items()}
    train(state, corpus, OPTIONS, lambda s: True, group)
    save_file(before | dict(state.task.network.state_dict()), file)


def test_two_processes_end_with_the_weights_of_one(tmp_path: Path):
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--nproc-per-node", "2"]
    root = str(Path(__file__).parents[2])
    subprocess.run(
        [*torchrun, __file__, str(tmp_path)],
        env=os.environ | {"PYTHONPATH": root, "OMP_NUM_THREADS": "1"},
        check=True,
        timeout=300,
    )
    run(ProcessGroup(CPU), tmp_path / "alone.safetensors")
    first, second, alone = (
        load_file(tmp_path / f"{name}.safetensors") for name in ("rank0", "rank1", "alone")
    )
    assert all(torch.equal(first[k], second[k]) for k in first)
    names = [k for k in alone if f"before.{k}" in alone]
    moved, apart = (
        np.sqrt(sum(float((alone[k] - other[o]).square().sum()) for k, o in pairs))
        for other, pairs in (
            (alone, [(k, f"before.{k}") for k in names]),
            (first, [(k, k) for k in names]),
        )
    )
    assert moved > 0.1
    # Sums in another order, in bf16 where it is quick; other windows would end as far apart as they
    # moved.
    assert apart < 0.1 * moved


def test_a_batch_is_drawn_in_the_same_shards_by_any_number_of_processes():
    alone, each = ProcessGroup(CPU).shards(32)
    for count in (2, 4):
        parts = [ProcessGroup(CPU, rank, count).shards(32) for rank in range(count)]
        assert sorted(shard for part, _ in parts for shard in part) == list(alone)
        assert {size for _, size in parts} == {each}
    assert ProcessGroup(CPU, 2, 3).shards(12) == (range(2, 3, 3), 4)
    assert ProcessGroup(CPU, 11, 12).shards(24) == (range(11, 12, 12), 2)


def test_a_batch_that_cannot_be_shared_is_refused():
    for batch in (7, 12):
        with pytest.raises(InputError, match="batch-not-shared"):
            ProcessGroup(CPU, 0, 8).shards(batch)


if __name__ == "__main__":
    with process_group() as ours:
        run(ours, Path(sys.argv[1]) / f"rank{ours.rank}.safetensors")
