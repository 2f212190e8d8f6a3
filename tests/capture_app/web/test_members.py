"""A name that a client gives becomes a path inside the folder, or is refused."""

from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture_app.web.unfinished_uploads import member_paths
from omomo_core.errors import InputError


@pytest.mark.parametrize(
    "name",
    ["a.csv", "take/odometry.csv", "Gerät/日本.txt", "a/b/c.d.e", "a b.txt", "-rf", "$HOME", "~/x"],
)
def test_names_that_people_give_files(name: str):
    assert member_paths([name]) == [PurePosixPath(name)]


@pytest.mark.parametrize(
    "name",
    [
        *("", ".", "..", "/", "/etc/passwd", "../x", "a/../../x", "a//b", "a/./b", "a/"),
        *("C:/x", "c:x", "C:\\x", "\\\\server\\share", "a\\..\\x", "a\0b", "a\nb", "a\x7f"),
        *("NUL", "con.txt", "a/COM1", "lpt9.csv", "aux.", "x.", "x ", " x", "a:b", "a|b", "a?b"),
        *("x" * 201, "ab/" * 400 + "x", "/".join("abcdefghijklmnopq"), "\ud800", "a<b", 'a"b'),
    ],
)
def test_names_that_escape_or_fit_no_disk(name: str):
    with pytest.raises(InputError) as caught:
        member_paths(["fine.txt", name])
    assert caught.value.code == "member-path"
    assert caught.value.fix


@pytest.mark.parametrize(
    "twins",
    [
        *(("a", "a"), ("a.txt", "A.TXT"), ("x/b", "X/B"), ("a", "a/b"), ("a/b", "a")),
        *(("a", "A/b"), ("Ger\u00e4t", "Gera\u0308t"), ("stra\u00dfe", "STRASSE")),
    ],
)
def test_names_that_meet_on_some_disk(twins: tuple[str, str]):
    with pytest.raises(InputError) as caught:
        member_paths(twins)
    assert caught.value.code == "member-duplicate"


@given(st.lists(st.text(max_size=30), max_size=5))
def test_whatever_passes_stays_inside(names: list[str]):
    try:
        paths = member_paths(names)
    except InputError:
        return
    for path in paths:
        assert not path.is_absolute()
        assert ".." not in path.parts
        assert len({str(p).casefold() for p in paths}) == len(paths)
