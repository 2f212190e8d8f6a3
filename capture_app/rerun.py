"""From a manifest back to the request that made it."""

from pathlib import Path
from typing import Any

from capture_app.manifest import Input, Manifest, sha256
from capture_app.request import TakeRequest
from ingest.trajectory.reading import Reading
from omomo_core.errors import InputError
from omomo_core.generation.result import GenerationOptions
from omomo_core.weights.load import SHIPPED


def request_of(manifest: Manifest, output: Path, *, replace: bool = False) -> TakeRequest:
    """The same take again, into another folder.

    Raises:
        InputError: an input or the weights are not there any more, or are not what they were; or the
            result was corrected.
    """
    _check_not_corrected(manifest)
    inputs = {item.role: unchanged(item) for item in manifest.inputs}
    options: dict[str, Any] = dict(manifest.options)
    generation, reading = (
        {key: options.pop(key) for key in kind.__dataclass_fields__}
        for kind in (GenerationOptions, Reading)
    )
    size, weights = options.pop("video_size"), options.pop("weights")
    _check_weights(manifest, Path(weights or SHIPPED / options["configuration"]))
    return TakeRequest(
        session=inputs["session"],
        mesh=inputs.get("object"),
        mount=inputs.get("mount"),
        body=inputs.get("body"),
        contacts=inputs.get("contacts"),
        output=output,
        options=GenerationOptions(**generation),
        weights=Path(weights) if weights else None,
        reading=Reading(**reading),
        video_size=_size(size) if size else None,
        replace=replace,
        **options,
    )


def _size(text: str) -> tuple[int, int]:
    width, height = text.split("x")
    return int(width), int(height)


def _check_not_corrected(manifest: Manifest) -> None:
    origin = manifest.correction
    if origin is not None:
        raise InputError(
            "result-corrected",
            "The contacts of this result were corrected; its manifest alone does not make it again.",
            where=origin.result,
            fix=f"Run `omocap rerun` on that result and `omocap resolve` with {origin.contacts}.",
        )


def unchanged(item: Input) -> Path:
    """Where an input is.

    Raises:
        InputError: it is not there any more, or not what it was.
    """
    path = Path(item.path)
    if not path.exists():
        raise InputError(
            "input-missing",
            f"The {item.role} of this result is not where it was.",
            where=item.path,
            fix="Put it back, or run the command in the folder where the result was made.",
        )
    if sha256(path) != item.sha256:
        raise InputError(
            "input-changed",
            f"The {item.role} of this result has changed since it was made.",
            where=item.path,
            fix="Restore it, or make a new result with `omocap run`.",
        )
    return path


def _check_weights(manifest: Manifest, folder: Path) -> None:
    for name, digest in manifest.weights.items():
        file = folder / name
        if not file.is_file() or sha256(file) != digest:
            raise InputError(
                "weights-changed",
                "The weights are not those that this result was made with.",
                where=str(file),
                fix=f"Install omocap {manifest.versions.omocap}, or make a new result with "
                "`omocap run`.",
            )
