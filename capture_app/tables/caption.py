"""What stands under the tables: on what, with which weights and how they were made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from capture_app.tables.methods import Network
from omomo_core.learning.evaluation.sources import clip_of
from omomo_core.learning.recordings.splits import cast_of

_BUDGET = {
    "size": "size {}",
    "steps_done": "{} steps",
    "batch": "of {} windows",
    "seed": "seed {}",
    "cpu_seconds": "{} s of processor time",
}
"""Notes in a network's file that tell its budget."""


@dataclass(frozen=True)
class TableOrigin:
    """How the tables were made."""

    sources: Sequence[str]
    split: str
    windows: Sequence[str]
    samples: int
    seed: int
    sampler: str
    steps: int
    networks: Mapping[str, Sequence[Network]]
    """Of each method."""
    skipped: Mapping[str, str]
    """Clips that could not be used, and why."""
    failed: Mapping[str, str]
    """Windows that a method could not answer, and why: left out for all."""


def caption(made: TableOrigin) -> list[str]:
    """Sentences, for all tables together."""
    return [_data(made), _protocol(made), *_weights(made), *_left_out(made)]


def _data(made: TableOrigin) -> str:
    clips = {clip_of(window) for window in made.windows}
    casts = [cast for clip in clips if (cast := cast_of(clip)) is not None]
    people = sorted({cast.person for cast in casts})
    things = sorted({cast.object for cast in casts})
    who = f"; people {', '.join(f'sub{p}' for p in people)}; {', '.join(things)}" if casts else ""
    split = f" (split {made.split})" if made.split else ""
    return (
        f"Data: {', '.join(made.sources)}{split}: {len(made.windows)} windows of up to 120 frames "
        f"from {len(clips)} clips{who}. These are not the paper's test clips: its numbers are of "
        f"other data."
    )


def _protocol(made: TableOrigin) -> str:
    walk = "all 1,000 steps" if made.sampler == "ddpm" else f"{made.steps} steps"
    return (
        f"Best of {made.samples}: the sample with the least MPJPE, every figure of it, as published. "
        f"One sample: the one that the method shows. Sampler {made.sampler}, {walk}; seed {made.seed}. "
        f"Centimetres; O_root, Coll. (share of frames) and contact scores have no unit. Coll. is by the "
        f"published code, whose threshold is 4 % of half the object's largest side; the second of each "
        f"two tables has true 4 cm. A palm touches within 5 cm of the object: of its vertices and points "
        f"between them, for scans have many vertices and models few (F1 vertices: of its vertices alone)."
    )


def _weights(made: TableOrigin) -> list[str]:
    networks = {n.name: n for group in made.networks.values() for n in group}
    descriptions = [_network(network) for network in networks.values()]
    return [f"Weights: {'; '.join(descriptions)}."] if descriptions else []


def _network(network: Network) -> str:
    notes = [text.format(network.notes[k]) for k, text in _BUDGET.items() if k in network.notes]
    if start := network.notes.get("started_from"):
        notes.append(f"from the weights {start}")
    size = f"{network.parameters / 1e6:.1f} M numbers"
    if (held := network.notes.get("clips_held_out", "0")) != "0":
        notes.append(f"trained on {held} clips of held-out people, too")
    return f"{network.name} {network.digest} ({', '.join([size, *notes])})"


def _left_out(made: TableOrigin) -> list[str]:
    out: list[str] = []
    if made.failed:
        names = ", ".join(f"{task} ({why})" for task, why in made.failed.items())
        out.append(f"Left out for all methods, because one had no answer: {names}.")
    if made.skipped:
        out.append(f"{len(made.skipped)} clips could not be used, or are of another split.")
    return out
