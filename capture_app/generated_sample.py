"""What a run generated, kept to the last bit until the result is complete."""

import json
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from omomo_core.array_archive import array_archive
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.person import FingerFit, Person
from omomo_core.motion import HumanMotion
from omomo_core.whole_file import whole_file


@dataclass(frozen=True)
class GeneratedSample:
    """The sample to show, and how all samples were judged."""

    person: Person
    chosen: int
    """Its index amid all samples."""
    scores: tuple[dict[str, float], ...]
    """Ranking of each sample."""
    notes: tuple[str, ...]
    """What is still wrong with the chosen sample, in words."""


def save_sample(path: Path, sample: GeneratedSample) -> None:
    """Write it; unlike `motion.npz`, which is for others, nothing is converted or rounded."""
    person = sample.person
    human = {f.name: getattr(person.human, f.name) for f in fields(HumanMotion)}
    spans = [(s.hand, s.start, s.stop) for s in person.segments]
    anchors = np.array([s.anchor for s in person.segments])
    scores = [{name: float(value) for name, value in score.items()} for score in sample.scores]
    described = json.dumps({"chosen": sample.chosen, "scores": scores, "notes": sample.notes})
    arrays = {"spans": np.array(spans, int), "anchors": anchors, "told": np.array(described)}
    if person.finger_fit is not None:
        arrays["finger_depth"] = person.finger_fit.depth
        arrays["pad_distance"] = person.finger_fit.pad_distance
        arrays["grip"] = person.finger_fit.grip
    with whole_file(path) as partial, array_archive(partial) as archive:
        archive.write({"miss": person.miss, "depth": person.depth, **arrays, **human})


def load_sample(path: Path) -> GeneratedSample:
    """Read what `save_sample` wrote."""
    with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        data = {key: file[key] for key in file.files}
    described = json.loads(str(data["told"]))
    segments = tuple(
        ContactSegment(hand, start, stop, anchor)
        for (hand, start, stop), anchor in zip(data["spans"].tolist(), data["anchors"], strict=True)
    )
    human = HumanMotion(**{f.name: data[f.name] for f in fields(HumanMotion)})
    fit = None
    if "grip" in data:
        fit = FingerFit(data["finger_depth"], data["pad_distance"], data["grip"])
    person = Person(human, segments, data["miss"], data["depth"], fit)
    return GeneratedSample(
        person, described["chosen"], tuple(described["scores"]), tuple(described["notes"])
    )
