"""Runs of objects that were animated instead of filmed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from capture_app.exports.glb import write_glb
from capture_app.prepare import prepare_take
from capture_app.result import load_result
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMotion

# `inputs` writes the files of a good take: see conftest.py.
Inputs = Any


def poses() -> np.ndarray:
    """Two seconds: the box of `inputs` (0.3 m high) stands, is lifted, turned and put down."""
    lift = np.clip(np.sin(np.pi * (2 * np.linspace(0, 1, 61) - 0.5)), 0, None)
    T = np.tile(np.eye(4), (61, 1, 1))
    T[:, :3, 3] = np.stack([0.3 * lift, 0 * lift, 0.15 + 0.4 * lift], axis=1)
    T[:, :3, :3] = Rotation.from_rotvec(np.outer(lift, [0, 0, 0.8])).as_matrix()
    return T


def as_rows() -> np.ndarray:
    T = poses()
    q = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    return np.concatenate([np.arange(61)[:, None] / 30, T[:, :3, 3], q], axis=1)


def as_csv(folder: Path) -> Path:
    rows = "\n".join(",".join(map(str, row)) for row in as_rows())
    (folder / "a.csv").write_text(f"time,x,y,z,qx,qy,qz,qw\n{rows}\n")
    return folder / "a.csv"


def as_npz(folder: Path) -> Path:
    np.savez(folder / "a.npz", T_world_object=poses(), fps=30, up="z")
    return folder / "a.npz"


def as_tum(folder: Path) -> Path:
    np.savetxt(folder / "a.txt", as_rows(), "%.9f")
    return folder / "a.txt"


KINDS = [as_csv, as_npz, as_tum]


@pytest.mark.parametrize("write", KINDS)
def test_every_kind_is_prepared(
    inputs: Inputs, weights: Path, write: Callable[[Path], Path]
) -> None:
    session = write(inputs.folder)
    said = {"session": session, "mount": None, "animated": True}
    request = inputs.request(weights).model_copy(update=said)
    prepared = prepare_take(request)
    np.testing.assert_allclose(prepared.motion.T_world_object, poses(), atol=1e-6)
    assert prepared.mount.method == "none"
    assert (prepared.segment.start, prepared.segment.stop) == (0, 61)
    with pytest.raises(InputError) as caught:
        prepare_take(request.model_copy(update={"object": None}))
    assert caught.value.code == "object-needed"


@pytest.fixture
def result_glb(inputs: Inputs, human, body) -> tuple[Path, ObjectMotion]:
    """What we export ourselves: a person and an object in one GLB."""
    from ingest.mesh import load_mesh

    T = poses()[:40]
    moved = ObjectMotion(load_mesh(inputs.mesh), T, np.ones(40, bool))
    write_glb(inputs.folder / "motion.glb", human, moved, body)
    return inputs.folder / "motion.glb", moved


def test_the_object_of_our_own_glb_is_found(inputs: Inputs, weights: Path, result_glb) -> None:
    path, moved = result_glb
    said = {"session": path, "object": None, "mount": None, "animated": True, "node": "object"}
    request = inputs.request(weights).model_copy(update=said)
    prepared = prepare_take(request)
    T, mesh = prepared.motion.T_world_object, prepared.motion.mesh
    assert len(T) == 40
    assert len(mesh.vertices) == 8
    for k in (0, 25):
        found = mesh.vertices @ T[k, :3, :3].T + T[k, :3, 3]
        R, place = moved.T_world_object[k, :3, :3], moved.T_world_object[k, :3, 3]
        expected = moved.mesh.vertices @ R.T + place
        for points in (found, expected):
            points[:] = points[np.lexsort(points.T.round(4))]
        np.testing.assert_allclose(found, expected, atol=1e-5)


def command(inputs: Inputs, weights: Path, session: Path, *more: str) -> list[str]:
    quick = ["--weights", str(weights), "--samples", "1", "--steps", "2", "--no-video"]
    return ["run", str(session), "-o", str(inputs.output), *quick, *more]


def test_run_and_rerun(inputs: Inputs, weights: Path) -> None:
    words = command(inputs, weights, as_tum(inputs.folder), "--object", str(inputs.mesh))
    assert invoke(words) == 0
    made = load_result(inputs.output)
    np.testing.assert_allclose(made.object_motion.T_world_object, poses(), atol=1e-5)
    assert made.manifest.mount_method == "none"
    assert {item.role for item in made.manifest.inputs} == {"session", "object"}
    again = inputs.folder / "again"
    assert invoke(["rerun", str(inputs.output), "-o", str(again)]) == 0
    assert (again / "motion.npz").read_bytes() == (inputs.output / "motion.npz").read_bytes()


def test_a_node_is_run_again(inputs: Inputs, weights: Path, result_glb) -> None:
    assert invoke(command(inputs, weights, result_glb[0], "--node", "object")) == 0
    again = inputs.folder / "again"
    assert invoke(["rerun", str(inputs.output), "-o", str(again)]) == 0
    assert (again / "motion.npz").read_bytes() == (inputs.output / "motion.npz").read_bytes()


def test_what_does_not_belong_together_is_refused(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    mesh, mount = ["--object", str(inputs.mesh)], ["--mount", str(inputs.mount)]
    npz, tum = as_npz(inputs.folder), as_tum(inputs.folder)
    for session, words, code in (
        (npz, [*mesh, *mount], "mount-unused"),
        (npz, [*mesh, "--mount", "identity"], "mount-unused"),
        (npz, [], "object-needed"),
        (tum, [], "object-needed"),
        (npz, [*mesh, "--node", "Chair"], "node-unused"),
        (npz, [*mesh, "--floor", "0.5"], "floor-above-object"),
        (inputs.session, mount, "object-needed"),
        (inputs.session, [*mesh, *mount, "--node", "Chair"], "node-unused"),
        (inputs.session, mesh, "mount-needed"),
    ):
        assert invoke(command(inputs, weights, session, *words)) == 2
        printed = capsys.readouterr()
        assert f"code: {code}" in printed.err
        assert not inputs.output.exists()
