"""Registered from what a finished stage has left in the work folder."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ingest.colmap import pycolmap
from ingest.colmap_files import read_model
from ingest.report.check import Check
from ingest.scan.cameras.pinholes import views_of
from ingest.scan.cameras.placing import ModelPlacement
from ingest.scan.cameras.reconstruction import names_of
from ingest.scan.types import Frame, LeftOut, Registered, Scale

SPARSE, STRAIGHT = "sparse", "straight"
_TOLD = 0.9
"""Part of the pictures that are registered, below which it is worth a warning."""
_ENOUGH = 30
"""Matches with the others by which a picture can be placed."""


def record_of(
    placed: ModelPlacement, left_out: Sequence[LeftOut], notes: Sequence[Check]
) -> dict[str, Any]:
    """The record of a finished stage, stored beside its model."""
    return {
        "scale": asdict(placed.scale),
        "up": placed.up,
        "left_out": [asdict(one) for one in left_out],
        "notes": [asdict(note) for note in (*placed.notes, *notes)],
    }


def registered(folder: Path, record: Mapping[str, Any], frames: Sequence[Frame]) -> Registered:
    """Read the model of a work folder as `Registered`."""
    model = read_model(folder / SPARSE)
    names = names_of(model)
    by_name = {frame.name: frame for frame in frames}
    views = views_of(model, names, by_name, folder / STRAIGHT)
    numbers = {number: k for k, number in enumerate(sorted(model.points3D))}
    first = by_name[names[0]]
    return Registered(
        views=views,
        points=np.array([model.points3D[n].xyz for n in numbers], np.float64).reshape(-1, 3),
        colours=np.array([model.points3D[n].color for n in numbers], np.uint8).reshape(-1, 3),
        observed=_observed(model, names, numbers),
        reprojection=float(model.compute_mean_reprojection_error()),
        scale=Scale(**record["scale"]),
        up=record["up"],
        left_out=tuple(LeftOut(**one) for one in record["left_out"]),
        notes=tuple(Check(**note) for note in record["notes"]),
        model=folder / SPARSE,
        images=Path(str(first.file).removesuffix(first.name)),
    )


def _observed(
    model: pycolmap.Reconstruction, names: Sequence[str], numbers: Mapping[int, int]
) -> np.ndarray:
    by_name = {image.name: image for image in model.images.values()}
    pairs = [
        (numbers[point.point3D_id], k)
        for k, name in enumerate(names)
        for point in by_name[name].points2D
        if point.has_point3D()
    ]
    return np.array(pairs, np.int64).reshape(-1, 2)


def missing(
    model: pycolmap.Reconstruction, frames: Sequence[Frame], database: Path | None
) -> tuple[tuple[LeftOut, ...], tuple[Check, ...]]:
    """The pictures that are not in a model, why, and a warning when they are many."""
    there = set(names_of(model))
    absent = [frame.name for frame in frames if frame.name not in there]
    shared = _shared(database, absent) if database is not None and absent else {}
    left_out = tuple(LeftOut(name, _reason(shared.get(name), there)) for name in absent)
    if len(there) >= _TOLD * len(frames):
        return left_out, ()
    message = f"{len(absent)} of {len(frames)} pictures could not be placed."
    fix = "Film the stretches that are missing more slowly, with more overlap."
    return left_out, (Check("registered", "warn", message, None, fix),)


def _reason(shared: Mapping[str, int] | None, there: Collection[str]) -> str:
    """Why a picture is not in the model.

    Args:
        shared: how many matches it has with each other picture; None where that is not known.
        there: the pictures that are in the model.
    """
    if shared is None:
        return "it is not in the model"
    placed = sum(count for name, count in shared.items() if name in there)
    others = sorted(
        name for name, count in shared.items() if name not in there and count >= _ENOUGH
    )
    if placed >= _ENOUGH:
        return (
            f"its place contradicts those of the other pictures (it shares {placed} matches with "
            "those that are placed)"
        )
    if others:
        return (
            f"it shares much only with pictures that are left out too ({', '.join(others)}), and "
            f"{placed} matches with those that are placed"
        )
    return f"it shares too little with the other pictures ({sum(shared.values())} matches)"


def _shared(database: Path, names: Sequence[str]) -> dict[str, dict[str, int]]:
    """Verified matches of some pictures with each other picture."""
    counts: dict[str, dict[str, int]] = {name: {} for name in names}
    with pycolmap.Database.open(database) as opened:
        name_of = {i.image_id: i.name for i in opened.read_all_images()}
        for pair, geometry in zip(*opened.read_two_view_geometries(), strict=True):
            a, b = (name_of.get(number, "") for number in pycolmap.pair_id_to_image_pair(pair))
            for one, other in ((a, b), (b, a)):
                if one in counts:
                    counts[one][other] = len(geometry.inlier_matches)
    return counts
