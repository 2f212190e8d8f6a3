"""`omocap calibrate points`: the mount from points measured on the phone and on the object."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.calibrate import options as given
from capture_app.cli.console import say

PairFile = Annotated[
    Path | None,
    typer.Argument(help="CSV or JSON file of pairs: phone,x,y,z in each line.", show_default=False),
]
Typed = Annotated[
    list[str] | None,
    typer.Option(
        "--pair",
        help='A pair, such as "top left back corner = 0.10 0.22 0.05": a point of the phone by '
        "name or as x y z from its camera, and where it is on the object, metres. Repeat it.",
        show_default=False,
    ),
]
Save = Annotated[
    Path | None, typer.Option(help="Also write the pairs to this JSON file.", show_default=False)
]
Scale = Annotated[
    bool, typer.Option("--scale", help="Solve for the scale of the mesh too, as in the paper.")
]
Sigma = Annotated[
    float, typer.Option(help="By how many mm a point is off along each axis.", min=0.01, max=100)
]


def points(
    mount_file: given.MountFile,
    pairs: PairFile = None,
    typed: Typed = None,
    mesh: given.MaybeObject = None,
    phone: given.MaybePhone = None,
    ruler: given.Ruler = None,
    scale: Scale = False,
    sigma: Sigma = 2.0,
    save: Save = None,
) -> None:
    """Find the mount from three or more points, known on the phone and on the object.

    Points of the phone have names: "lens", "top left back corner", "left middle front", "centre
    back"; left and right are as you look at the screen. Four or five points, far apart and not in
    one plane, show mistakes. To click the points on the mesh, use the page: `omocap serve`.
    """
    from capture_app.cli.calibrate.finish import check_output, finish, mesh_file_of
    from capture_app.cli.calibrate.phone import maybe_phone
    from ingest.calibration.picked_points import mount_from_pairs
    from ingest.calibration.point_pairs import PointPair, load_pairs, save_pairs, typed_pair

    check_output(mount_file)
    model = maybe_phone(phone, ruler)
    metres = sigma / 1e3
    found: list[PointPair] = [*load_pairs(pairs, metres)] if pairs else []
    found += [typed_pair(text, metres) for text in typed or []]
    if save:
        save_pairs(found, save)
    picked = mount_from_pairs(found, model, scaled=scale)
    for pair, off in zip(found, picked.fit.residuals, strict=True):
        say(f"  {pair.name}", f"{1e3 * off:.1f} mm", "")
    if scale:
        sure = 196 * picked.fit.scale_sigma
        say("Scale", f"{picked.fit.scale:.4g} within {sure:.1f} % (95 %)", "bold")
    finish(picked.mount, mount_file, mesh_file_of(mesh))
