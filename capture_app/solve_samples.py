"""Samples of a result that are solved when somebody wants to see them, and kept in its folder."""

from collections.abc import Iterable
from dataclasses import replace

from capture_app.motion_arrays import SAMPLED
from capture_app.progress import Progress, silent
from capture_app.result import Result, body_of, save_sample_of
from omomo_core.generation.sampled_file import load_sampled


def solved_result(result: Result, samples: Iterable[int], progress: Progress = silent) -> Result:
    """Return the result with some samples solved; each is solved once, and then kept in the result's folder.

    Args:
        result: of which some samples may be as they were sampled.
        samples: indices of those that are wanted.
        progress: told the stage "solve".

    Raises:
        InputError: "result-damaged".
        AssetError: the body was the user's own, and is not where it was.
    """
    wanted = [k for k in dict.fromkeys(samples) if k in result.unsolved]
    if not wanted:
        return result
    take, people = load_sampled(result.folder / SAMPLED, body_of(result)), list(result.people)
    for n, k in enumerate(wanted):
        start = n / len(wanted)
        solved = take.solve(k, lambda done, n=start: progress("solve", n + done / len(wanted)))
        people[k] = save_sample_of(result, k, solved)
    return replace(result, people=tuple(people), unsolved=result.unsolved - set(wanted))


def all_solved(result: Result, progress: Progress = silent) -> Result:
    """Return the result with every sample solved; the arguments are those of `solved_result`."""
    return solved_result(result, range(len(result.people)), progress)
