"""One sample of a result as one file of another program, CSV among them."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_app.blender_extension.bone_names import BONE_NAMES
from capture_app.commands.export import (
    Bones,
    ExportFormat,
    ExportOptions,
    ExportRequest,
    Units,
    UpAxis,
)
from capture_app.exports.amass import write_amass
from capture_app.exports.bones import take_on_own_bones
from capture_app.exports.bvh import write_bvh
from capture_app.exports.contact_spans import write_contacts
from capture_app.exports.export_formats import format_of_ending, frame_of, target_of
from capture_app.exports.exported_take import Take, placed
from capture_app.exports.fbx import find_blender, read_fbx, write_fbx
from capture_app.exports.glb import write_glb_take
from capture_app.exports.glb_character import write_character
from capture_app.exports.refit import take_on_target
from capture_app.exports.resample import at_rate
from capture_app.exports.target_skeleton import Target, read_target
from capture_app.exports.usd import write_usd
from capture_app.picture_bytes import encoded
from capture_app.progress import Progress, silent
from capture_app.result import Result, body_of, load_result, sample_index
from capture_app.solve_samples import solved_result
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.geometry.rotations import xyzw_from_matrix
from omomo_core.motion import HumanMotion, ObjectMotion
from omomo_core.whole_file import whole_files

_CONTACTS = (
    "left_hand_contact", "right_hand_contact", "left_ankle_contact", "right_ankle_contact",
    "left_toe_contact", "right_toe_contact",
)  # fmt: skip


def write_table(path: Path, take: Take, units: Units) -> None:
    """Write a table with one header row that names every column and its unit.

    `frame`, `time_s`; `JOINT_x_m`, `_y_m`, `_z_m` of every joint in the world (`_cm` in
    centimetres); `object_x_m` ... of the mesh's origin and `object_qx`, `_qy`, `_qz`, `_qw`, its
    R_world_object; the contacts, 1 or 0.

    Args:
        path: the .csv file to write.
        take: in the axes and units of the file.
        units: the take's.
    """
    T = take.T_world_object
    frames = len(T)
    values = [
        take.times[:, None],
        take.positions.reshape(frames, -1),
        T[:, :3, 3],
        xyzw_from_matrix(T[:, :3, :3]),
    ]
    contacts = np.concatenate([take.hand_contact, take.foot_contact], axis=1).astype(int)
    rows = zip(np.concatenate(values, axis=1), contacts.tolist(), strict=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(_header(take, units))
        writer.writerows([k, *_rounded(row), *touch] for k, (row, touch) in enumerate(rows))


def _header(take: Take, units: Units) -> list[str]:
    points = [f"{n}_{axis}_{units}" for n in (*take.skeleton.names, "object") for axis in "xyz"]
    return ["frame", "time_s", *points, *(f"object_q{k}" for k in "xyzw"), *_CONTACTS]


def _rounded(row: Float[np.ndarray, " columns"]) -> list[str]:
    return [f"{x:.6f}" for x in row]


@dataclass(frozen=True)
class Exported:
    """The files that were written, and notes about them."""

    files: tuple[Path, ...]
    """One; for BVH also the object's; for BVH and FBX the contacts; for a USD layer the picture."""
    notes: tuple[str, ...]
    """What the user should know about it, in sentences."""
    failures: tuple[str, ...] = ()
    """Takes that are not in a data set of many, and why."""


def export(
    path: Path,
    human: HumanMotion,
    object_motion: ObjectMotion,
    body: BodyModel,
    options: ExportOptions,
    *,
    skeleton: Path | None = None,
    blender: str | None = None,
    reduce_keys: float | None = None,
) -> Exported:
    """Write a motion for another program; all files appear whole or not at all.

    Args:
        path: the file to write.
        human: at 30 fps.
        object_motion: as many frames.
        body: whose bones `human` moves.
        options: how the file shall be; its `sample` is not looked at.
        skeleton: BVH, GLB or FBX whose bones the motion shall move, or a SMPL-X model file.
        blender: executable that writes and reads FBX, if it is not on the PATH.
        reduce_keys: leave out keys while joints stay that near to where they were, mm; GLB only.

    Raises:
        InputError: options do not fit the format or each other, the skeleton is not usable, a
            program or package is missing, or the file cannot be written.
    """
    to = options.to or format_of_ending(path)
    frame = frame_of(to, options.bones, options.up, options.units)
    target = None if skeleton is None else _target(skeleton, blender)
    _check(to, options.bones, target)
    _check_keys(to, reduce_keys)
    program = find_blender(blender) if to is ExportFormat.fbx else ""
    sampled = at_rate(human, object_motion, body, float(options.fps))
    if target is None:
        take, notes = take_on_own_bones(sampled, body, BONE_NAMES[options.bones]), ()
    else:
        take, notes = take_on_target(sampled, body, target)
    files = (path, *_beside(path, to, take))
    with whole_files(*files) as partials:
        within = None if reduce_keys is None else reduce_keys / 1000
        said = {"vrm": options.bones is Bones.vrm, "reduce_to": within}
        _write(partials, files, take, to, frame, said, target, program)
    return Exported(files, notes)


