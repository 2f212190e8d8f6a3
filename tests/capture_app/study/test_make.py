"""A study from result folders: pages that tell nothing and need nothing, and the key beside them."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from capture_app.cli.study import app
from capture_app.study.study_design import Plan, design
from capture_app.study.study_pages import FilmStyle, answer_key, broken, films_of, make_study, shown
from capture_app.study.votes import read_key, read_votes
from omomo_core.errors import InputError
from tests.video_frames import read_frames

from ..comparison.conftest import carrying, put_result

STYLE = FilmStyle(96, 72, seconds=1.0)
PLAN = Plan(raters=3, pairs=1, checks=2, per_page=40, seed=4)
ASKED = ["--raters", "3", "--pairs", "1", "--checks", "2", "--seed", "4"]
METHODS = ("omocap_v2", "baseline_goal")


@pytest.fixture(scope="module")
def methods(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("methods")
    for take in ("lift_box", "turn_box"):
        for k, method in enumerate(METHODS):
            put_result(folder / method / take, carrying(aside=0.06 * k, frames=34))
    return [folder / m for m in METHODS]


@pytest.fixture(scope="module")
def commands() -> typer.Typer:
    made = typer.Typer()
    made.add_typer(app, name="study")
    return made


@pytest.fixture(scope="module")
def study(
    methods: list[Path], commands: typer.Typer, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """As the command makes it."""
    out = tmp_path_factory.mktemp("made") / "study"
    words = ["study", "make", *map(str, methods), "-o", str(out), "--size", "96x72"]
    done = CliRunner().invoke(commands, [*words, "--seconds", "1", *ASKED])
    assert done.exit_code == 0, done.output
    assert "key.json" in done.output
    return out


def data_of(page: str) -> dict:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)
    assert found
    return json.loads(found[1])


@pytest.mark.runs("study make")
def test_pages_tell_nothing_and_the_key_tells_all(study: Path, tmp_path: Path) -> None:
    key = read_key(study)
    assert sorted(p.name for p in study.iterdir()) == ["key.json", "pages"]
    pages = sorted((study / "pages").iterdir())
    assert [p.name for p in pages] == [p.file for p in key.pages]
    assert len(pages) == 3
    films: dict[tuple[str, str, bool], bytes] = {}
    for path, page in zip(pages, key.pages, strict=True):
        text = path.read_text()
        bare = re.sub(r'"films":\[.*?\]', "", text)
        assert not re.search(r"https?:|[\"'(]//|\bsrc=|href=|url\(|@import|<link|fetch", bare)
        for secret in (*METHODS, "lift_box", "turn_box", "intact", "seed", str(study.parent)):
            assert secret not in text
        data = data_of(text)
        assert (data["study"], data["page"]) == (key.study, page.id)
        assert [i["id"] for i in data["items"]] == [i.id for i in page.items]
        for item, told in zip(data["items"], page.items, strict=True):
            assert set(item) == {"id", "left", "right"}
            for side in ("left", "right"):
                film = getattr(shown(told), side)
                data_film = base64.b64decode(data["films"][item[side]])
                assert films.setdefault(film, data_film) == data_film
    assert len(set(films.values())) == len(films)  # broken ones differ from intact ones
    path = tmp_path / "film.mp4"
    for film in films.values():
        path.write_bytes(film)
        frames = read_frames(path, range(30))
        assert frames[0].shape == (72, 96, 3)
        with pytest.raises(IndexError):
            read_frames(path, [30])


def test_the_seed_draws_the_same_pairs(study: Path) -> None:
    pages = design(["lift_box", "turn_box"], METHODS, PLAN)
    assert answer_key(pages, METHODS, PLAN) == read_key(study)


@pytest.mark.slow
def test_the_seed_makes_the_same_study(methods: list[Path], study: Path, tmp_path: Path) -> None:
    key = make_study(methods, tmp_path / "again", PLAN, STYLE)
    assert key == read_key(study)
    for page in key.pages:
        a, b = (folder / "pages" / page.file for folder in (study, tmp_path / "again"))
        assert a.read_bytes() == b.read_bytes()


def test_checks_show_a_broken_film_on_the_other_side() -> None:
    from .conftest import make_key

    key = make_key(PLAN)
    for item in (i for page in key.pages for i in page.items):
        pair = shown(item)
        ruined = {"left": pair.left[2], "right": pair.right[2]}
        if item.intact is None:
            assert not any(ruined.values())
        else:
            assert not ruined.pop(item.intact)
            assert all(ruined.values())
            assert pair.left[:2] == pair.right[:2]


def test_films_wanted_are_films_shown() -> None:
    pages = design(["t0", "t1", "t2"], ["a", "b"], Plan(raters=3, pairs=2, checks=3))
    films = films_of(pages)
    takes = {i.question.take for p in pages for i in p.items}
    assert {f[:2] for f in films if not f[2]} == {(t, m) for t in takes for m in "ab"}
    assert any(f[2] for f in films)


def test_broken_people_are_plainly_broken() -> None:
    motion = carrying(frames=60)
    still, mixed = broken(motion, 0), broken(motion, 1)
    assert np.ptp(still.human.joints, axis=0).max() == 0
    assert np.ptp(still.object_motion.T_world_object[:, :3, 3], axis=0).max() > 0.5
    step = [np.linalg.norm(np.diff(m.human.root, axis=0), axis=1).max() for m in (motion, mixed)]
    assert step[1] > 5 * step[0]
    assert np.allclose(np.sort(mixed.human.root, axis=0), np.sort(motion.human.root, axis=0))
    assert (mixed.object_motion.T_world_object == motion.object_motion.T_world_object).all()


def test_folders_that_make_no_study_are_refused(methods: list[Path], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    put_result(tmp_path / "elsewhere" / "other_take", carrying(frames=36))
    twin = tmp_path / "copy" / METHODS[0]
    shutil.copytree(methods[0], twin)
    cases = {
        "study-methods": [methods[:1], [methods[0], twin]],
        "study-no-motions": [[methods[0], tmp_path / "empty"], [methods[0], tmp_path / "gone"]],
        "study-no-common-take": [[methods[0], tmp_path / "elsewhere"]],
    }
    for code, folders in cases.items():
        for given in folders:
            with pytest.raises(InputError) as caught:
                make_study(given, tmp_path / "study", PLAN, STYLE)
            assert caught.value.code == code
    assert not (tmp_path / "study").exists()


def test_a_failure_half_way_leaves_nothing(methods: list[Path], tmp_path: Path) -> None:
    bad = tmp_path / "damaged"
    shutil.copytree(methods[1], bad)
    for motion in bad.glob("*/motion.npz"):
        motion.write_bytes(b"damaged")
    with pytest.raises(InputError, match="cannot be read"):
        make_study([methods[0], bad], tmp_path / "study", PLAN, STYLE)
    assert sorted(tmp_path.iterdir()) == [bad]


@pytest.mark.runs("study analyse")
def test_from_votes_to_findings(study: Path, commands: typer.Typer, tmp_path: Path) -> None:
    """Everybody prefers the first method, but for one who sleeps."""
    key, votes = read_key(study), tmp_path / "votes"
    votes.mkdir()
    for k, page in enumerate(key.pages):
        answers = []
        for item in page.items:
            right = item.intact == "right" if item.intact else item.right == METHODS[0]
            choice = "right" if right != (k == 2) else "left"
            answers.append({"item": item.id, "choice": choice, "ms": 5})
        file = {"format": "omocap study votes", "version": 1, "study": key.study}
        (votes / f"{k}.json").write_text(json.dumps({**file, "page": page.id, "answers": answers}))
    words = ["study", "analyse", str(study), str(votes), "-o", str(tmp_path / "found")]
    done = CliRunner().invoke(commands, words)
    assert done.exit_code == 0, done.output
    assert "2.json" in done.output
    found = json.loads((tmp_path / "found" / "analysis.json").read_text())
    assert found["raters_left_out"][0]["votes"] == "2.json"
    (row,) = found["preferences"]
    assert (row["first"], row["share_first"], row["votes"]) == (METHODS[0], 1.0, 2)


CHOOSE = """
<script>
URL.createObjectURL = file => { file.text().then(text => {
  document.body.innerHTML = "<pre>VO" + "TES" + text + "VO" + "TES</pre>"; }); return "#"; };
part("start").click();
const keys = ["ArrowRight", "1", "2", "ArrowLeft"];
let n = 0;
const timer = setInterval(() => {
  if (at >= data.items.length) { clearInterval(timer); part("save").click(); return; }
  if (n === at) document.dispatchEvent(new KeyboardEvent("keydown", { key: keys[n++ % 4] }));
}, 50);
</script></body>
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_a_browser_saves_votes_that_are_read(study: Path, tmp_path: Path) -> None:
    key = read_key(study)
    page = study / "pages" / key.pages[0].file
    tried = tmp_path / "tried.html"
    tried.write_text(page.read_text().replace("</body>", CHOOSE))
    words = [
        "chromium",
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--virtual-time-budget=20000",
    ]
    done = subprocess.run(
        [*words, "--dump-dom", tried.as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    found = re.search("VOTES(.*?)VOTES", done.stdout)
    assert found, done.stdout[-500:]
    path = tmp_path / "votes.json"
    path.write_text(found[1])
    (rater,) = read_votes([path], key)
    assert rater.page == key.pages[0]
    wanted = ["right", "left", "right", "left"]
    assert [v.choice for v in rater.votes] == [wanted[k % 4] for k in range(len(rater.votes))]
