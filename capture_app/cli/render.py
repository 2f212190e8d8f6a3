"""`omocap render`: draw the video or a picture of a result."""

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars, say
from capture_app.coordinates import read_size


def render(
    result: given.Result,
    file: given.OutputFile = None,
    view: given.View = given.SeenFrom.third,
    sample: given.Sample = None,
    size: given.Size = "960x540",
    still: given.Still = None,
    sheet: given.Sheet = None,
    markers: given.Markers = True,
    smooth: given.Smooth = None,
    backend: given.Backend = given.DrawingBackend.auto,
) -> None:
    """Draw a result again: from elsewhere, another size, another sample, or as pictures.

    The ending of the output file decides: .mp4, .webp or .gif (a small loop for a web page), or .png
    with --still or --sheet.

    Example: `omocap render chair_motion --view orbit --size 1920x1080 -o chair.mp4`
    """
    pixels = read_size(size, "--size")
    grid = given.sheet_size(sheet, "--sheet") if sheet else None
    from capture_app.rendering import RenderRequest, render_result
    from capture_app.result import load_result, sample_index

    index = sample_index(load_result(result), sample)
    target = file or result / _default_name(index, view, still, sheet)
    request = RenderRequest(
        result,
        target,
        view=view.value,
        sample=sample,
        size=pixels,
        still=still,
        sheet=grid,
        markers=markers,
        smooth=smooth,
        backend=backend.value,
    )
    with progress_bars() as progress:
        render_result(request, progress)
    say("Done", str(target), "green")


def _default_name(sample: int, view: given.SeenFrom, still: float | None, sheet: str | None) -> str:
    words = [f"sample_{sample + 1}"]
    if view != given.SeenFrom.third:
        words.append(view.value)
    if still is not None:
        words.append(f"{round(still * 30):05d}")
    if sheet:
        words.append("sheet")
    return "_".join(words) + (".png" if still is not None or sheet else ".mp4")
