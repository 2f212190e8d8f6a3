"""What may be asked for, what is refused, and that no half file is ever left."""

import errno
import shutil
import stat
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel

from capture_app.blender_extension.bone_names import BONE_NAMES
from capture_app.commands.export import Bones, ExportFormat, ExportOptions
from capture_app.exports import export_sample as exporting
from capture_app.exports.export_formats import FORMATS, format_of_ending, frame_of, target_of
from capture_app.exports.export_sample import contacts_file, export, object_file
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.skeleton import ALL_JOINTS

Write = Any


@pytest.fixture
def write(small_motion: Any, shipped: BodyModel) -> Write:
    human, moved = small_motion(2)

    def write(path: Path, to: ExportFormat, **said: Any) -> Any:
        programs = {name: said.pop(name, None) for name in ("skeleton", "blender", "reduce_keys")}
        return export(path, human, moved, shipped, ExportOptions(to=to, **said), **programs)

    return write


@pytest.mark.parametrize("bones", list(Bones))
def test_every_joint_has_one_name_in_every_program(bones: Bones) -> None:
    names = BONE_NAMES[bones].of
    assert set(names) == set(ALL_JOINTS)
    assert len(set(names.values())) == len(names)


def test_programs_expect_what_they_are_given() -> None:
    assert frame_of(ExportFormat.bvh, Bones.smplx, None, None) == ("y", "cm")
    assert frame_of(ExportFormat.usd, Bones.smplx, None, None) == ("z", "m")
    assert frame_of(ExportFormat.usd, Bones.unreal, None, None) == ("z", "cm")
    assert frame_of(ExportFormat.usd, Bones.unity, None, None) == ("y", "m")
    assert frame_of(ExportFormat.usd, Bones.unreal, "y", "m") == ("y", "m")
    assert frame_of(ExportFormat.csv, Bones.unreal, None, None) == ("z", "m")


@pytest.mark.parametrize(
    ("kind", "up", "units"),
    [
        (ExportFormat.glb, "z", None),
        (ExportFormat.glb, None, "cm"),
        (ExportFormat.amass, "y", None),
    ],
)
def test_axes_that_a_format_does_not_have_are_refused(
    kind: ExportFormat, up: Any, units: Any
) -> None:
    with pytest.raises(InputError) as caught:
        frame_of(kind, Bones.smplx, up, units)
    assert caught.value.code == "frame-fixed"


