"""`omocap evaluate` as a user calls it, with untrained networks."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from capture_app.cli.app import invoke
from omomo_core.stages import body_capture as body_stage
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages.network_file import save_network
from omomo_core.stages.stage import Stage


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    folder = tmp_path / "weights"
    folder.mkdir()
    torch.manual_seed(0)
    for config in (hand_stage.CONFIG, body_stage.CONFIG):
        save_network(Stage(config), config, folder / f"{config.stage}.safetensors", {})
    return folder


def words(clips: Path, weights: Path, *more: str) -> list[str]:
    samples = ["--samples", "2", "--steps", "2", "--weights", str(weights)]
    return ["evaluate", "--clips", str(clips), *samples, *more]


@pytest.mark.runs("evaluate")
def test_every_protocol_is_measured_and_bad_clips_are_skipped_with_their_names(
    tmp_path: Path, weights: Path, write_clip, capsys: pytest.CaptureFixture[str]
):
    write_clip("sub1_box_001")
    np.savez(tmp_path / "sub1_box_002.npz", joints=np.zeros((3, 22, 3)))
    out = tmp_path / "figures.json"
    assert invoke(words(tmp_path, weights, "--json", str(out))) == 0
    printed = capsys.readouterr().out
    assert "sub1_box_002.npz" in printed
    assert "1 skipped" in printed
    assert "By object, given palms" in printed
    assert "…" not in printed
    found = json.loads(out.read_text())
    metrics = {"mpjpe_cm", "t_root_cm", "hand_jpe_cm", "o_root", "contact_f1", "penetration_cm"}
    metrics |= {"contact_precision", "contact_recall", "left_contact_f1", "foot_sliding_cm"}
    for palms in ("gt_palms", "predicted_palms"):
        for given in ("", "_first_frame"):
            for k in ("K1", "K2"):
                assert metrics <= found[palms + given][k].keys()
            assert found[palms]["K2"]["mpjpe_cm"] <= found[palms]["K1"]["mpjpe_cm"]
    assert found["gt_palms"]["K1"] != found["predicted_palms"]["K1"]
    assert found["baseline_opposed_palms"]["K1"]["hand_jpe_cm"] > 0
    assert found["real_clips"]["contact_share"] == 1.0
    assert [row["clip"] for row in found["clips"]] == ["sub1_box_001"]
    assert found["clips"][0]["gt_palms"] == found["gt_palms"]
    (box,) = found["objects"].values()
    assert found["objects"].keys() == {"box"}
    assert box["clips"] == 1
    assert box["predicted_palms"] == found["predicted_palms"]
    assert 0 <= box["real_clips"]["must_hold_contact_f1_all_frames"] <= 1
    assert found["predicted_palms"]["K1"]["t_root_over_60_cm_share"] in (0.0, 1.0)
    assert found["predicted_palms"]["K1"]["hand_jpe_cm_median"] > 0
    made = found["made"]
    assert "clip-keys" in made["skipped"][str(tmp_path / "sub1_box_002.npz")]
    assert (made["sources"], made["windows"]) == ([str(tmp_path)], ["sub1_box_001"])
    assert [network["name"] for network in made["networks"]["capture"]] == [
        "weights/hands",
        "weights/body",
    ]


def test_an_interrupted_evaluation_goes_on_to_the_same_figures(
    tmp_path: Path, weights: Path, write_clip, capsys: pytest.CaptureFixture[str]
):
    write_clip("sub1_box_001")
    texts: list[str] = []
    for name in ("a.json", "b.json"):
        more = ("--json", str(tmp_path / name), "--protocol", "predicted_palms")
        assert invoke(words(tmp_path, weights, *more)) == 0
        texts.append((tmp_path / name).read_text())
    # Two answers of three are left, as when the second run is interrupted.
    kept = tmp_path / "b.json.answers.jsonl"
    kept.write_text("".join(kept.read_text().splitlines(keepends=True)[:3]))
    assert invoke(words(tmp_path, weights, *more)) == 0
    assert "2 of 3 answers are there from an earlier run" in capsys.readouterr().err
    assert texts == [(tmp_path / "b.json").read_text()] * 2
    assert "gt_palms" not in json.loads(texts[0])
    assert invoke(words(tmp_path, weights, *more, "--seed", "1")) == 2
    assert "seed was 0, now 1" in capsys.readouterr().err


def test_what_cannot_be_evaluated_is_refused(
    tmp_path: Path, weights: Path, write_clip, capsys: pytest.CaptureFixture[str]
):
    np.savez(tmp_path / "sub1_box_002.npz", joints=np.zeros((0, 22, 3)))
    for more, code in (
        ((), "no-usable-clips"),
        (("--protocol", "oracle"), "unknown-protocol"),
        (("--json", str(tmp_path / "no" / "x.json")), "output-not-writable"),
    ):
        assert invoke(words(tmp_path, weights, *more)) == 2
        assert code in capsys.readouterr().err
    assert invoke(words(tmp_path / "none", weights)) == 2
    assert "no-clips" in capsys.readouterr().err
