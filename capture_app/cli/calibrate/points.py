"""`omocap calibrate points`: the mount from points measured on the phone and on the object."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli.calibrate import options as given
from capture_app.cli.console import say
from capture_app.cli.derived import derived
from capture_app.commands.calibrate import PointsWay
from capture_app.commands.request import validated

PairFile = Annotated[
    Path | None,
    typer.Argument(help="CSV or JSON file of pairs: phone,x,y,z in each line.", show_default=False),
]
Save = Annotated[
    Path | None, typer.Option(help="Also write the pairs to this JSON file.", show_default=False)
]


@derived(PointsWay, first=("pairs", "object", "phone", "ruler"), leave_out=("format",))
def points(
    mount_file: given.MountFile, pair_file: PairFile = None, save: Save = None, **said: Any
) -> None:
    """Find the mount from three or more points, known on the phone and on the object.

    Points of the phone have names: "lens", "top left back corner", "left middle front", "centre
    back"; left and right are as you look at the screen. Four or five points, far apart and not in
    one plane, show mistakes. To click the points on the mesh, use the page: `omocap serve`.
    """
    from capture_app.calibration.calibrate import by_points, pairs_of
    from capture_app.cli.calibrate.finish import check_output, finish
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
