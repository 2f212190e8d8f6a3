"""The paper's tables as a researcher makes them, with methods that need no networks."""

import json
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from capture_app.cli.tables import tables as command
from capture_app.commands.tables import TablesRequest
from capture_app.tables.run_tables import ANSWERS, TablesRun, make_tables
from capture_app.tables.table_rows import ABLATION, PAPER, PUBLISHED
from omomo_core.body.model import load_body
from omomo_core.errors import AssetError, InputError
from tests.capture_app.tables.stand_ins import load, never, write_data, write_weights
from tests.core.movers import thin

NAMES = ("sub16_largetable_001", "sub17_woodchair_002", "sub16_mop_003", "sub3_monitor_004")
Make = Callable[..., TablesRun]


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> tuple[TablesRun, Path]:
    """All tables by all stand-ins, and their folder."""
    folder = tmp_path_factory.mktemp("everything")
    write_data(folder / "data.npz", NAMES)
    write_weights(folder / "weights")
    out = folder / "out"
    request = TablesRequest(
        clips=[folder / "data.npz"], output=out, weights=folder / "weights", samples=2
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("capture_app.tables.run_tables.load_body", lambda: thin(load_body()))
        return make_tables(request, lambda done, total: None, load), out


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """Makes tables of two samples from a small data set and stand-ins on a body of few vertices."""
    monkeypatch.setattr("capture_app.tables.run_tables.load_body", lambda: thin(load_body()))
    write_data(tmp_path / "data.npz", NAMES)
    write_weights(tmp_path / "weights")

    def run(loads=load, **changes) -> TablesRun:
        request = {
            "clips": [tmp_path / "data.npz"],
            "output": tmp_path / "out",
            "weights": tmp_path / "weights",
            "samples": 2,
            **changes,
        }
        return make_tables(TablesRequest(**request), lambda done, total: None, loads)

    return run


def f1_of(made: TablesRun, number: int, label: str, section: int = 0) -> float:
    (table,) = (t for t in made.tables if t.number == number)
    lines = {line.label: line.values for line in table.sections[section].lines}
    return lines[label]["contact_f1"]


def test_seen_and_unseen_objects_have_a_table_each_and_true_palms_a_third(everything):
    made, _ = everything
    two, three, four = made.tables
    assert [t.number for t in made.tables] == [2, 3, 4]
    assert [s.windows for s in two.sections] == [3] * 4
    assert [s.windows for s in three.sections] == [1] * 4
    titles = [s.title for s in two.sections]
    assert titles == [
        "first frame given, best of 2",
        "first frame given, one sample",
        "first frame not given, best of 2",
        "first frame not given, one sample",
    ]
    labels = [line.label for line in two.sections[0].lines]
    assert labels[:2] == ["GOAL", "GOAL, paper"]
    assert "recorded people" in labels
    assert [line.published for line in two.sections[1].lines] == [False] * 7
    starred = [line.label for line in four.sections[0].lines]
    assert "OMOMO, true hands" in starred
    assert "OMOMO, true hands*, paper" in starred
    assert f1_of(made, 2, "recorded people") == f1_of(made, 2, "recorded people", 3)
    lines = {line.label: line.values for line in two.sections[0].lines}
    assert lines["OMOMO"]["mpjpe_cm"] < lines["GOAL"]["mpjpe_cm"]
    not_told = {line.label: line.values for line in two.sections[2].lines}
    assert lines["OMOMO"]["mpjpe_cm"] < not_told["OMOMO"]["mpjpe_cm"]


def test_the_papers_numbers_are_those_of_the_paper(shared: Path):
    text = (shared / "paper" / "001_9fb96ababf92fbcf.txt").read_text()
    rows = {
        "goal": "GOAL",
        "single-stage": "OMOMO-single-stage",
        "no-constraints": "OMOMO w/o constraints",
    }
    for name, label in rows.items():
        seen, unseen = (
            [float(x) for x in line.split("\t")[1:11]]
            for line in text.splitlines()
            if line.startswith(f"{label}\t")
        )
        assert list(PAPER["seen"][name].values()) == seen
        assert list(PAPER["unseen"][name].values()) == unseen
    for mark, kind in (("", "seen"), (r"\*", "unseen")):
        for name, suffix in (("omomo", mark), ("gt-hands", f"{mark}-GT")):
            found = re.search(rf"^[OО][MМ][OО][MМ][OО]{suffix}\t([\d.\t]+)$", text, re.MULTILINE)
            if name == "omomo" and kind == "seen":
                continue
            assert found is not None
            values = [PAPER[kind][name][column.key] for column in ABLATION]
            assert values == [float(x) for x in found[1].split("\t")]


def test_a_folder_goes_on_unless_it_was_begun_otherwise(make: Make, tmp_path: Path):
    some = {"methods": ["omomo"], "limit": 1, "first_frame": "given"}
    made = make(**some)
    assert make(**some, loads=never).tables == made.tables
    for change, named in (
        ({"samples": 3}, "samples was 2, now 3"),
        ({"seed": 1}, "seed was 0, now 1"),
        ({"sampler": "ddpm"}, "sampler was dpm"),
        ({"steps": 20}, "steps was 10, now 20"),
    ):
        with pytest.raises(InputError, match=named):
            make(**{**some, **change})
    write_weights(tmp_path / "weights", seed=1)
    with pytest.raises(InputError, match="the weights of omomo"):
        make(**some)
    assert (tmp_path / "out" / ANSWERS).is_file()


def test_a_window_that_one_method_cannot_answer_counts_for_none(make: Make, tmp_path: Path):
    write_data(tmp_path / "data.npz", [*NAMES, "sub16_trashcan_005"])
    made = make(methods=["goal", "omomo"], first_frame="given")
    assert made.tables[0].sections[0].windows == 3
    assert any("trashcan" in task for task in made.made.failed)
    assert "It gives up." in (tmp_path / "out" / "tables.md").read_text()
    # Without that method the window counts, and nothing is asked again.
    alone = make(methods=["omomo"], first_frame="given", loads=never)
    assert alone.tables[0].sections[0].windows == 4


def test_the_split_leaves_the_others_out(make: Make, tmp_path: Path):
    some = {"methods": ["recorded"], "first_frame": "given"}
    seen = make(**some, split="seen")
    assert [t.number for t in seen.tables] == [2]
    assert seen.tables[0].sections[0].clips == 2
    assert set(seen.made.skipped) == {"sub16_mop_003", "sub3_monitor_004"}
    unseen = make(**some, split="unseen", output=tmp_path / "unseen")
    assert [t.number for t in unseen.tables] == [3]


def test_what_cannot_be_asked_is_refused(make: Make, tmp_path: Path):
    write_data(tmp_path / "short.npz", NAMES[:1], frames=25)
    for changes, code in (
        ({"methods": ["oracle"]}, "unknown-method"),
        ({"clips": [tmp_path / "none"]}, "no-clips"),
        ({"clips": [tmp_path / "short.npz"]}, "no-windows"),
        ({"clips": [tmp_path / "short.npz"], "split": "unseen"}, "no-windows"),
    ):
        with pytest.raises(InputError) as caught:
            make(**changes)
        assert caught.value.code == code
        assert not (tmp_path / "out").exists()
    goal = tmp_path / "weights" / "goal" / "goal.safetensors"
    goal.write_bytes(b"no")
    with pytest.raises(AssetError, match="weights-damaged"):
        make()
    goal.unlink()
    with pytest.raises(AssetError, match="no weights for goal") as missing:
        make()
    assert missing.value.where == str(goal)
    with pytest.raises(InputError, match="no such folder"):
        make(clips=[tmp_path / "none"])
    make(methods=["omomo"], limit=1)


def test_files_say_the_same_and_how_they_were_made(everything):
    made, out = everything
    text, tex = (out / "tables.md").read_text(), (out / "tables.tex").read_text()
    document = json.loads((out / "tables.json").read_text())
    best = f"{f1_of(made, 2, 'OMOMO'):.2f}"
    row = next(line for line in text.splitlines() if line.startswith("| OMOMO |"))
    assert row.split("|")[-2].strip() == best
    grids = re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)
    assert len(grids) == 6
    for grid in grids:
        assert len({line.count("|") for line in grid.splitlines()}) == 1
    assert tex.count(r"\begin{tabular}") == tex.count(r"\end{tabular}") == 6
    assert "OMOMO, true hands*, paper" in tex
    assert not re.search(r"(?<!\\)%", tex)
    lines = document["tables"][0]["sections"][0]["lines"]
    (ours,) = (line for line in lines if line["label"] == "OMOMO")
    assert f"{ours['values']['contact_f1']:.2f}" == best
    assert {column.key for column in PUBLISHED} <= ours["values"].keys()
    for told in (text, tex.replace("\\_", "_"), " ".join(document["caption"])):
        for fact in ("4 windows", "seed 0", "4000 steps", "of 32 windows", "largetable", "sub17"):
            assert fact in told
        assert document["made"]["networks"]["omomo"][0]["digest"] in told