def _target(skeleton: Path, blender: str | None) -> Target:
    if skeleton.suffix.lower() != ".fbx":
        return read_target(skeleton)
    if not skeleton.is_file():
        raise InputError(
            "skeleton-unreadable",
            "There is no such file.",
            where=str(skeleton),
            fix="Check the path of the character.",
        )
    with TemporaryDirectory(prefix="omocap_fbx_") as folder:
        return read_target(read_fbx(skeleton, Path(folder), find_blender(blender)))


def _beside(path: Path, to: ExportFormat, take: Take) -> tuple[Path, ...]:
    """Return what is written beside the file: the object's BVH, contacts, or a USD layer's picture."""
    if to is ExportFormat.bvh:
        return object_file(path), contacts_file(path)
    if to is ExportFormat.fbx:
        return (contacts_file(path),)
    if to is ExportFormat.usd and path.suffix != ".usdz" and take.mesh.texture is not None:
        ending = encoded(take.mesh.texture.image).ending
        return (path.with_name(f"{path.stem}_object.{ending}"),)
    return ()


def object_file(path: Path) -> Path:
    """Return the path of the object's BVH, which lies beside the person's."""
    return path.with_name(f"{path.stem}_object{path.suffix}")


def contacts_file(path: Path) -> Path:
    """Return the path of the table of contacts beside a format that cannot hold them."""
    return path.with_name(f"{path.stem}_contacts.csv")


def _check_keys(to: ExportFormat, reduce_keys: float | None) -> None:
    if reduce_keys is not None and to is not ExportFormat.glb:
        raise InputError(
            "keys-not-reduced",
            f"A {to} file has a key in every frame: only a GLB holds keys of its own for each bone.",
            where=f"‹reduce_keys› {reduce_keys:g}",
            fix="Leave it out, or export ‹to› glb.",
        )


def _check(to: ExportFormat, bones: Bones, target: Target | None) -> None:
    if target is not None and bones is not Bones.smplx:
        raise InputError(
            "bones-and-skeleton",
            "A skeleton brings its own names of bones.",
            where=f"‹bones› {bones}",
            fix="Leave ‹bones› out.",
        )
    foreign = target is not None and target.smplx is None
    if to is ExportFormat.amass and (foreign or bones is not Bones.smplx):
        raise InputError(
            "amass-bones",
            "AMASS files hold SMPL-X poses and no other skeleton's.",
            where="‹skeleton›" if foreign else f"‹bones› {bones}",
            fix="Leave it out, or give a SMPL-X model file with ‹skeleton›.",
        )


def _write(
    partials: tuple[Path, ...],
    files: tuple[Path, ...],
    take: Take,
    to: ExportFormat,
    frame: tuple[UpAxis, Units],
    of_glb: Mapping[str, Any],
    target: Target | None,
    blender: str,
) -> None:
    path, (up, units) = partials[0], frame
    if to in (ExportFormat.bvh, ExportFormat.fbx):
        write_contacts(partials[-1], placed(take, up, units).spans)
    if to is ExportFormat.glb and target is not None and target.character is not None:
        write_character(path, target.character, take, reduce_to=of_glb["reduce_to"])
    elif to is ExportFormat.glb:
        write_glb_take(path, take, **of_glb)
    elif to is ExportFormat.bvh:
        write_bvh(path, partials[1], placed(take, up, units))
    elif to is ExportFormat.usd:
        _write_usd(files, partials, placed(take, up, units), up, units)
    elif to is ExportFormat.fbx:
        write_fbx(path, take, up, units, blender)
    elif to is ExportFormat.amass:
        write_amass(path, take, None if target is None else target.smplx)
    else:
        write_table(path, placed(take, up, units), units)


def _write_usd(
    files: tuple[Path, ...], partials: tuple[Path, ...], take: Take, up: UpAxis, units: Units
) -> None:
    if len(files) == 1 or take.mesh.texture is None:
        write_usd(partials[0], take, up, units)
        return
    partials[1].write_bytes(encoded(take.mesh.texture.image).data)
    write_usd(partials[0], take, up, units, files[1].name)


def export_result(request: ExportRequest, progress: Progress = silent) -> Exported:
    """Write it; all files appear whole or not at all.

    Args:
        request: the result, the file to write or a folder for it, and how the file shall be. AMASS poses
            are for the SMPL-X model that the result was made with, if no skeleton is given.
        progress: told the stage "solve" where the sample was not solved yet.

    Raises:
        InputError: "format-needed", or see `export`; or the result cannot be read or has no such sample.
    """
    to = request.to or _format_of(request.output)
    result = load_result(request.result)
    index = sample_index(result, request.sample)
    result = solved_result(result, [index], progress)
    suffix = "" if request.sample is None else f"_sample_{request.sample}"
    path = target_of(request.output, result.folder.resolve().name + suffix, to)
    skeleton = request.skeleton
    if to is ExportFormat.amass and skeleton is None:
        skeleton = _own_model(result)
    return export(
        path,
        result.people[index].human,
        result.object_motion,
        body_of(result),
        request,
        skeleton=skeleton,
        blender=request.blender,
        reduce_keys=request.reduce_keys,
    )


def _format_of(output: Path) -> ExportFormat:
    if output.is_dir():
        raise InputError(
            "format-needed",
            "Nothing says which format to write.",
            field="to",
            fix="Give ‹to› with a format, such as ‹to› glb, or the name of a file with ‹output›.",
        )
    return format_of_ending(output)


def _own_model(result: Result) -> Path | None:
    given = (Path(item.path) for item in result.manifest.inputs if item.role == "body")
    return next(given, None)
