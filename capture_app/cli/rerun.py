"""`omocap rerun`: make a result again from its manifest."""

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars
from capture_app.cli.summary import summarise


def rerun(result: given.Result, output: given.ResultFolder, replace: given.Replace = False) -> None:
    """Make the same motion again, from the inputs and options in a result's manifest.

    Stops if an input, the weights or a number that shapes the motion have changed since.
    """
    from capture_app.manifest import MANIFEST, read_manifest
    from capture_app.pipeline import run_take
    from capture_app.rerun import request_of

    request = request_of(read_manifest(result / MANIFEST), output, replace=replace)
    with progress_bars() as progress:
        made = run_take(request, progress)
    summarise(made)