@pytest.fixture
def say_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Make) -> Callable[..., str]:
    """Runs the command on the small data set; gives what it prints."""
    from capture_app.tables import run_tables

    def loaded(names, weights, sampler, steps):
        assert (sampler, steps) == ("ddim", 7)
        return load(names)

    monkeypatch.setattr(run_tables, "load_methods", loaded)
    app = typer.Typer()
    app.command()(command)
    words = [str(tmp_path / "data.npz"), "--weights", str(tmp_path / "weights")]
    words += ["-o", str(tmp_path / "said"), "--samples", "2", "--methods", "omomo,recorded"]
    words += ["--first-frame", "given", "--sampler", "ddim", "--steps", "7", "--limit", "1"]

    def said(columns: str | None) -> str:
        done = CliRunner().invoke(app, words, env={"COLUMNS": columns})
        assert done.exit_code == 0, done.output
        return done.stdout

    return said


@pytest.mark.runs("tables")
def test_the_command_prints_the_tables(say_tables: Callable[..., str], tmp_path: Path):
    say_tables("160")
    document = json.loads((tmp_path / "said" / "tables.json").read_text())
    assert document["made"]["settings"]["sampler"] == "ddim"
    assert [s["first_frame"] for s in document["tables"][0]["sections"]] == [True, True]
    values = document["tables"][0]["sections"][0]["lines"][0]["values"]
    assert np.isfinite(list(values.values())).all()


@pytest.mark.parametrize("columns", ["200", "80", None, "50", "20"], ids=str)
def test_every_figure_is_printed_whole(
    say_tables: Callable[..., str], tmp_path: Path, columns: str | None
):
    """On a terminal of so many columns, and in a pipe, which says none."""
    printed = say_tables(columns)
    assert "…" not in printed
    grids = re.findall(r"(?:^\|.*\n)+", (tmp_path / "said" / "tables.md").read_text(), re.MULTILINE)
    figures = re.findall(r"\d+\.\d\d\b", "".join(grids))
    assert len(figures) > 50
    rows = [line for line in printed.splitlines() if re.search(r"\d\.\d\d(?!\d)", line)]
    found = re.findall(r"(?<![\d.])-?\d+\.\d\d(?=\s|$)", "\n".join(rows))
    assert Counter(figures) <= Counter(found)
    grid_lines = [line for line in rows if not line.startswith(("-", "Table", "These"))]
    if columns not in ("50", "20"):
        assert max(len(line) for line in grid_lines if "OMOMO  " in line) <= int(columns or 80)
