"""The manifest of a finished run or correction, with every number that shaped the motion."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.generated_sample import GeneratedSample
from capture_app.manifest import (
    MANIFEST,
    BodyRecord,
    Correction,
    FloorRecord,
    Input,
    Manifest,
    Segment,
    sha256,
)
from capture_app.motion_faults import cause_of_leaps, held_grips, unsatisfied
from capture_app.prepare import PreparedTake
from capture_app.result import Result
from ingest.trajectory.trajectory_config import TRAJECTORY, TrajectoryConfig
from omomo_core.body.body_config import BODY, BodyConfig
from omomo_core.config import Number, settings_of
from omomo_core.contact.contact_config import CONTACT, ContactConfig
from omomo_core.generation.generation_config import GENERATION, GenerationConfig
from omomo_core.geometry.geometry_config import GEOMETRY, GeometryConfig
from omomo_core.motion import FPS
from omomo_core.stages.stage_config import STAGES, StagesConfig
from omomo_core.weights.load import SHIPPED


@dataclass(frozen=True)
class MotionConfig:
    """The numbers of every room."""

    trajectory: TrajectoryConfig = TRAJECTORY
    contact: ContactConfig = CONTACT
    body: BodyConfig = BODY
    generation: GenerationConfig = GENERATION
    geometry: GeometryConfig = GEOMETRY
    stages: StagesConfig = STAGES


MOTION_CONFIG = MotionConfig()


def recorded_config() -> dict[str, Number]:
    """Return every number by its name, as a manifest stores it."""
    return {one.name: one.value for one in settings_of(MOTION_CONFIG)}


def changed_settings(recorded: Mapping[str, Number]) -> tuple[str, ...]:
    """Return the names of the numbers that are not what a manifest recorded.

    Numbers that only one of the two has do not count: another version may have named them otherwise.
    """
    now = recorded_config()
    return tuple(name for name, value in recorded.items() if name in now and now[name] != value)


def run_manifest(
    request: RunRequest,
    prepared: PreparedTake,
    sample: GeneratedSample,
    timings: dict[str, float],
    files: tuple[str, ...],
) -> Manifest:
    """The manifest of a finished run."""
    body, floor = prepared.body, prepared.take.floor
    weights = request.weights or SHIPPED / request.configuration
    return Manifest(
        inputs=tuple(
            Input.model_validate({"role": role, "path": str(path), "sha256": sha256(path)})
            for role, path in request.inputs.items()
        ),
        options=request.recorded_options,
        config=recorded_config(),
        segment=prepared.segment,
        floor=FloorRecord(height=floor.height, source=floor.source),
        mount_method=prepared.mount.method,
        body=BodyRecord(name=body.name, credit=body.credit, height=body.height),
        weights={path.name: sha256(path) for path in sorted(weights.glob("*.safetensors"))},
        scores=sample.scores,
        chosen=sample.chosen,
        findings=prepared.findings,
        notes=(
            *prepared.take.notes,
            *_segment_note(prepared.segment),
            *prepared.person.notes(sample.person.human, prepared.motion),
        ),
        faults=(
            *sample.notes,
            *unsatisfied(sample.person),
            *cause_of_leaps(sample.person, request.object),
        ),
        grips=held_grips(sample.person),
        timings=timings,
        files=files,
    )


def correction_manifest(
    request: ResolveRequest,
    before: Result,
    index: int,
    sample: GeneratedSample,
    timings: dict[str, float],
    files: tuple[str, ...],
) -> Manifest:
    """The manifest of a result with one sample corrected: what is not new is of the result before.

    Args:
        index: of the sample in the result before.
    """
    first = before.manifest
    return Manifest(
        inputs=first.inputs,
        options=first.options
        | {"video_size": _size(request.video_size), "video_view": request.video_view},
        config=recorded_config(),
        segment=first.segment,
        floor=first.floor,
        mount_method=first.mount_method,
        body=first.body,
        weights=first.weights,
        correction=Correction(
            result=str(request.result),
            manifest_sha256=sha256(request.result / MANIFEST),
            sample=index,
            contacts=str(request.contacts),
            contacts_sha256=sha256(request.contacts),
        ),
        scores=sample.scores,
        chosen=sample.chosen,
        findings=first.findings,
        notes=first.notes,
        faults=(*sample.notes, *unsatisfied(sample.person)),
        grips=held_grips(sample.person),
        timings=timings,
        files=files,
    )


def _segment_note(segment: Segment) -> Iterator[str]:
    if segment.count > 1:
        yield (
            f"The take was split into {segment.count} segments where tracking failed; this is "
            f"number {segment.index}, {segment.start / FPS:.1f} to {segment.stop / FPS:.1f} s. "
            "Choose another with ‹segment›."
        )


def _size(pixels: tuple[int, int] | None) -> str | None:
    return f"{pixels[0]}x{pixels[1]}" if pixels else None
