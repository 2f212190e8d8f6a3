"""The whole way from a phone's log to a result folder, with untrained weights."""

from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.manifest import read_manifest
from capture_app.pipeline import run_take
from capture_app.rerun import request_of
from capture_app.result import body_of, load_result
from omomo_core.errors import OmocapError
from tests.video_frames import read_frames

# `inputs` writes the files of a good take: see conftest.py.
Inputs = Any


def silent(stage: str, fraction: float) -> None:
    """Nobody listens."""


def test_a_take_becomes_a_result_folder(inputs: Inputs, weights: Path) -> None:
    heard: list[tuple[str, float]] = []
    request = inputs.request(weights).model_copy(update={"video_size": (96, 64), "height": 1.6})
    made = run_take(request, lambda stage, fraction: heard.append((stage, fraction)))

    names = ["contacts.json", "manifest.json", "motion.glb", "motion.mp4", "motion.npz"]
    assert sorted(path.name for path in inputs.output.iterdir()) == names
    # The result stands before its video is drawn.
    stages = [*made.manifest.timings, "video"]
    assert list(dict.fromkeys(stage for stage, _ in heard)) == stages
    assert {stage: f for stage, f in heard} == dict.fromkeys(stages, 1.0)

    frames = len(made.object_motion.valid)
    assert frames == 91
    assert {m.joints.shape for m in made.motions} == {(frames, 24, 3)}
    assert len(made.motions) == len(made.manifest.scores) == 2
    with av.open(str(inputs.output / "motion.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == frames


def test_the_video_is_seen_from_where_it_is_asked_for(inputs: Inputs, weights: Path) -> None:
    asked = {"video_size": (96, 64), "samples": 1}
    first = run_take(inputs.request(weights).model_copy(update=asked), silent)
    again = {"replace": True, "video_view": "top"}
    usual = read_frames(first.folder / "motion.mp4", [0])[0].astype(int)
    above = run_take(inputs.request(weights).model_copy(update=asked | again), silent)
    seen = read_frames(above.folder / "motion.mp4", [0])[0].astype(int)
    assert np.abs(usual - seen).max() > 40
    for was, now in zip(first.motions, above.motions, strict=True):
        np.testing.assert_array_equal(was.joints, now.joints)
    assert request_of(above.manifest, inputs.output).video_view == "top"


def test_the_object_moves_as_the_phone_did(inputs: Inputs, weights: Path) -> None:
    T_phone_object = np.eye(4)
    T_phone_object[:3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    T_phone_object[:3, 3] = [0.0, -0.1, -0.05]
    inputs.write_mount(T_phone_object)
    made = run_take(inputs.request(weights), silent)
    poses = np.loadtxt(inputs.session / "ARposes.txt", delimiter=",")[::2]
    R_arkit_phone = Rotation.from_quat(poses[:, [5, 6, 7, 4]])
    in_arkit = R_arkit_phone.apply(T_phone_object[:3, 3]) + poses[:, 1:4]
    z_up = np.stack([in_arkit[:, 0], -in_arkit[:, 2], in_arkit[:, 1]], axis=1)
    moved = made.object_motion.T_world_object[:, :3, 3]
    # The log's noise, a tenth of a millimetre, is smoothed.
    np.testing.assert_allclose(moved - moved[0], z_up - z_up[0], atol=5e-4)
    assert made.manifest.mount_method == "made up"
    assert made.manifest.floor.source == "rest"
    lowest = made.object_motion.mesh.vertices @ made.object_motion.T_world_object[0, 2, :3]
    assert abs((lowest + moved[0, 2]).min()) < 0.005


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not(
    inputs: Inputs, weights: Path
) -> None:
    request = inputs.request(weights)
    run_take(request, silent)
    run_take(request.model_copy(update={"output": inputs.folder / "again"}), silent)
    run_take(request.model_copy(update={"output": inputs.folder / "other", "seed": 1}), silent)
    for name in ("motion.npz", "motion.glb"):
        first = (inputs.output / name).read_bytes()
        assert (inputs.folder / "again" / name).read_bytes() == first
        assert (inputs.folder / "other" / name).read_bytes() != first


def test_a_manifest_makes_the_same_motion_again(inputs: Inputs, weights: Path) -> None:
    run_take(
        inputs.request(weights).model_copy(
            update={"height": 1.9, "floor": -1.3, "up": (0.0, 1.0, 0.0)}
        ),
        silent,
    )
    manifest = read_manifest(inputs.output / "manifest.json")
    run_take(request_of(manifest, inputs.folder / "again"), silent)
    first = (inputs.output / "motion.npz").read_bytes()
    assert (inputs.folder / "again" / "motion.npz").read_bytes() == first


def test_a_result_of_before_samples_were_solved_later_solves_all_again(
    inputs: Inputs, weights: Path
) -> None:
    manifest = run_take(inputs.request(weights), silent).manifest
    assert request_of(manifest, inputs.folder / "again").solve == "shown"
    before = {name: value for name, value in manifest.options.items() if name != "solve"}
    older = manifest.model_copy(update={"options": before})
    assert request_of(older, inputs.folder / "again").solve == "all"


def test_a_changed_input_is_not_run_again_silently(inputs: Inputs, weights: Path) -> None:
    run_take(inputs.request(weights), silent)
    manifest = read_manifest(inputs.output / "manifest.json")
    inputs.mount.write_text(inputs.mount.read_text() + "\n")
    with pytest.raises(OmocapError) as caught:
        request_of(manifest, inputs.folder / "again")
    assert caught.value.code == "input-changed"
    inputs.mount.unlink()
    with pytest.raises(OmocapError) as caught:
        request_of(manifest, inputs.folder / "again")
    assert caught.value.code == "input-missing"


def test_the_body_of_a_result_has_its_height(inputs: Inputs, weights: Path) -> None:
    run_take(inputs.request(weights).model_copy(update={"height": 1.5}), silent)
    result = load_result(inputs.output)
    assert body_of(result).height == pytest.approx(1.5, abs=1e-6)


def test_a_split_take_uses_the_longest_segment_and_says_so(inputs: Inputs, weights: Path) -> None:
    poses = np.loadtxt(inputs.session / "ARposes.txt", delimiter=",")
    poses[70:, 1] += 1.5  # relocalised after 1.17 s
    np.savetxt(inputs.session / "ARposes.txt", poses, "%.6f", ",")
    with pytest.raises(OmocapError) as caught:  # under three seconds are left
        run_take(inputs.request(weights), silent)
    assert caught.value.code == "take-bad"
    forced = inputs.request(weights).model_copy(update={"force": True})
    made = run_take(forced, silent)
    segment = made.manifest.segment
    assert (segment.index, segment.count) == (2, 2)
    assert made.object_motion.start_time == pytest.approx(segment.start / 30)
    assert any("‹segment›" in note for note in made.manifest.notes)

    first = forced.model_copy(update={"output": inputs.folder / "first", "segment": 1})
    made = run_take(first, silent)
    assert (made.manifest.segment.start, made.object_motion.start_time) == (0, 0.0)
    third = first.model_copy(update={"output": inputs.folder / "third", "segment": 3})
    with pytest.raises(OmocapError) as caught:
        run_take(third, silent)
    assert caught.value.code == "segment-missing"


@pytest.mark.parametrize("stage", ["hands", "solve", "export"])
def test_an_interrupted_run_leaves_nothing(inputs: Inputs, weights: Path, stage: str) -> None:
    def interrupt(heard: str, fraction: float) -> None:
        if heard == stage:
            raise KeyboardInterrupt

    before = set(inputs.folder.iterdir())
    with pytest.raises(KeyboardInterrupt):
        run_take(inputs.request(weights).model_copy(update={"video_size": (96, 64)}), interrupt)
    assert set(inputs.folder.iterdir()) == before


def test_an_interrupted_video_leaves_the_result(inputs: Inputs, weights: Path) -> None:
    def interrupt(heard: str, fraction: float) -> None:
        if heard == "video":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_take(inputs.request(weights).model_copy(update={"video_size": (96, 64)}), interrupt)
    assert len(load_result(inputs.output).motions) == 2
    assert sorted(path.suffix for path in inputs.output.iterdir()) == [
        ".glb",
        ".json",
        ".json",
        ".npz",
    ]
