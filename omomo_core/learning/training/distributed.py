"""ProcessGroup: the processes that train one network together, one or those that torchrun starts."""

import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from math import gcd

import torch
from torch import Tensor, distributed, nn
from torch.nn.parallel import DistributedDataParallel

from omomo_core.errors import InputError

SHARDS = 4
"""Parts that a batch is drawn in, each from a seed of its own, so that any number of processes draws the
same batch."""
_TIMEOUT = timedelta(days=7)
"""The first process reads and synthesises the data while the others wait."""


@dataclass(frozen=True)
class ProcessGroup:
    """Rank and number of the processes, and the device of this one."""

    device: torch.device
    rank: int = 0
    count: int = 1

    @property
    def is_main(self) -> bool:
        """Whether this process is the one that writes and reports."""
        return self.rank == 0

    def shards(self, batch: int) -> tuple[Sequence[int], int]:
        """Numbers of the shards of a batch that this process draws, and windows in each.

        Raises:
            InputError: "batch-not-shared" when the processes cannot have equal parts of the batch.
        """
        shards = gcd(batch, SHARDS)
        if shards % self.count:
            shards = self.count
        if batch % shards:
            raise InputError(
                "batch-not-shared",
                f"A batch of {batch} windows cannot be shared equally by {self.count} processes.",
                where="--batch",
                fix=f"Use a multiple of {self.count}.",
            )
        return range(self.rank, shards, self.count), batch // shards

    def wrap(self, network: nn.Module) -> nn.Module:
        """Return the network with gradients averaged over the processes; itself when there is one."""
        if self.count == 1:
            return network
        if self.device.type == "cuda":
            network = nn.SyncBatchNorm.convert_sync_batchnorm(network)
            return DistributedDataParallel(network, [self.device.index])
        return DistributedDataParallel(network)

    def mean(self, x: Tensor) -> Tensor:
        """Return the mean of a tensor over the processes, without gradient."""
        if self.count == 1:
            return x.detach()
        total = x.detach().float().clone()
        distributed.all_reduce(total)
        return total / self.count

    def barrier(self) -> None:
        """Wait until every process has called this."""
        if self.count > 1:
            distributed.barrier()


@contextmanager
def process_group() -> Generator[ProcessGroup]:
    """Give the group that torchrun describes in the environment, or a group of this process alone.

    The device is the process's own GPU where there is one, else the CPU.
    """
    count = int(os.environ.get("WORLD_SIZE", "1"))
    rank, local = int(os.environ.get("RANK", "0")), int(os.environ.get("LOCAL_RANK", "0"))
    there = torch.cuda.is_available()
    device = torch.device("cuda", local) if there else torch.device("cpu")
    if count == 1:
        yield ProcessGroup(device)
        return
    if there:
        torch.cuda.set_device(device)
    distributed.init_process_group("nccl" if there else "gloo", timeout=_TIMEOUT)
    try:
        yield ProcessGroup(device, rank, count)
    finally:
        distributed.destroy_process_group()
