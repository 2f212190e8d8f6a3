"""A study from folders of results: pages for raters, and the answer key apart from them."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from capture_app.staging import staged_folder
from capture_app.study.design import SIDES, Page, Plan, Trial, design
from capture_app.study.films import Film, FilmStyle, films_of, make_films
from capture_app.study.key import PAGES, Key, KeyItem, KeyPage, write_key
from capture_app.study.methods import common_takes, read_methods
from capture_app.study.page import QUESTION, TrialFilms, rater_page
from omomo_core.errors import InputError


def make_study(
    folders: Sequence[Path],
    output: Path,
    plan: Plan,
    style: FilmStyle,
    *,
    question: str = QUESTION,
    progress: Callable[[float], None] = lambda _: None,
) -> Key:
    """Draw the pairs, film them and write a study's folder, whole or not at all.

    Args:
        folders: one for each method, with a result or clip for each take.
        output: the folder to make: `pages/` for the raters, `key.json` for the analysis.
        plan, style: how many, and how they look.
        question: what raters are asked.
        progress: called with how far the films are.

    Raises:
        InputError: the folders, a motion in them, or the plan do not fit, or there is no room.
    """
    methods = read_methods(folders)
    pages = design(common_takes(methods), [m.name for m in methods], plan)
    key = answer_key(pages, [m.name for m in methods], plan)
    with staged_folder(output) as folder:
        films = make_films(films_of(pages), methods, style, progress)
        _write(folder, key, films, question)
    return key


def answer_key(pages: Sequence[Page], methods: Sequence[str], plan: Plan) -> Key:
    """Names for the study, its pages and their items that tell nothing; the seed gives them."""
    rng = np.random.default_rng([plan.seed, 1])
    digits = len(str(len(pages)))
    return Key(
        study=_name(rng),
        seed=plan.seed,
        methods=tuple(methods),
        pages=tuple(
            KeyPage(
                id=_name(rng),
                file=f"rater_{k + 1:0{digits}}.html",
                batch=page.batch,
                items=tuple(_key_item(_name(rng), item) for item in page.items),
            )
            for k, page in enumerate(pages)
        ),
    )


def shown(item: KeyItem) -> TrialFilms:
    """The films of a pair; in a check the side that is not intact is broken."""
    left, right = (
        (item.take, method, item.intact not in (None, side))
        for side, method in zip(SIDES, (item.left, item.right), strict=True)
    )
    return TrialFilms(item.id, left, right)


def _key_item(name: str, item: Trial) -> KeyItem:
    q = item.question
    right = q.second if item.left == q.first else q.first
    return KeyItem(id=name, take=q.take, left=item.left, right=right, intact=item.intact)


def _name(rng: np.random.Generator) -> str:
    return rng.bytes(6).hex()


def _write(folder: Path, key: Key, films: Mapping[Film, bytes], question: str) -> None:
    write_key(folder, key)
    (folder / PAGES).mkdir()
    try:
        for page in key.pages:
            text = rater_page(key.study, page.id, [shown(i) for i in page.items], films, question)
            (folder / PAGES / page.file).write_text(text, encoding="utf-8")
    except OSError as error:
        free = shutil.disk_usage(folder).free
        raise InputError(
            "output-not-writable",
            f"The pages cannot be written: {error.strerror or error} ({free / 1e6:.0f} MB free).",
            where=str(folder),
            fix="Make room, or ask for smaller or shorter films (--size, --seconds).",
        ) from error
