"""A sample of a result folder into one file of another program."""

from pathlib import Path

from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.exports.export import Exported, export
from capture_app.exports.formats import format_of_ending, target_of
from capture_app.result import Result, body_of, load_result, sample_index
from omomo_core.errors import InputError


def export_result(request: ExportRequest) -> Exported:
    """Write it; all files appear whole or not at all.

    Args:
        request: the result, the file to write or a folder for it, and how the file shall be. AMASS poses
            are for the SMPL-X model that the result was made with, if no skeleton is given.

    Raises:
        InputError: "format-needed", or see `export`; or the result cannot be read or has no such sample.
    """
    to = request.to or _format_of(request.output)
    result = load_result(request.result)
    index = sample_index(result, request.sample)
    suffix = "" if request.sample is None else f"_sample_{request.sample}"
    path = target_of(request.output, result.folder.resolve().name + suffix, to)
    skeleton = request.skeleton
    if to is ExportFormat.amass and skeleton is None:
        skeleton = _own_model(result)
    return export(
        path,
        result.motions[index],
        result.object_motion,
        body_of(result),
        request,
        skeleton=skeleton,
        blender=request.blender,
    )


def _format_of(output: Path) -> ExportFormat:
    if output.is_dir():
        raise InputError(
            "format-needed",
            "Nothing says which format to write.",
            where="--to",
            fix="Give --to with a format, such as --to glb, or the name of a file with -o.",
        )
    return format_of_ending(output)


def _own_model(result: Result) -> Path | None:
    given = (Path(item.path) for item in result.manifest.inputs if item.role == "body")
    return next(given, None)
