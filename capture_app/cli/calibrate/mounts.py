"""`omocap calibrate combine` and `show`: what is done with mount files."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.calibrate import options as given

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
    mount_file: given.MountFile,
    same_take: SameTake = False,
    mesh: given.MaybeObject = None,
) -> None:
    """Combine several calibrations of one mount, each weighted by how sure it is.

    What one leaves open the others fill in. Calibrations that disagree beyond what they claim are
    refused; of three or more, the odd one is named.
    """
    from capture_app.cli.calibrate.finish import check_output, finish, mesh_file_of
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
    from capture_app.cli.calibrate.finish import show
    from ingest.mount_file import load_mount

    show(load_mount(mount))
