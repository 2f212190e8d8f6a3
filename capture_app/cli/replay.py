"""`omocap replay`: look at a result or a recorded session in the browser."""

import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli.console import progress_bars, say
from capture_app.cli.derived import derived
from capture_app.commands.reading import ReadingOptions
from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest, mount_file
from omomo_core.whole_file import check_target, write_whole

Seen = Annotated[
    Path,
    typer.Argument(
        help="Result folder that `omocap run` wrote, or what the phone's logger wrote.",
        show_default=False,
    ),
]
Second = Annotated[
    Path | None, typer.Argument(help="Another one, to compare with.", show_default=False)
]
Page = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        help="HTML file to write; replay.html in the result folder, or SESSION_replay.html here, if "
        "not given, and then it is opened.",
        show_default=False,
    ),
]
Mesh = Annotated[
    Path | None,
    typer.Option("--object", help="Mesh of the object of a session.", show_default=False),
]
Browser = Annotated[bool, typer.Option(help="Open the page in the browser.")]
Film = Annotated[bool, typer.Option(help="Put what the phone filmed into the page, too.")]


@derived(ReadingOptions, only=("up", "format"))
@derived(RunRequest, only=("mount", "mesh_scale"))
def replay(
    path: Seen,
    second: Second = None,
    mesh: Mesh = None,
    file: Page = None,
    browser: Browser = True,
    film: Film = True,
    *,
    mount: Path | None = None,
    mesh_scale: float = 1.0,
    **said: Any,
) -> None:
    """Show a result or a recorded session in 3D: scrub, follow, compare, correct contacts.

    Writes one HTML file that opens in any browser, without a server or a network, and can be sent to
    somebody else. With -o it is only written.

    Example: `omocap replay chair_motion mop_motion -o both.html`
    """
    from capture_app.replay.share import is_result, open_scene, share_page

    name = path.resolve().name
    own = path / "replay.html" if is_result(path) else Path(f"{name}_replay.html")
    target = file or own
    check_target(target, (".html",))
    place = mount_file(mount) if mesh else None
    paths = [path] if second is None else [path, second]
    reading = validated(ReadingOptions, said, "option-invalid").reading
    with progress_bars() as progress:
        packs = [
            open_scene(p, mesh, place, mesh_scale, film=film, reading=reading, progress=progress)
            for p in paths
        ]
    page = share_page(packs, title=name)
    write_whole(target, page)
    say("Done", f"{target} ({len(page) / 1e6:.1f} MB)", "green")
    if film and any(b'"film": {' in pack for pack in packs):
        say("Note", "What the phone filmed is in it; --no-film leaves it out.", "yellow")
    if file is None and browser:
        webbrowser.open(target.resolve().as_uri())
