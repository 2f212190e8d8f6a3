"""cheapest_path: one choice for each step, so that costs and changes are least together (Viterbi 1967)."""

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor


def cheapest_path(
    cost: Float[Tensor, "rows steps choices"], between: Float[Tensor, "*changes choices choices"]
) -> Int[Tensor, "rows steps"]:
    """Return the path of choices of each row with the least sum of costs and changes.

    Args:
        cost: of each choice in each step.
        between: of the change from one choice to another; the same for all steps, or of each step from
            the second on, or of each row and such step.
    """
    # numpy takes half of torch's time for so many small steps.
    steps, rows = cost.shape[1] - 1, np.arange(len(cost))
    change = between.expand(*cost.shape[:1], steps, *between.shape[-2:]).numpy()
    costs = cost.numpy()
    best, came = costs[:, 0], list[np.ndarray]()
    for step in range(steps):
        reached = best[:, :, None] + change[:, step]
        came.append(reached.argmin(axis=1))
        best = reached.min(axis=1) + costs[:, step + 1]
    path = [best.argmin(axis=1)]
    for before in reversed(came):
        path.append(before[rows, path[-1]])
    return torch.from_numpy(np.stack(path[::-1], axis=1))
