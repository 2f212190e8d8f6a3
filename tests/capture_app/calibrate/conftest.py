"""Someone who answers the guide."""

import io
import sys
from pathlib import Path

import pytest

from capture_app.cli.app import invoke
from capture_app.cli.console import output
from tests.capture_app.calibrate.guided import Told, write_mesh


@pytest.fixture
def converse(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Answers the guide in a folder of its own that holds box.obj."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(output, "width", 1000)
    write_mesh(tmp_path / "box.obj")
    monkeypatch.setattr("capture_app.posters.draw_mount", lambda _, __, path: path.write_bytes(b""))

    def answer(*answers: str) -> Told:
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in answers)))
        code = invoke(["calibrate"])
        captured = capsys.readouterr()
        return Told(code, captured.out, captured.err)

    return answer
