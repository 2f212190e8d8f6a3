"""Files of votes: what the page saves is read; everything else is refused by name."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from capture_app.study.study_design import Plan
from capture_app.study.votes import read_key, read_votes, vote_files, write_key
from omomo_core.errors import InputError

from .conftest import make_key

KEY = make_key(Plan(raters=2, pairs=3, checks=2))


def votes_of(page: int = 0, choice: str = "left") -> dict:
    """As a page saves them."""
    shown = KEY.pages[page]
    return {
        "format": "omocap study votes",
        "version": 1,
        "study": KEY.study,
        "page": shown.id,
        "answers": [{"item": i.id, "choice": choice, "ms": 900} for i in shown.items],
    }


def put(path: Path, votes: dict) -> Path:
    path.write_text(json.dumps(votes))
    return path


def test_votes_come_back_with_what_they_were_about(tmp_path: Path) -> None:
    (rater,) = read_votes([put(tmp_path / "a.json", votes_of(choice="right"))], KEY)
    assert rater.name == "a.json"
    assert rater.checks == 2
    assert rater.checks_missed == 1  # half of the intact ones are on the right
    assert [v.preferred for v in rater.votes] == [i.right for i in KEY.pages[0].items]


def test_folders_of_votes_are_read(tmp_path: Path) -> None:
    for k in range(2):
        put(tmp_path / f"{k}.json", votes_of(k))
    assert len(read_votes(vote_files([tmp_path]), KEY)) == 2
    for missing in (tmp_path / "none", tmp_path / "empty"):
        (tmp_path / "empty").mkdir(exist_ok=True)
        with pytest.raises(InputError) as caught:
            vote_files([missing])
        assert caught.value.code == "votes-missing"


def foreign(v: dict) -> None:
    v["study"] = "0" * 12


def strange_page(v: dict) -> None:
    v["page"] = "f" * 12


def unknown_pair(v: dict) -> None:
    v["answers"][0]["item"] = "f" * 12


def other_pages_pair(v: dict) -> None:
    v["answers"][0]["item"] = KEY.pages[1].items[0].id


def twice(v: dict) -> None:
    v["answers"][1] = v["answers"][0]


def left_out(v: dict) -> None:
    v["answers"].pop()


def third_side(v: dict) -> None:
    v["answers"][0]["choice"] = "both"


def extra(v: dict) -> None:
    v["answers"][0]["method"] = "ours"


def other_format(v: dict) -> None:
    v["format"] = "something else"


def negative(v: dict) -> None:
    v["answers"][0]["ms"] = -1


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (foreign, "votes-foreign"),
        (strange_page, "votes-unknown-page"),
        (unknown_pair, "votes-unknown-pair"),
        (other_pages_pair, "votes-unknown-pair"),
        (twice, "votes-double"),
        (left_out, "votes-incomplete"),
        (third_side, "votes-damaged"),
        (extra, "votes-damaged"),
        (other_format, "votes-damaged"),
        (negative, "votes-damaged"),
    ],
)
def test_other_votes_are_refused_by_name(
    tmp_path: Path, spoil: Callable[[dict], None], code: str
) -> None:
    votes = votes_of()
    spoil(votes)
    good = put(tmp_path / "good.json", votes_of(1))
    bad = put(tmp_path / "bad.json", votes)
    with pytest.raises(InputError) as caught:
        read_votes([good, bad], KEY)
    assert caught.value.code == code
    assert caught.value.where == str(bad)
    assert caught.value.fix


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff\xfe\x00", b"[" * 100_000])
def test_damaged_files_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "v.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_votes([path], KEY)
    assert caught.value.code == "votes-damaged"


def test_a_page_votes_once(tmp_path: Path) -> None:
    paths = [put(tmp_path / f"{k}.json", votes_of()) for k in "ab"]
    with pytest.raises(InputError, match=r"a\.json") as caught:
        read_votes(paths, KEY)
    assert (caught.value.code, caught.value.where) == ("votes-double", str(paths[1]))


def test_the_key_comes_back(tmp_path: Path) -> None:
    write_key(tmp_path, KEY)
    assert read_key(tmp_path) == KEY
    (tmp_path / "key.json").write_text("{}")
    for folder, code in ((tmp_path, "study-damaged"), (tmp_path / "no", "study-missing")):
        with pytest.raises(InputError) as caught:
            read_key(folder)
        assert caught.value.code == code
