"""The numbers that shape a motion: printed by the doctor, recorded in manifests, compared by rerun."""

import json
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

from capture_app.manifest import read_manifest, write_manifest
from capture_app.manifest_builder import MOTION_CONFIG, changed_settings, recorded_config
from capture_app.rerun import request_of
from omomo_core.config import settings_of
from omomo_core.errors import OmocapError
from tests.capture_app.test_cli import invoke
from tests.capture_app.test_result import a_manifest

SETTINGS = list(settings_of(MOTION_CONFIG))


def number_of_fields(config: object) -> int:
    values = [getattr(config, one.name) for one in fields(config)]
    return sum(number_of_fields(value) if is_dataclass(value) else 1 for value in values)


def test_every_field_has_a_unit_and_a_meaning():
    assert len(SETTINGS) == number_of_fields(MOTION_CONFIG) > 100
    assert [s.name for s in SETTINGS if not s.unit or not s.meaning.endswith(".")] == []
    assert len({s.name for s in SETTINGS}) == len(SETTINGS)


def test_the_doctor_lists_every_field(capsys: pytest.CaptureFixture[str]):
    assert invoke(["doctor", "--config", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [(s["name"], s["unit"], s["meaning"]) for s in listed] == [
        (s.name, s.unit, s.meaning) for s in SETTINGS
    ]
    assert {s["name"]: s["value"] for s in listed} == json.loads(json.dumps(recorded_config()))


def test_the_doctor_explains_every_number_with_its_whole_name(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("capture_app.cli.console.output.width", 400)
    assert invoke(["doctor", "--config"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 * len(SETTINGS)
    for line, meaning, one in zip(lines[::2], lines[1::2], SETTINGS, strict=True):
        name, _, value = line.partition(" = ")
        assert name == one.name
        assert value.endswith(f" {one.unit}")
        assert meaning.strip() == one.meaning


def test_a_manifest_keeps_every_number(tmp_path: Path):
    manifest = a_manifest().model_copy(update={"config": recorded_config()})
    write_manifest(tmp_path / "manifest.json", manifest)
    assert changed_settings(read_manifest(tmp_path / "manifest.json").config) == ()


def test_a_manifest_without_numbers_is_read(tmp_path: Path):
    old = json.loads(a_manifest().model_dump_json())
    del old["config"]
    (tmp_path / "manifest.json").write_text(json.dumps(old))
    assert read_manifest(tmp_path / "manifest.json").config == {}


def test_a_result_of_other_numbers_is_not_made_again_silently(tmp_path: Path):
    config = {**recorded_config(), "contact.regrasp.stay": 13, "contact.former": 1.0}
    with pytest.raises(OmocapError, match=r"contact\.regrasp\.stay\.") as caught:
        request_of(a_manifest().model_copy(update={"config": config}), tmp_path / "again")
    assert caught.value.code == "config-changed"
