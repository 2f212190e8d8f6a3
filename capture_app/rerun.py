"""From a manifest back to the request that made it."""

from pathlib import Path

from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest
from capture_app.manifest import Input, Manifest, sha256
from capture_app.manifest_builder import changed_settings
from omomo_core.errors import InputError
from omomo_core.weights.load import SHIPPED


def request_of(manifest: Manifest, output: Path, *, replace: bool = False) -> RunRequest:
    """The same take again, into another folder.

    Raises:
        InputError: an input or the weights are not there any more, or are not what they were; a number
            of the configuration has changed; or the result was corrected.
    """
    _check_not_corrected(manifest)
    _check_config(manifest)
    # Manifests of versions that always solved every sample do not say so.
    options = {"solve": "all", **manifest.options}
    folder = Path(str(options["weights"] or SHIPPED / str(options["configuration"])))
    _check_weights(manifest, folder)
    inputs = {item.role: unchanged(item) for item in manifest.inputs}
    said = {**options, **inputs, "output": output, "replace": replace}
    return validated(RunRequest, said, "manifest-invalid", where=str(output))


def _check_not_corrected(manifest: Manifest) -> None:
    origin = manifest.correction
    if origin is not None:
        raise InputError(
            "result-corrected",
            "The contacts of this result were corrected; its manifest alone does not make it again.",
            where=origin.result,
            fix=f"Run ‹omocap rerun› on that result and ‹omocap resolve› with {origin.contacts}.",
        )


def _check_config(manifest: Manifest) -> None:
    changed = changed_settings(manifest.config)
    if changed:
        raise InputError(
            "config-changed",
            f"Numbers that shape a motion have changed since: {', '.join(changed)}.",
            where="config",
            fix=f"Install omocap {manifest.versions.omocap}, or make a new result with ‹omocap run›.",
        )


def unchanged(item: Input) -> Path:
    """Return the path of an input.

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
            fix="Restore it, or make a new result with ‹omocap run›.",
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
                "‹omocap run›.",
            )
