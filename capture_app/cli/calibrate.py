"""`omocap calibrate`: every way to find the mount; without a method it asks what you have."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperGroup

from capture_app.cli.console import output, say
from capture_app.cli.derived import derived
from capture_app.commands.calibrate import (
    BoardWay,
    DrawingWay,
    FloorWay,
    PointsWay,
    ScanWay,
    SessionWay,
    TrackerWay,
)
from capture_app.commands.request import validated

MountFile = Annotated[
    Path,
    typer.Option("-o", "--output", help="Mount file to write.", show_default=False),
]
MaybeObject = Annotated[
    Path | None,
    typer.Option(
        "--object", help="Mesh of the object, to note which one it is.", show_default=False
    ),
]


@derived(ScanWay)
def scan(mount_file: MountFile, **said: Any) -> None:
    """Find the clamped phone in the scan of the object and its surroundings.

    The object stands where it was scanned while the clamped phone films for two seconds. If it is
    back on its mark at the end of the take, that rest counts too and shows whether the phone
    slipped.
    """
    from capture_app.cli.mount_summary import carry_out

    carry_out(ScanWay, said, mount_file)


@derived(SessionWay)
def session(mount_file: MountFile, **said: Any) -> None:
    """Scan the object, then clamp the phone to it without stopping the log or moving the object.

    The clamped phone's pose while it stands still, and the object's place in the same world, give
    the mount. If the object is back on its mark at the end, that rest counts too.
    """
    from capture_app.cli.mount_summary import carry_out

    carry_out(SessionWay, said, mount_file)


@derived(BoardWay)
def board(mount_file: MountFile, **said: Any) -> None:
    """Film a board on the object from a tripod while the clamped phone logs and you turn the object.

    Turn it by 30 to 60 degrees about two directions for 20 seconds. The clocks need not agree. Print
    a board with `omocap calibrate board-pdf`.
    """
    from capture_app.cli.mount_summary import carry_out

    carry_out(BoardWay, said, mount_file)


@derived(TrackerWay)
def tracker(mount_file: MountFile, **said: Any) -> None:
    """Calibrate from a recording in which phone and another tracker followed the same motion.

    Turn the object by 30 to 60 degrees about two directions, for 20 seconds or more. The clocks need
    not agree.
    """
    from capture_app.cli.mount_summary import carry_out

    carry_out(TrackerWay, said, mount_file)


@derived(FloorWay)
def floor(mount_file: MountFile, **said: Any) -> None:
    """Refine a mount by a take in which the object stands on the floor, or is pushed over it.

    Each rest fixes how the object is tilted. Its height is fixed where the floor's is known: from
    depth maps, from --phone-height or --floor, or from rests on several sides.
    """
    from capture_app.cli.mount_summary import carry_out

    carry_out(FloorWay, said, mount_file)


PairFile = Annotated[
    Path | None,
    typer.Argument(help="CSV or JSON file of pairs: phone,x,y,z in each line.", show_default=False),
]
Save = Annotated[
    Path | None, typer.Option(help="Also write the pairs to this JSON file.", show_default=False)
]


@derived(PointsWay, first=("pairs", "object", "phone", "ruler"), leave_out=("format",))
def points(
    mount_file: MountFile, pair_file: PairFile = None, save: Save = None, **said: Any
) -> None:
    """Find the mount from three or more points, known on the phone and on the object.

    Points of the phone have names: "lens", "top left back corner", "left middle front", "centre
    back"; left and right are as you look at the screen. Four or five points, far apart and not in
    one plane, show mistakes. To click the points on the mesh, use the page: `omocap serve`.
    """
    from capture_app.calibration.calibrate import by_points, pairs_of
    from capture_app.cli.mount_summary import check_output, finish
    from ingest.calibration.point_pairs import save_pairs

    way = validated(PointsWay, {**said, "pair_file": pair_file}, "option-invalid")
    check_output(mount_file)
    pairs = pairs_of(way)
    if save:
        save_pairs(pairs, save)
    picked = by_points(way)
    for pair, off in zip(pairs, picked.fit.residuals, strict=True):
        say(f"  {pair.name}", f"{1e3 * off:.1f} mm", "")
    if way.scale:
        sure = 196 * picked.fit.scale_sigma
        say("Scale", f"{picked.fit.scale:.4g} within {sure:.1f} % (95 %)", "bold")
    finish(picked.mount, mount_file, way.mesh_file)


@derived(DrawingWay, first=("phone", "ruler"), leave_out=("format",))
def drawing(mount_file: MountFile, **said: Any) -> None:
    """Write the mount of a holder whose drawing says where the phone is on the object.

    The body's pose needs the phone's model, which says where its camera is. Take the default sigmas
    for a printed holder.

    Example: omocap calibrate drawing --phone "iPhone 15" --xyz "0 0.12 0.31" --axes "screen faces
    +y, top edge points +z" -o mount.json
    """
    from capture_app.cli.mount_summary import carry_out

    carry_out(DrawingWay, said, mount_file)


Mounts = Annotated[
    list[Path],
    typer.Argument(help="Two or more mount files of one clamping.", show_default=False),
]
SameTake = Annotated[
    bool,
    typer.Option(
        "--same-take",
        help="The two files are of the start and the end of one take: if they disagree, the mount "
        "slipped.",
    ),
]


def combine(
    mounts: Mounts,
    mount_file: MountFile,
    same_take: SameTake = False,
    mesh: MaybeObject = None,
) -> None:
    """Combine several calibrations of one mount, each weighted by how sure it is.

    What one leaves open the others fill in. Calibrations that disagree beyond what they claim are
    refused; of three or more, the odd one is named.
    """
    from capture_app.cli.mount_summary import check_output, finish, mesh_file_of
    from ingest.calibration.combine import NamedMount
    from ingest.calibration.combine import combine as combined
    from ingest.calibration.still import refuse_slip
    from ingest.mount_file import load_mount
    from omomo_core.errors import InputError

    check_output(mount_file)
    results = [NamedMount(str(path), load_mount(path)) for path in mounts]
    if same_take:
        if len(results) != 2:
            raise InputError(
                "mounts-not-two",
                f"A take has one start and one end, and {len(results)} mounts are given.",
                where="--same-take",
                fix="Name two files, that of the start first.",
            )
        refuse_slip(results[0].mount, results[1].mount)
    finish(combined(results), mount_file, mesh_file_of(mesh))


def show_mount(
    mount: Annotated[Path, typer.Argument(help="Mount file.", show_default=False)],
) -> None:
    """Say what a mount file holds: where the object is, how sure that is, what was not seen."""
    from capture_app.cli.mount_summary import show
    from ingest.mount_file import load_mount

    show(load_mount(mount))


def board_pdf(
    path: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="PDF to write (PNG with --screen).", show_default=False
        ),
    ],
    paper: Annotated[str, typer.Option(help="A4, A3, Letter or Tabloid.")] = "A4",
    board: Annotated[
        str,
        typer.Option(
            help="Columns x rows : square : marker : dictionary, such as "
            "5x7:35mm:26mm:DICT_5X5_100. The paper's own board if not given.",
            show_default=False,
        ),
    ] = "",
    screen: Annotated[
        str,
        typer.Option(
            help="Pixels of a screen to show the board on instead, such as 1170x2532.",
            show_default=False,
        ),
    ] = "",
    ppi: Annotated[
        float, typer.Option(help="Pixels per inch of that screen.", show_default=False)
    ] = 0.0,
) -> None:
    """Write the board that is fixed on the object, for `omocap calibrate board`.

    Print it at 100 % ("actual size"), measure both rulers, and glue it on something flat and stiff.
    """
    from ingest.calibration.board.board_sheet import preset_for, write_sheet
    from ingest.calibration.board.board_spec import parse_board
    from omomo_core.errors import InputError

    suffix = ".png" if screen else ".pdf"
    if path.suffix.lower() != suffix:
        raise InputError(
            "board-output",
            f"The board is a {suffix[1:].upper()} file.",
            where=str(path),
            fix=f"End its name with {suffix}.",
        )
    if not path.absolute().parent.is_dir():
        raise InputError(
            "output-folder",
            "The folder is not there.",
            where=str(path.parent),
            fix="Make it, or name another place with -o.",
        )
    chosen = parse_board(board) if board else preset_for(paper)
    if screen:
        from ingest.calibration.board.board_spec import write_screen

        write_screen(chosen, screen, ppi, path)
        output.print("Show it full screen at 100 %, without scaling, bright, with no bars over it.")
    else:
        write_sheet(chosen, paper, path)
        output.print("Print it at 100 % (actual size), then measure both rulers.")
    output.print(f"Board: {chosen}\nWritten: {escape(str(path))}", soft_wrap=True)


class _Guided(TyperGroup):
    """Without a method, `guide` is meant."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Name the command that an empty line means."""
        return super().parse_args(ctx, args or ["guide"])


