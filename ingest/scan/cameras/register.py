"""Poses of a scan's pictures, whatever is known of them."""

import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ingest.colmap import pycolmap, read_model
from ingest.report.take_report import Check
from ingest.scan.cameras.features import (
    THREADS,
    CameraOptions,
    by_look,
    by_place,
    check_scale,
    find_features,
    match_pairs,
    quiet,
)
from ingest.scan.cameras.pose_agreement import as_read, check_axes, moving
from ingest.scan.cameras.reconstruction import (
    cleaned,
    from_poses,
    joined,
    names_of,
    refine,
    triangulated,
    views_of,
)
from ingest.scan.cameras.reference_poses import ModelPlacement, place
from ingest.scan.scan_types import (
    Frame,
    Frames,
    LeftOut,
    Progress,
    Registered,
    Scale,
    ScanSource,
    no_progress,
)
from ingest.scan.scan_work import StageCache, key_of
from omomo_core.errors import InputError

_FEWEST, _SHARE = 8, 0.4
"""Pictures in the largest model, and their part of all, below which there is no scan."""
_OFF = 3.0
"""Pixels (of a picture 960 wide) that a point may be off at last."""
_JOINED = 8.0
"""The same before models that were joined are refined together."""


def from_pictures(
    database: Path,
    images: Path,
    output: Path,
    count: int,
    *,
    known_lens: bool,
    progress: Progress,
) -> pycolmap.Reconstruction:
    """The largest of the models that COLMAP makes, one picture after the other, and what joins it.

    Where the film breaks, COLMAP begins another model; it is joined where both share pictures.

    Args:
        database: with features and matches.
        images: folder of the pictures.
        output: folder for COLMAP's models; emptied.
        count: of pictures.
        known_lens: keep focal lengths and lenses as they are.
        progress: called with the stage "cameras".

    Raises:
        InputError: "scan-overlap" when the pictures do not hang together.
    """
    quiet()
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir(parents=True)
    placed = 0

    def on_next_image() -> None:
        nonlocal placed
        placed += 1
        progress("cameras", min(placed / count, 1.0))

    models = pycolmap.incremental_mapping(
        database, images, output, options=_options(known_lens), next_image_callback=on_next_image
    )
    largest_first = sorted(models.values(), key=lambda one: -one.num_reg_images())
    sizes = [model.num_reg_images() for model in largest_first]
    if not sizes or sizes[0] < max(_FEWEST, _SHARE * count):
        groups = f"at most {sizes[0]} of {count} hang together" if sizes else "no two fit"
        raise InputError(
            "scan-overlap",
            f"The pictures do not overlap enough: {groups}"
            f"{f', in {len(sizes)} groups' if len(sizes) > 1 else ''}.",
            where=str(images),
            fix="Walk around the object in small steps so that neighbouring pictures share two "
            "thirds of what they show, and close the round; a patterned floor helps.",
        )
    model = _finished(largest_first[0], known_lens)
    if (poses := joined(largest_first)) is not None:
        more = triangulated(
            database, images, output, poses.T_model_camera, _JOINED * _wide(model), poses.cameras
        )
        more = _finished(more, known_lens)
        if more.num_reg_images() > model.num_reg_images():
            model = more
    assert names_of(model)
    return model


def _finished(model: pycolmap.Reconstruction, known_lens: bool) -> pycolmap.Reconstruction:
    """The model refined, without points that are off, in place."""
    refine(model, intrinsics=not known_lens)
    cleaned(model, _OFF * _wide(model))
    return model


def _wide(model: pycolmap.Reconstruction) -> float:
    """How large its pictures are, in widths of 960 pixels."""
    return max(max(c.width, c.height) for c in model.cameras.values()) / 960


def _options(known_lens: bool) -> pycolmap.IncrementalPipelineOptions:
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = THREADS
    options.random_seed = 0
    options.min_model_size = 5
    options.max_num_models = 10
    options.extract_colors = False
    options.ba_refine_focal_length = options.ba_refine_extra_params = not known_lens
    options.mapper.abs_pose_refine_focal_length = not known_lens
    options.mapper.abs_pose_refine_extra_params = not known_lens
    # A walk of two hundred pictures needs no refinement of all after each tenth of them.
    options.ba_global_frames_ratio = options.ba_global_points_ratio = 1.3
    options.ba_global_max_refinements = 2
    return options


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


STAGE, DATABASE = "cameras", "database"