def test_collada_is_answered_with_glb(write: Write, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        write(tmp_path / "a.dae", ExportFormat.dae)
    assert caught.value.code == "format-not-written"
    assert "glb" in caught.value.fix


def test_names_of_files(tmp_path: Path) -> None:
    assert target_of(tmp_path, "chair", ExportFormat.usd) == tmp_path / "chair.usdc"
    assert target_of(tmp_path, "chair", ExportFormat.bvh) == tmp_path / "chair.bvh"
    assert target_of(Path("a.USDA"), "chair", ExportFormat.usd) == Path("a.USDA")
    with pytest.raises(InputError, match="must end in"):
        target_of(Path("a.fbx"), "chair", ExportFormat.glb)


def test_an_ending_says_the_format() -> None:
    for kind, form in FORMATS.items():
        assert [format_of_ending(Path(f"chair{ending}")) for ending in form.endings] == [
            kind
        ] * len(form.endings)
    assert format_of_ending(Path("chair.GLB")) is ExportFormat.glb
    for name in ("chair", "chair.dae", "chair.mp4"):
        with pytest.raises(InputError, match=r"\.glb.*\.bvh") as caught:
            format_of_ending(Path(name))
        assert caught.value.code == "output-ending"


def test_amass_takes_no_other_names(write: Write, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        write(tmp_path / "a.npz", ExportFormat.amass, bones=Bones.unity)
    assert caught.value.code == "amass-bones"


def test_a_skeleton_brings_its_names(write: Write, tmp_path: Path) -> None:
    write(tmp_path / "own.glb", ExportFormat.glb)
    with pytest.raises(InputError) as caught:
        write(tmp_path / "a.glb", ExportFormat.glb, bones=Bones.vrm, skeleton=tmp_path / "own.glb")
    assert caught.value.code == "bones-and-skeleton"


@pytest.mark.parametrize("kind", [k for k in FORMATS if k is not ExportFormat.fbx])
def test_a_full_disk_leaves_nothing(
    write: Write, tmp_path: Path, kind: ExportFormat, monkeypatch: pytest.MonkeyPatch
) -> None:
    ending = FORMATS[kind].endings[0]
    path = tmp_path / f"a{ending}"
    path.write_text("what was there")

    def full(partials: tuple[Path, ...], *rest: Any) -> None:
        partials[0].write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(exporting, "_write", full)
    with pytest.raises(InputError) as caught:
        write(path, kind)
    assert caught.value.code == "disk-full"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "what was there"


def test_a_folder_is_no_file(write: Write, tmp_path: Path) -> None:
    (tmp_path / "a.glb").mkdir()
    with pytest.raises(InputError) as caught:
        write(tmp_path / "a.glb", ExportFormat.glb)
    assert caught.value.code == "output-is-folder"
    with pytest.raises(InputError) as caught:
        write(tmp_path / "none" / "a.glb", ExportFormat.glb)
    assert caught.value.code == "output-not-writable"


def test_bvh_says_where_object_and_contacts_went(write: Write, tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    assert write(path, ExportFormat.bvh).files == (path, object_file(path), contacts_file(path))
    assert {p.name for p in tmp_path.iterdir()} == {"a.bvh", "a_object.bvh", "a_contacts.csv"}


def test_keys_are_reduced_in_a_glb_only(write: Write, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        write(tmp_path / "a.usda", ExportFormat.usd, reduce_keys=5.0)
    assert caught.value.code == "keys-not-reduced"


def test_usd_skins_the_body(write: Write, tmp_path: Path) -> None:
    write(tmp_path / "a.usda", ExportFormat.usd)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    body = stage.GetPrimAtPath("/take/person/body")
    binding = UsdSkel.BindingAPI(body)
    weights = np.array(binding.GetJointWeightsPrimvar().Get()).reshape(-1, 4)
    points = UsdGeom.Mesh(body).GetPointsAttr().Get()
    assert len(weights) == len(points)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert stage.GetDefaultPrim().GetPath() == "/take"
    report = Usd.Stage.Open(str(tmp_path / "a.usda")).GetRootLayer().documentation
    assert "CC0" in report


def test_vrm_names_are_an_animation_of_vrm(write: Write, tmp_path: Path, read_glb: Any) -> None:
    write(tmp_path / "a.vrma", ExportFormat.glb, bones=Bones.vrm)
    gltf = read_glb(tmp_path / "a.vrma").gltf
    bones = gltf.extensions["VRMC_vrm_animation"]["humanoid"]["humanBones"]
    assert gltf.extensionsUsed == ["VRMC_vrm_animation"]
    for name, bone in bones.items():
        assert gltf.nodes[bone["node"]].name == name
    moved = {c.target.node for c in gltf.animations[0].channels if c.target.path == "translation"}
    assert moved == {bones["hips"]["node"], len(gltf.nodes) - 1}


def test_unreals_root_follows_on_the_floor(write: Write, tmp_path: Path, read_glb: Any) -> None:
    write(tmp_path / "a.glb", ExportFormat.glb, bones=Bones.unreal)
    reader = read_glb(tmp_path / "a.glb")
    frames = len(reader.times())
    root, pelvis = (reader.world(n, frames=frames)[:, :3, 3] for n in ("root", "pelvis"))
    np.testing.assert_allclose(root[:, 1], 0.0, atol=1e-6)
    np.testing.assert_allclose(root[:, [0, 2]], pelvis[:, [0, 2]], atol=1e-5)


def test_fbx_without_blender_is_told(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    for blender in (None, "/nowhere/blender"):
        with pytest.raises(InputError) as caught:
            write(tmp_path / "a.fbx", ExportFormat.fbx, blender=blender)
        assert caught.value.code == "blender-missing"
    assert not list(tmp_path.iterdir())


def fake_blender(folder: Path, script: str) -> str:
    path = folder / "blender"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def test_fbx_is_what_blender_wrote(write: Write, tmp_path: Path) -> None:
    """A stand-in that is called as Blender is; the real one is checked by tools/check_in_blender.sh."""
    script = 'while [ "$1" != -- ]; do shift; done; head -c 4 "$2" > "$3"; echo "$4 $5 $6" >> "$3"'
    blender = fake_blender(tmp_path, script)
    write(tmp_path / "a.fbx", ExportFormat.fbx, blender=blender, fps=24, up="z")
    assert (tmp_path / "a.fbx").read_text() == "glTF24 z cm\n"


def test_a_blender_that_fails_is_told(write: Write, tmp_path: Path) -> None:
    blender = fake_blender(tmp_path, "echo 'no such operator' >&2; exit 1")
    with pytest.raises(InputError, match="no such operator") as caught:
        write(tmp_path / "a.fbx", ExportFormat.fbx, blender=blender)
    assert caught.value.code == "blender-failed"
    assert not (tmp_path / "a.fbx").exists()
