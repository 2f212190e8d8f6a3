"""`omocap render`: draw the video or a picture of a result."""

from typing import Any

from capture_app.cli import options
from capture_app.cli.console import progress_bars, say
from capture_app.cli.derived import derived
from capture_app.commands.render import RenderRequest
from capture_app.commands.request import validated


@derived(RenderRequest)
def render(result: options.Result, output: options.OutputFile = None, **said: Any) -> None:
    """Draw a result again: from elsewhere, another size, another sample, or as pictures.

    The ending of the output file decides: .mp4, .webp or .gif (a small loop for a web page), or .png
    with --still or --sheet.

    Example: `omocap render chair_motion --view orbit --size 1920x1080 -o chair.mp4`
    """
    from capture_app.rendering import render_result
    from capture_app.result import load_result, sample_index

    # A view or a size that is mistyped is told before the result is read.
    target = output or result
    request = validated(
        RenderRequest, {**said, "result": result, "output": target}, "option-invalid"
    )
    index = sample_index(load_result(result), request.sample)
    if output is None:
        target = result / _default_name(index, request)
        request = request.model_copy(update={"output": target})
    with progress_bars() as progress:
        render_result(request, progress)
    say("Done", str(target), "green")


def _default_name(sample: int, request: RenderRequest) -> str:
    words = [f"sample_{sample + 1}"]
    if request.view != "third":
        words.append(request.view)
    if request.still is not None:
        words.append(f"{round(request.still * 30):05d}")
    if request.sheet:
        words.append("sheet")
    return "_".join(words) + (".png" if request.picture else ".mp4")
