"""A sample of a result folder into one file of another program."""

from dataclasses import replace
from pathlib import Path

from capture_app.exports.export import Exported, ExportOptions, export
from capture_app.exports.formats import Kind, kind_of, target_of
from capture_app.result import Result, body_of, load_result, sample_index


def export_result(
    result: Path,
    file: Path | None,
    sample: int | None = None,
    options: ExportOptions | None = None,
) -> Exported:
    """Write it; all files appear whole or not at all.

    Args:
        result: its folder.
        file: to write, or a folder for it; in the result's folder if not given.
        sample: from 1; the chosen one if not given.
        options: what to write; if not given, the format that the file's ending says, as its readers
            expect it. AMASS poses are for the SMPL-X model that the result was made with, if no
            skeleton is given.

    Raises:
        InputError: see `export`; or the result cannot be read or has no such sample.
    """
    options = options or ExportOptions(kind_of(file or result))
    loaded = load_result(result)
    index = sample_index(loaded, sample)
    name = loaded.folder.resolve().name + ("" if sample is None else f"_sample_{sample}")
    target = target_of(file, result, name, options.kind)
    if options.kind is Kind.amass and options.skeleton is None:
        options = replace(options, skeleton=_own_model(loaded))
    human, body = loaded.motions[index], body_of(loaded)
    return export(target, human, loaded.object_motion, body, options)


def _own_model(result: Result) -> Path | None:
    given = (Path(item.path) for item in result.manifest.inputs if item.role == "body")
    return next(given, None)
