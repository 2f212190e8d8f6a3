"""The extension in Blender itself, as a user installs and uses it; skipped where there is no bpy."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.characters import WrittenGlb, measured
from capture_app.cli.app import invoke
from omomo_core.array_archive import read_arrays
from tests.rigs import KINDS, make_rig, write_rig

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
SESSION = Path(__file__).with_name("blender_session.py")
OMOCAP = Path(sys.executable).with_name("omocap")
REACHING = ("mixamo", "unreal", "rigify", "tall")
"""Characters whose limbs are long enough for the demo."""


def blender_python() -> Path | None:
    """A Python with bpy: BLENDER_PYTHON, or that of tools/check_in_blender.sh."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    given = os.environ.get("BLENDER_PYTHON")
    path = Path(given) if given else cache / "omocap" / "bpy-5.0.1" / "bin" / "python"
    return path if path.is_file() else None


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The extension's zip and the demo's result."""
    if blender_python() is None:
        pytest.skip("no Python with bpy: set BLENDER_PYTHON, or run tools/check_in_blender.sh")
    folder = tmp_path_factory.mktemp("blender")
    assert invoke(["blender-extension", "-o", str(folder / "omocap.zip")]) == 0
    assert invoke(["demo", "-o", str(folder / "demo")]) == 0
    return folder


def session(what: str, place: Path, *rigs: Path) -> dict[str, Any]:
    words = [blender_python(), SESSION, what, place / "omocap.zip", OMOCAP, place / "demo", place]
    resources = {**os.environ, "BLENDER_USER_RESOURCES": str(place / "resources")}
    done = subprocess.run(
        [str(word) for word in (*words, *rigs)], env=resources, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:] + done.stdout[-2000:]
    return json.loads(done.stdout.strip().splitlines()[-1])


def test_a_result_comes_in_with_person_object_and_contacts(place: Path) -> None:
    found = session("import", place)
    assert "is no result folder" in found["nothing"]
    assert "Preferences" in found["missing"]
    assert found["range"] == [1, 348, 30]
    assert found["loose"]
    assert found["panel"] == [True, True]
    rows, motion = np.array(found["rows"]), read_arrays(place / "demo" / "motion.npz")
    best = int(motion["chosen"])
    np.testing.assert_allclose(rows[:, :3], motion["root"][best], atol=1e-4)
    np.testing.assert_allclose(rows[:, 3:6], motion["object_position"], atol=1e-4)
    np.testing.assert_array_equal(rows[:, 8:], motion["foot_contact"][best] > 0.5)
    held = rows[:, 6:8] > 0.5
    assert (held <= (motion["hand_contact"][best] > 0.5)).all()
    for side in ("left", "right"):
        starts = [frame for name, frame in found["markers"] if name == f"{side} hand holds"]
        column = ("left", "right").index(side)
        assert starts == [1 + int(held[:, column].argmax())]


def test_a_motion_is_baked_to_characters_that_stand_anywhere(place: Path) -> None:
    files = []
    for name in REACHING:
        rig = make_rig(KINDS[name])
        palms = {
            side: (rig.palms[k] - rig.positions[rig.joints[f"{side}_wrist"]]).tolist()
            for k, side in enumerate(("left", "right"))
        }
        files.append(write_rig(rig, place / f"{name}.glb"))
        files[-1].with_suffix(".json").write_text(json.dumps({"named": {}, **palms}))
    found = session("bake", place, *files)
    assert set(found) == {*REACHING, "metarig"}
    for name, one in found.items():
        assert one["helpers"] == [], name
        assert one["palm"] < 5, name
        assert one["sole"] < 5, name
        assert one["slide"] < 1, name


def test_the_person_is_made_for_an_object_of_the_scene(place: Path) -> None:
    found = session("person", place)
    assert found["range"] == [11, 107, 24]
    assert "Crate" not in found["things"]
    assert len(found["things"]) == 2
    palms = np.array(found["palms"])
    assert len(palms) > 40
    # In the axes of the crate, whose size is its scale, a palm that holds stays where it is.
    for side in (0, 1):
        at = palms[palms[:, 0] == side, 1:] * [0.3, 0.5, 0.3]
        assert np.abs(at - np.median(at, axis=0)).max() < 0.005


def test_a_character_may_be_an_fbx(place: Path) -> None:
    """Converted by a `blender` command, which here is the Python that has bpy."""
    names = ("mixamo", "rigify")
    files = [write_rig(make_rig(KINDS[name]), place / f"{name}_fbx.glb") for name in names]
    session("fbx", place, *files)
    blender = place / "blender"
    blender.write_text(
        '#!/bin/sh\nwhile [ "$1" != --python ]; do shift; done\nshift\n'
        f'exec "{blender_python()}" "$@"\n'
    )
    blender.chmod(0o755)
    for name, file in zip(names, files, strict=True):
        moved = place / f"{name}_moved.glb"
        words = ["export", str(place / "demo"), "--skeleton", str(file.with_suffix(".fbx"))]
        assert invoke([*words, "--blender", str(blender), "-o", str(moved)]) == 0
        palms, soles, slides = measured(WrittenGlb(moved, 30.0), make_rig(KINDS[name]))
        assert (palms.max() < 5e-3, soles.max() < 5e-3, slides.max() < 1e-3) == (True,) * 3
