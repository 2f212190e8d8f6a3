"""What of the Blender extension needs no Blender: its zip, its calls of omocap, the names of bones."""

import stat
import sys
import time
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from capture_app.blender_extension.bone_names import JOINTS, recognised
from capture_app.blender_extension.omocap_job import (
    ExtensionFailure,
    OmocapCall,
    OmocapJob,
    Steps,
    free_folder,
    samples_of,
)
from capture_app.cli.app import invoke
from omomo_core.skeleton import ALL_JOINTS
from tests.rigs import KINDS, make_rig


@pytest.mark.runs("blender-extension")
def test_the_zip_is_what_blender_installs(tmp_path: Path) -> None:
    assert invoke(["blender-extension", "-o", str(tmp_path / "omocap.zip")]) == 0
    with zipfile.ZipFile(tmp_path / "omocap.zip") as packed:
        manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
        code = {n: packed.read(n).decode() for n in packed.namelist() if n.endswith(".py")}
    assert manifest["schema_version"] == "1.0.0"
    assert manifest["blender_version_min"] == "4.5.0"
    assert manifest["version"] == version("omocap")
    assert manifest["license"] == ["SPDX:Apache-2.0"]
    assert set(manifest["permissions"]) == {"files"}
    # What Blender refuses: a tagline or a reason that is long or ends in a full stop.
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(text) <= 64
        assert text[-1].isalnum()
    assert {"__init__.py", "blender_export.py", "bone_names.py"} <= set(code)
    assert [n for n, text in code.items() if "from capture_app" in text] == []


def test_a_zip_of_another_ending_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["blender-extension", "-o", str(tmp_path / "omocap.tar")]) == 2
    assert ".zip" in capsys.readouterr().err


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if not kind.vrm])
def test_bones_of_others_are_recognised(name: str) -> None:
    rig = make_rig(KINDS[name])
    assert recognised(rig.names) == rig.joints


def test_names_stand_in_the_order_that_is_shown() -> None:
    assert sorted(JOINTS) == sorted(ALL_JOINTS)
    names = ["hip", "lThigh", "lShin", "lFoot", "rShldr", "rForeArm", "rHand", "lMid1", "abdomen"]
    found = recognised(names)
    assert found["left_middle1"] == 7
    assert found["right_shoulder"] == 4
    assert recognised(["spine", "spine.001", "upper_arm.L", "f_index.02.R"])["right_index2"] == 3


@pytest.fixture
def program(tmp_path: Path) -> str:
    """A stand-in for omocap: it does what its first word says."""
    path = tmp_path / "omocap"
    path.write_text(
        f"#!{sys.executable}\nimport sys, time\nwhat, *rest = sys.argv[1:]\n"
        "if what == 'wait':\n"
        "    bar = '\\x1b[1mFitting the body  \\x1b[35m━━━━╸\\x1b[0m━━━  42% 0:00:01'\n"
        "    print(bar, end='\\r', flush=True)\n"
        "    time.sleep(60)\n"
        "if what == 'fail':\n"
        "    sys.exit(print('Reading 10%\\rError: no floor\\n  where: a.glb\\n  fix: look') or 2)\n"
        "print('Note: too short')\nopen(rest[0], 'w').write('done')\n"
    )
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def test_steps_follow_one_another(program: str, tmp_path: Path) -> None:
    seen: list[str] = []

    def steps() -> Steps:
        for name in ("a", "b"):
            yield ["write", str(tmp_path / name)]
            seen.append((tmp_path / name).read_text())

    job = OmocapJob(program, steps(), [])
    job.run()
    assert seen == ["done", "done"]
    assert job.notes == ["too short", "too short"]


def test_a_failure_is_told_in_omocaps_words(program: str) -> None:
    ended: list[bool] = []

    def steps() -> Steps:
        try:
            yield ["fail"]
        finally:
            ended.append(True)

    with pytest.raises(ExtensionFailure, match=r"no floor\nwhere: a\.glb\nfix: look"):
        OmocapJob(program, steps(), []).run()
    assert ended == [True]


def test_a_program_that_is_not_there_is_named() -> None:
    with pytest.raises(ExtensionFailure, match=r"no program '/no/omocap'.*Preferences"):
        OmocapCall(["/no/omocap", "run"])


def test_progress_is_read_and_work_is_cancelled(program: str) -> None:
    def steps() -> Steps:
        yield ["wait"]

    job = OmocapJob(program, steps(), [])
    end = time.monotonic() + 20
    while job.advance() and job.progress[1] == 0 and time.monotonic() < end:
        time.sleep(0.02)
    assert job.progress == ("Fitting the body", 0.42)
    job.cancel()
    assert time.monotonic() < end


def test_samples_of_a_result_are_counted(tmp_path: Path) -> None:
    assert samples_of(str(tmp_path)) == (0, 0)
    (tmp_path / "manifest.json").write_text('{"scores": [{}, {}, {}], "chosen": 1}')
    assert samples_of(str(tmp_path)) == (3, 1)


def test_an_earlier_result_is_not_overwritten(tmp_path: Path) -> None:
    assert free_folder(tmp_path / "a") == tmp_path / "a"
    (tmp_path / "a").mkdir()
    (tmp_path / "a_2").mkdir()
    assert free_folder(tmp_path / "a") == tmp_path / "a_3"
