"""--device: refused where the device is not there, and recorded for a re-run where it is."""

from pathlib import Path

import pytest
import torch

from capture_app.cli.app import invoke
from capture_app.manifest import MANIFEST, Manifest, read_manifest
from capture_app.rerun import request_of
from tests.capture_app.conftest import Inputs


def words(inputs: Inputs, weights: Path, device: str) -> list[str]:
    given = ["--object", str(inputs.mesh), "--mount", str(inputs.mount), "--weights", str(weights)]
    quick = ["--samples", "1", "--steps", "2", "--no-video", "-o", str(inputs.output)]
    return ["run", str(inputs.session), *given, *quick, "--device", device]


def test_a_run_records_its_device(inputs: Inputs, weights: Path):
    assert invoke(words(inputs, weights, "cpu")) == 0
    manifest = read_manifest(inputs.output / MANIFEST)
    assert manifest.options["device"] == "cpu"
    again = inputs.folder / "again"
    assert request_of(manifest, again).device == "cpu"
    elsewhere = Manifest.model_validate(
        {**manifest.model_dump(), "options": {**manifest.options, "device": "cuda"}}
    )
    assert request_of(elsewhere, again).device == "cuda"


@pytest.mark.parametrize(
    ("device", "code"), [("cuda", "device-missing"), ("mps", "device-missing"), ("tpu", "tpu")]
)
def test_a_device_that_is_not_there_is_refused(
    inputs: Inputs, weights: Path, device: str, code: str, monkeypatch, capsys
):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch.backends.mps, "is_available", lambda: False)
    assert invoke(words(inputs, weights, device)) == 2
    printed = capsys.readouterr().err
    assert code in printed
    assert "--device" in printed
    assert "Traceback" not in printed
    assert not inputs.output.exists()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA device")
def test_a_run_on_cuda_records_it(inputs: Inputs, weights: Path):
    assert invoke(words(inputs, weights, "cuda")) == 0
    assert read_manifest(inputs.output / MANIFEST).options["device"] == "cuda"
