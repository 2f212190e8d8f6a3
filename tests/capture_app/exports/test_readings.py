"""What docs/format.md says of Blender, in Blender itself; skipped where there is no bpy."""

import json
import subprocess
from pathlib import Path

import pytest

from capture_app.cli.app import invoke
from tests.capture_app.blender_extension.test_in_real_blender import blender_python

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict:
    python = blender_python()
    if python is None:
        pytest.skip("no Python with bpy: set BLENDER_PYTHON, or run tools/check_in_blender.sh")
    folder = tmp_path_factory.mktemp("readings")
    program = folder / "blender"
    program.write_text(
        '#!/bin/sh\nwhile [ "$1" != --python ]; do shift; done\nshift\n' + f'exec "{python}" "$@"\n'
    )
    program.chmod(0o755)
    assert invoke(["demo", "-o", str(folder / "demo")]) == 0
    for ending in ("glb", "usdc", "fbx", "bvh"):
        words = ["export", str(folder / "demo"), "-o", str(folder / f"take.{ending}")]
        words += ["--blender", str(program)] if ending == "fbx" else []
        assert invoke(words) == 0
    script = Path(__file__).with_name("blender_readings.py")
    done = subprocess.run([python, script, folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.strip().splitlines()[-1])


def test_only_fbx_sets_the_frame_rate(found):
    assert {one: found[one]["fps"] for one in ("glb", "usdc", "bvh", "fbx")} == {
        "glb": 24,
        "usdc": 24,
        "bvh": 24,
        "fbx": 30,
    }


def test_glb_and_usd_begin_at_frame_0_and_fbx_and_bvh_at_1(found):
    starts = {one: found[one]["starts"] for one in ("glb", "usdc", "fbx", "bvh")}
    assert starts == {"glb": [0.0], "usdc": [0.0], "fbx": [1.0], "bvh": [1.0]}


def test_the_object_of_a_usd_file_is_read_in_every_frame_and_has_no_keys(found):
    assert found["usdc"]["constraints"] == ["TRANSFORM_CACHE"]
    assert not [name for name in found["usdc"]["keyed"] if name.startswith("object")]
    assert [name for name in found["glb"]["keyed"] if name.startswith("object")]


def test_written_again_a_glb_has_lost_its_copyright_and_keeps_the_credit_of_the_body(found):
    assert "copyright" not in found["again"]["asset"]
    assert len(found["again"]["credits"]) == len(found["glb"]["credits"]) == 1
