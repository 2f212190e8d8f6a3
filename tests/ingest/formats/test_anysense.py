"""AnySense: stamps of the writing, not of the frames, may repeat."""

from pathlib import Path

from ingest.formats import anysense
from tests.ingest.formats.logs import MakeTake, error_of, write_log


def test_it_names_the_stamps_that_repeat(take: MakeTake, tmp_path: Path):
    log = write_log(anysense, take(0), tmp_path)
    lines = log.read_text().split("\n")
    for row in (11, 30):
        lines[row] = lines[row - 1].split(",")[0] + "," + lines[row].split(",", 1)[1]
    log.write_text("\n".join(lines))
    error = error_of(tmp_path)
    assert error.code == "time-repeats"
    assert "2 lines" in error.what
    assert "12, 31" in error.what
    assert error.where == f"{log}:12"
