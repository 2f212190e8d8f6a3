"""Results that are there already: whether they are whole, and whether an order made them."""

import json
import os
from pathlib import Path

from capture_app.commands.run import RunRequest
from capture_app.jobs.batch.sessions import unused
from capture_app.manifest import MANIFEST, Manifest, read_manifest
from omomo_core.errors import InputError


def is_whole(folder: Path) -> bool:
    """Whether the numbers of a result can be read; its films may have been moved elsewhere."""
    from capture_app.result import load_result

    try:
        load_result(folder)
    except InputError:
        return False
    return True


def made_by(order: RunRequest) -> Manifest | None:
    """The manifest of the result that stands where the order wants one, if this order made it.

    None where it is of other options or inputs, or of inputs that have changed since.
    """
    from capture_app.rerun import unchanged

    try:
        manifest = read_manifest(order.output / MANIFEST)
        paths = {item.role: Path(item.path) for item in manifest.inputs}
        if manifest.correction is not None or paths != order.inputs:
            return None
        if _as_json(manifest.options) != _as_json(order.recorded_options):
            return None
        for item in manifest.inputs:
            unchanged(item)
    except InputError:
        return None
    return manifest


def put_aside(folder: Path) -> Path:
    """Give a damaged result another name, so that a new one can take its place."""
    beside = {path.name: path for path in folder.parent.iterdir()}
    aside = folder.with_name(unused(f"{folder.name}.damaged", beside))
    os.rename(folder, aside)
    return aside


def _as_json(options: object) -> object:
    return json.loads(json.dumps(options))
