"""register: where the cameras were when they took the picked pictures, in metres and z up."""

import shutil
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from ingest.colmap import pycolmap
from ingest.colmap_files import read_model
from ingest.scan.cameras.agreement import as_read, check_axes
from ingest.scan.cameras.features import find_features
from ingest.scan.cameras.options import CameraOptions, check_scale
from ingest.scan.cameras.pairs import by_look, by_place, match_pairs
from ingest.scan.cameras.pinholes import views_of
from ingest.scan.cameras.placing import place
from ingest.scan.cameras.quiet import quiet
from ingest.scan.cameras.reconstruction import from_poses, names_of
from ingest.scan.cameras.result import SPARSE, STRAIGHT, missing, record_of, registered
from ingest.scan.cameras.second_motion import moving
from ingest.scan.cameras.unposed import from_pictures
from ingest.scan.types import Frame, Frames, Progress, Registered, ScanSource, no_progress
from ingest.scan.work import StageCache, key_of
from omomo_core.errors import InputError

STAGE, DATABASE = "cameras", "database"
_FEWEST, _SHARE = 8, 0.4
"""Pictures that fit their poses, and their part of all, below which the poses are wrong."""


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
