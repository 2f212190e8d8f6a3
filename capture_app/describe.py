"""The manifest of a finished run."""

from collections.abc import Iterator
from dataclasses import asdict

from capture_app.manifest import BodyRecord, FloorRecord, Input, Manifest, Segment, sha256
from capture_app.prepare import PreparedTake
from capture_app.request import TakeRequest
from omomo_core.generation.result import Generation
from omomo_core.motion import FPS
from omomo_core.weights.load import SHIPPED


def describe(
    request: TakeRequest,
    prepared: PreparedTake,
    people: Generation,
    timings: dict[str, float],
    files: tuple[str, ...],
) -> Manifest:
    """The manifest of a finished run."""
    body, floor = prepared.body, prepared.take.floor
    weights = request.weights or SHIPPED / request.configuration
    return Manifest(
        inputs=tuple(_inputs(request)),
        options=_options(request),
        segment=prepared.segment,
        floor=FloorRecord(height=floor.height, source=floor.source),
        mount_method=prepared.mount.method,
        body=BodyRecord(name=body.name, credit=body.credit, height=body.height),
        weights={path.name: sha256(path) for path in sorted(weights.glob("*.safetensors"))},
        scores=people.scores,
        chosen=people.chosen,
        notes=(*prepared.take.notes, *_segment_note(prepared.segment), *people.notes),
        timings=timings,
        files=files,
    )


def _segment_note(segment: Segment) -> Iterator[str]:
    if segment.count > 1:
        yield (
            f"The take was split into {segment.count} segments where tracking failed; this is "
            f"number {segment.index}, {segment.start / FPS:.1f} to {segment.stop / FPS:.1f} s. "
            "Choose another with --segment."
        )


def _inputs(request: TakeRequest) -> Iterator[Input]:
    given = {
        "session": request.session,
        "object": request.mesh,
        "mount": request.mount,
        "body": request.body,
    }
    for role, path in given.items():
        if path is not None:
            yield Input.model_validate({"role": role, "path": str(path), "sha256": sha256(path)})


def _options(request: TakeRequest) -> dict[str, str | int | float | bool | None]:
    size = request.video_size
    return {
        **asdict(request.options),
        "configuration": request.configuration,
        "weights": str(request.weights) if request.weights else None,
        "height": request.height,
        "floor": request.floor,
        "mesh_scale": request.mesh_scale,
        "segment": request.segment,
        "video_size": f"{size[0]}x{size[1]}" if size else None,
    }
