"""The generator over time: poses of the object in, finished stretches of K people out.

A take of any length is sampled in chapters that begin with what the one before has decided, so memory does
not grow with it, and poses may still be arriving.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.load import load_body
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import Segment, follow
from omomo_core.generation.chunks import LIVE, Chapter, Chapters, cut
from omomo_core.generation.collision.contact_face import Held, other_faces
from omomo_core.generation.conditioning import NOTHING, Known, decided_by, start_of
from omomo_core.generation.decoding import Sampled, embody, wish_of
from omomo_core.generation.object_clip import Scene, Thing
from omomo_core.generation.person import Person, shifted, stretch
from omomo_core.generation.prefix import Decided, Pin
from omomo_core.generation.result import GenerationOptions, Progress, silent
from omomo_core.generation.retargeting import Fit
from omomo_core.generation.sampling.body import sample_body
from omomo_core.generation.sampling.hands import in_contact, sample_hands, starting_at
from omomo_core.generation.solving.bodies import Solved
from omomo_core.generation.threads import threads_for
from omomo_core.generation.wish import Wish
from omomo_core.motion import HandMotion, ObjectMesh
from omomo_core.stages.stage import Stages


@dataclass(frozen=True)
class Block:
    """Finished frames `first` .. `first + frames` of a take, of each sample."""

    first: int
    people: tuple[Person, ...]
    must_hold: Bool[np.ndarray, " frames"]
    """Where somebody must hold the object."""


def stream(
    mesh: ObjectMesh,
    poses: Iterable[Float[np.ndarray, "4 4"]],
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress = silent,
    known: Known = NOTHING,
    *,
    chapters: Chapters = LIVE,
) -> Iterator[Block]:
    """Generate the people who could have moved the object, while its poses arrive.

    Args:
        mesh: the object.
        poses: T_world_object at 30 fps, world z up with the floor at 0, metres; read as needed.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks (capture configuration).
        options: samples, seed, contact rule, sampler.
        progress: told what is being done, for each chapter anew.
        known: what need not be guessed.
        chapters: how long a stretch is sampled at once: `RECORDED` or `LIVE`.

    Yields:
        Stretches in the order of time, without gap or overlap. The same arguments give the same ones.
    """
    maker = _Maker(
        Thing(mesh, stages.height / body.height),
        Fit(load_body(), body),
        stages,
        options,
        progress,
        torch.Generator().manual_seed(options.seed),
    )
    decided: Decided | None = None
    for chapter in cut(poses, chapters):
        with threads_for(options.samples * len(chapter.T_world_object)):
            draft = maker.draft(chapter, known, decided)
        now = range(chapter.decided, chapter.until)
        people = tuple(stretch(p, now.start, now.stop) for p in draft.people)
        must_hold = draft.scene.must_hold[now.start : now.stop]
        yield Block(chapter.first + now.start, people, must_hold)
        if not chapter.last:
            decided = draft.decided(chapter.until - chapters.context, chapter.until)


@dataclass(frozen=True)
class _Draft:
    """A chapter as sampled and solved, all its frames."""

    scene: Scene
    hands: Float[Tensor, "samples frames 8"] | None
    """None where the palms are given."""
    body: Float[Tensor, "samples frames channels"]
    palms: Float[np.ndarray, "samples frames 2 3"]
    solved: Solved
    people: list[Person]

    def decided(self, start: int, stop: int) -> Decided:
        """What the next chapter, which begins at `start`, must not change."""
        rows = slice(start, stop)
        return Decided(
            hands=None if self.hands is None else Pin.all(self.hands[:, rows]),
            body=Pin.all(self.body[:, rows]),
            root=self.solved.root[:, rows],
            rotations=self.solved.rotations[:, rows],
            palms=self.palms[:, rows],
            standing=self.solved.standing[:, rows],
            segments=[shifted(p.segments, start, stop) for p in self.people],
        )


@dataclass(frozen=True)
class _Maker:
    """Samples and solves one chapter after another."""

    thing: Thing
    fit: Fit
    stages: Stages
    options: GenerationOptions
    progress: Progress
    generator: torch.Generator

    def draft(self, chapter: Chapter, known: Known, decided: Decided | None) -> _Draft:
        """All frames of a chapter."""
        scene = self.thing.scene(chapter.T_world_object)
        if known.first_frame is not None and chapter.first == 0:
            decided = decided_by(known.first_frame, scene, self.fit, self.options.samples)
        self.progress("object", 1.0)
        features, hands, segments = self._hands(scene, chapter, known, decided)
        self.progress("contact", 1.0)
        x = sample_body(
            scene, hands, self.stages.body, self.options, self.generator, self.progress, decided
        )
        sampled = Sampled.of(x, self.fit)
        if known.hands is None and known.contacts is None:
            first = 0 if decided is None else decided.frames
            hands, segments = self._on_better_faces(sampled, hands, segments, scene, first)
        people, solved = embody(
            sampled,
            hands,
            segments,
            scene,
            self.thing,
            self.fit.body,
            decided,
            certain=known.hands is not None,
            told=lambda done: self.progress("solve", done),
        )
        self.progress("solve", 1.0)
        return _Draft(scene, features, x, np.stack([h.palms for h in hands]), solved, people)

    def _on_better_faces(
        self,
        sampled: Sampled,
        hands: list[HandMotion],
        segments: list[tuple[Segment, ...]],
        scene: Scene,
        first: int,
    ) -> tuple[list[HandMotion], list[tuple[Segment, ...]]]:
        T, R, thing = scene.take.motion.T_world_object, sampled.rotations, self.thing

        def followed(held: Held) -> list[HandMotion]:
            # What has not changed is not blended a second time.
            return [
                hand if all(a is b for a, b in zip(old, new, strict=True)) else follow(new, hand, T)
                for old, new, hand in zip(segments, held, hands, strict=True)
            ]

        def wished(held: Held) -> Wish:
            return wish_of(R, followed(held), held, scene, thing)

        held = other_faces(self.fit.body, sampled.root, R, segments, thing, wished, first)
        return followed(held), held

    def _hands(
        self, scene: Scene, chapter: Chapter, known: Known, decided: Decided | None
    ) -> tuple[Tensor | None, list[HandMotion], list[tuple[Segment, ...]]]:
        """Stage 1, or what is given in its place."""
        start, stop = chapter.first, chapter.first + len(chapter.T_world_object)
        if known.hands is not None:
            given = HandMotion(known.hands.palms[start:stop], known.hands.contact[start:stop])
            if decided is not None:
                given = starting_at(given, decided.palms[0])
            return None, [given] * self.options.samples, [()] * self.options.samples
        begins = chapter.first == 0
        x = sample_hands(
            scene,
            self.stages.hands,
            self.options,
            self.generator,
            self.progress,
            pin=None if decided is None or begins else decided.hands,
            start=start_of(known, decided, scene) if begins else None,
            last=chapter.last,
        )
        contacts = None if known.contacts is None else shifted(known.contacts, start, stop)
        return x, *in_contact(x, scene, self.options, decided, contacts)
