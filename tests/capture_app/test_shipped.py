"""What ships, used as a user would: the demonstration take and real phone logs, with the weights."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from capture_app.commands.run import RunRequest
from capture_app.pipeline import run_take
from capture_app.result import Result
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION, box_mesh, carried_box
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS


def run(
    session: Path, mesh: Path, mount: Path | None, output: Path, *, force: bool = False
) -> Result:
    request = RunRequest(
        session=session,
        object=mesh,
        mount=mount,
        output=output,
        samples=2,
        video_size=None,
        force=force,
    )
    return run_take(request, lambda stage, done: None)


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return run(DEMO / SESSION, DEMO / MESH, DEMO / MOUNT, tmp_path_factory.mktemp("demo") / "out")


def test_the_demo_recording_gives_back_the_motion_it_was_made_from(demo: Result):
    truth, found = carried_box().T_world_object, demo.object_motion.T_world_object
    assert abs(len(truth) - len(found)) <= 1
    count = min(len(truth), len(found))
    # The phone drifts by half a per cent of its 5 m; heading and origin are the session's own.
    heights = found[:count, 2, 3] - truth[:count, 2, 3]
    assert np.abs(heights).max() < 0.04
    steps = np.linalg.norm(np.diff(found[:count, :3, 3], axis=0), axis=1)
    true_steps = np.linalg.norm(np.diff(truth[:count, :3, 3], axis=0), axis=1)
    assert np.abs(steps.sum() - true_steps.sum()) < 0.5


def test_in_the_demo_a_person_carries_the_box(demo: Result):
    human, motion = demo.motions[demo.manifest.chosen], demo.object_motion
    carried = motion.T_world_object[:, 2, 3] > 0.5
    assert carried.sum() > 4 * FPS
    # Held all the way, by both hands, at its surface.
    assert human.hand_contact[carried].max(axis=1).mean() > 0.95
    T = inverse(motion.T_world_object)
    local = np.einsum("fij,fhj->fhi", T[:, :3, :3], human.joints[:, 22:]) + T[:, None, :3, 3]
    beyond = np.abs(local[carried]) - box_mesh().vertices.max(axis=0)
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=-1)
    gap = np.abs(outside + np.minimum(beyond.max(axis=-1), 0))
    assert np.median(gap) < 0.03
    assert gap.max() < 0.1
    # Upright, on the floor, walking with the box and not gliding.
    walking = motion.T_world_object[:, 2, 3] > 0.95
    assert human.joints[walking, 15, 2].min() > 1.3
    toes = human.joints[:, (10, 11), 2]
    assert toes.min() > 0.0
    assert np.percentile(toes.min(axis=1), 95) < 0.08
    speed = FPS * np.linalg.norm(np.diff(human.joints[:, (7, 8), :2], axis=0), axis=-1)
    standing = speed.min(axis=1)
    assert np.median(standing[walking[1:]]) < 0.15


@pytest.mark.parametrize(
    ("log", "seconds"),
    [
        pytest.param("ios_logger_pyojinkim", 43.7, marks=pytest.mark.slow),
        pytest.param("arkit_data_logger/ARKit_camera_pose.txt", 46.0, marks=pytest.mark.slow),
        ("arkit_data_logger/ARKit_camera_pose_LARR_letters.txt", 27.5),
    ],
)
def test_real_phone_logs(shared: Path, tmp_path: Path, log: str, seconds: float):
    mesh = tmp_path / "box.ply"
    box = trimesh.creation.box((0.4, 0.4, 0.4))
    box.apply_translation((0.0, -0.2, 0.0)).export(mesh)
    session = shared / "data" / "capture" / log
    with pytest.raises(InputError, match=r"so the floor is a guess|taken as the floor"):
        run(session, mesh, None, tmp_path / "refused")
    result = run(session, mesh, None, tmp_path / "out", force=True)
    human = result.motions[result.manifest.chosen]
    assert abs(len(human.root) / FPS - seconds) < 0.2
    assert np.isfinite(human.joints).all()
    # The person goes where the phone went, and the guessed floor is said to be one.
    way = np.linalg.norm(human.root[:, :2] - result.object_motion.T_world_object[:, :2, 3], axis=1)
    assert way.max() < 1.2
    assert any("floor" in note.lower() for note in result.manifest.notes)
    assert (tmp_path / "out" / "motion.glb").stat().st_size > 500_000