app = typer.Typer(
    cls=_Guided,
    no_args_is_help=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def guide() -> None:
    """Ask what there is, guide through each recording, check it at once, and find the mount."""
    from capture_app.calibration.guide_flow import Guide
    from capture_app.calibration.guide_steps import Prompt
    from capture_app.cli.console import output
    from capture_app.cli.mount_summary import check_output

    Guide(Prompt(output), _run, check_output).go()


def _run(words: Sequence[str]) -> None:
    """Run a command of `omocap calibrate`, as if it had been typed."""
    command = typer.main.get_command(app)
    with command.make_context("omocap calibrate", list(words)) as context:
        command.invoke(context)


app.command("scan")(scan)
app.command("session")(session)
app.command("board")(board)
app.command("tracker")(tracker)
app.command("points")(points)
app.command("drawing")(drawing)
app.command("floor")(floor)
app.command("combine")(combine)
app.command("show")(show_mount)
app.command("board-pdf")(board_pdf)


@app.callback()
def calibrate() -> None:
    """Find where the phone sits on the object, and how sure that is; without a method: be guided.

    - **scan**: the clamped phone's pictures, found in the object's scan
    - **session**: object scanned and phone clamped in one recording
    - **board**: a second camera watches a printed board on the object
    - **tracker**: motion capture or a second tracker followed the object
    - **points**: three or more points known on phone and object
    - **drawing**: the drawing of a holder
    - **floor**: refines any of them by the object's contact with the floor
    - **combine**: several results of one mount become one, or are found to disagree
    """