def register(
    source: ScanSource,
    picked: Frames,
    folder: Path,
    *,
    options: CameraOptions | None = None,
    progress: Progress = no_progress,
) -> Registered:
    """Find the cameras of the picked pictures.

    With poses of a phone: points are triangulated with them and all is refined, then laid back on
    the phone's poses, which say the metre and where up is. Without: by the pictures alone, then
    scaled by what `options` says. A COLMAP model is taken as it is and scaled in the same way.
    Features, matches and the model are kept in the work folder; what is there is not made again.

    Args:
        source: what was filmed.
        picked: its pictures, of `pick_frames`.
        folder: work folder of the scan.
        options: how, and what gives the scale.
        progress: called with the stages "features", "compare", "match", "cameras", "board".

    Raises:
        InputError: "scan-scale" when nothing says how large it is; "scan-textureless",
            "scan-overlap", "scan-axes", "scan-poses", "scan-board-...", "scan-length...".
    """
    options = options or CameraOptions()
    logged = options.poses and source.T_world_camera is not None
    frames = _read_as(picked.frames, options.axes) if logged else picked.frames
    check_scale(options, logged, str(source.where))
    options = replace(options, draft=options.draft and logged and source.intrinsics is not None)
    work, pictures = StageCache(folder), _pictures_key(source, frames, options.draft)
    poses = [None if f.T_world_camera is None else f.T_world_camera.tolist() for f in frames]
    key = key_of(STAGE, pictures, poses if logged else None, asdict(options))
    if (record := work.record(STAGE, key)) is not None and (folder / SPARSE).is_dir():
        return registered(folder, record, frames)
    work.begin(STAGE)
    quiet()
    database = None if source.model is not None else _fresh_database(work, pictures)
    model = _found(source, frames, folder, database, options, logged, progress)
    shutil.rmtree(folder / STRAIGHT, ignore_errors=True)
    by_name = {frame.name: frame for frame in frames}
    placed = place(
        model,
        by_name,
        options,
        logged=logged,
        gravity=source.upright,
        straightened=folder / STRAIGHT,
        progress=progress,
    )
    left_out, notes = missing(model, frames, database)
    if database is not None:
        model.extract_colors_for_all_images(folder / "images")
        notes += moving(database, views_of(model, names_of(model), by_name, folder / STRAIGHT))
    _write(model, folder / SPARSE)
    record = record_of(placed, left_out, notes)
    work.finish(STAGE, key, record)
    return registered(folder, record, frames)


def _read_as(frames: Sequence[Frame], axes: str) -> tuple[Frame, ...]:
    """The frames with their poses under the reading that somebody names."""
    T = as_read(np.array([frame.T_world_camera for frame in frames]), axes)
    return tuple(replace(f, T_world_camera=T[k]) for k, f in enumerate(frames))


def _pictures_key(source: ScanSource, frames: Sequence[Frame], draft: bool) -> str:
    """A key of all that features and matches are made from."""
    states = [frame.file.stat() for frame in frames]
    changed = [(state.st_size, state.st_mtime_ns) for state in states]
    known = [
        (f.name, f.size, f.focal_guess, None if f.intrinsics is None else f.intrinsics.tolist())
        for f in frames
    ]
    return key_of(str(source.model), known, changed, draft)


def _fresh_database(work: StageCache, pictures: str) -> Path:
    """The database of these pictures: that of an earlier run, or none yet."""
    database = work.folder / "database.db"
    if work.record(DATABASE, pictures) is None:
        work.begin(DATABASE)
        database.unlink(missing_ok=True)
        work.finish(DATABASE, pictures, {})
    return database


def _found(
    source: ScanSource,
    frames: Sequence[Frame],
    folder: Path,
    database: Path | None,
    options: CameraOptions,
    logged: bool,
    progress: Progress,
) -> pycolmap.Reconstruction:
    """The reconstruction, of any size and anywhere."""
    if database is None:
        assert source.model is not None
        return _given(source.model, frames)
    images = folder / "images"
    numbers = find_features(database, images, frames, progress, draft=options.draft)
    known_lens = source.intrinsics is not None
    if not (logged and known_lens):
        order = [numbers[frame.name] for frame in frames]
        match_pairs(database, frames, by_look(database, order, progress), progress)
        return from_pictures(
            database,
            images,
            folder / "colmap",
            len(frames),
            known_lens=known_lens,
            progress=progress,
        )
    T = np.array([frame.T_world_camera for frame in frames])
    match_pairs(database, frames, by_place(T), progress)
    check_axes(database, frames, T, str(source.where))
    model = from_poses(database, images, folder / "colmap", frames, T, progress)
    if len(names_of(model)) < max(_FEWEST, _SHARE * len(frames)):
        raise InputError(
            "scan-overlap",
            f"Only {len(names_of(model))} of {len(frames)} pictures share enough with others.",
            where=str(source.where),
            fix="Walk around the object in small steps so that neighbouring pictures share two "
            "thirds of what they show; a patterned floor helps.",
        )
    return model


def _given(folder: Path, frames: Sequence[Frame]) -> pycolmap.Reconstruction:
    """A finished model, without pictures that are not there."""
    model = read_model(folder)
    there = {frame.name for frame in frames}
    for image in list(model.images.values()):
        if image.has_pose and image.name not in there:
            model.deregister_frame(image.frame_id)
    return model


def _write(model: pycolmap.Reconstruction, folder: Path) -> None:
    fresh = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    model.write(fresh)
    shutil.rmtree(folder, ignore_errors=True)
    fresh.replace(folder)
