"""Methods without networks, and weights without methods."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from capture_app.tables.table_methods import METHODS
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.evaluated_methods import EvaluatedMethod, RecordedPeople
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.recordings.clips import Clip, save_clips
from omomo_core.motion import HumanMotion
from tests.core.movers import mover, resembling

AWAY = {
    "goal": 0.5,
    "single-stage": 0.2,
    "no-constraints": 0.1,
    "omomo": 0.05,
    "gt-hands": 0.02,
    "capture": 0.04,
}
"""How far each stand-in is from the truth."""


@dataclass(frozen=True)
class Near:
    """People who are so far from the recorded one; farther when they are not told of the start."""

    name: str
    away: float

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        if clip.name.startswith("sub16_trashcan") and self.name == "goal":
            raise InputError("too-hard", "It gives up.", where=clip.name)
        away = self.away * (1 if first_frame else 2)
        return [resembling(clip, away, seed + k) for k in range(samples)]


def load(names: Sequence[str]) -> Mapping[str, EvaluatedMethod]:
    near = {name: Near(name, away) for name, away in AWAY.items()}
    return {**near, "recorded": RecordedPeople()}


def never(names: Sequence[str]) -> Mapping[str, EvaluatedMethod]:
    raise AssertionError(f"{names} are asked again")


def write_weights(folder: Path, seed: int = 0) -> None:
    """A file for every network that some method needs."""
    rng = np.random.default_rng(seed)
    for entry in METHODS.values():
        for network in entry.networks:
            path = folder / entry.folder / f"{network}.safetensors"
            path.parent.mkdir(parents=True, exist_ok=True)
            notes = {"config": json.dumps({}), "steps_done": "4000", "batch": "32", "seed": "3"}
            save_file({"w": rng.normal(size=(4, 5)).astype(np.float16)}, path, notes)


def write_data(path: Path, names: Sequence[str], frames: int = 30) -> None:
    """A file of clips of the held-out people."""
    clips: list[Clip] = []
    for k, name in enumerate(names):
        m = mover(name, frames, seed=k)
        contact, feet = np.zeros((frames, 2)), np.zeros((frames, 4))
        clips.append(Clip(name, "synthesis", "", m.root, m.rotations, contact, feet, m.motion))
    save_clips(path, clips)
