"""`omocap rerun`: make a result again from its manifest."""

from capture_app.cli import options
from capture_app.cli.summary import show_result


def rerun(
    result: options.Result, output: options.ResultFolder, replace: options.Replace = False
) -> None:
    """Make the same motion again, from the inputs and options in a result's manifest.

    Stops if an input, the weights or a number that shapes the motion have changed since.
    """
    from capture_app.manifest import MANIFEST, read_manifest
    from capture_app.pipeline import motion_of_take
    from capture_app.rerun import request_of

    request = request_of(read_manifest(result / MANIFEST), output, replace=replace)
    show_result(request, motion_of_take)
