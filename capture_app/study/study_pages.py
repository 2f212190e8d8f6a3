"""The pages of a study: films of pairs, and a page for each rater that works without a network."""

import base64
import json
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path

import numpy as np

from capture_app.comparison.arrange import placed_motions
from capture_app.comparison.compared_motions import Choice, Motion, load_motions, stretch
from capture_app.staging import staged_folder
from capture_app.study.study_design import (
    SIDES,
    Method,
    Page,
    Plan,
    Trial,
    common_takes,
    design,
    read_methods,
)
from capture_app.study.votes import FORMAT, PAGES, Key, KeyItem, KeyPage, write_key
from omomo_core.errors import InputError
from omomo_core.motion import FPS, HumanMotion
from render.backends import Backend
from render.comparison import Contender, views
from render.lettering import Picture
from render.video import write_video

SCRIPT = """
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const part = id => document.getElementById(id);
const sides = ["left", "right"];
const films = sides.map(side => part(side + "-film"));
const answers = new Map();
let at = -1, since = 0, saved = false;

function show(id) {
  for (const name of ["intro", "question", "end"]) part(name).hidden = name !== id;
}
function play() {
  for (const film of films) { film.currentTime = 0; film.play().catch(() => {}); }
}
function mark() {
  const choice = at < data.items.length ? answers.get(data.items[at].id)?.choice : null;
  for (const side of sides) part(side).classList.toggle("chosen", choice === side);
}
function go(to) {
  at = to;
  if (at >= data.items.length) {
    films.forEach(film => film.pause());
    return show("end");
  }
  show("question");
  const item = data.items[at];
  films.forEach((film, k) => { film.src = "data:video/mp4;base64," + data.films[item[sides[k]]]; });
  part("done").style.width = 100 * at / data.items.length + "%";
  part("count").textContent = "Pair " + (at + 1) + " of " + data.items.length;
  part("back").disabled = at === 0;
  since = performance.now();
  mark();
  play();
}
function choose(side) {
  const item = data.items[at].id;
  const ms = Math.round(performance.now() - since);
  answers.set(item, { item: item, choice: side, ms: ms });
  mark();
  const here = at;
  setTimeout(() => { if (at === here) go(at + 1); }, 180);
}
function save() {
  const votes = { format: data.format, version: 1, study: data.study, page: data.page,
    answers: data.items.map(item => answers.get(item.id)) };
  const file = new Blob([JSON.stringify(votes)], { type: "application/json" });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(file);
  link.download = "votes_" + data.page + ".json";
  link.click();
  saved = true;
}
sides.forEach((side, k) => {
  part(side + "-button").onclick = () => choose(side);
  films[k].onclick = () => choose(side);
  films[k].onended = play;
});
part("start").onclick = () => go(0);
part("again").onclick = play;
part("back").onclick = () => { if (at > 0) go(at - 1); };
part("review").onclick = () => go(data.items.length - 1);
part("save").onclick = save;
document.addEventListener("keydown", event => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
  if (at < 0 || at >= data.items.length) return;
  const keys = { ArrowLeft: () => choose("left"), "1": () => choose("left"),
    ArrowRight: () => choose("right"), "2": () => choose("right"),
    " ": play, Backspace: () => { if (at > 0) go(at - 1); } };
  if (event.key in keys) { event.preventDefault(); keys[event.key](); }
});
addEventListener("beforeunload", event => {
  if (answers.size && !saved) event.preventDefault();
});
"""


_SHORTEST = 1.0
"""Seconds that all methods of a take must have in common."""
_BLOCK = 6
"""Frames that stay together when a motion is shuffled."""
_FAR = 0.5
"""Metres that an object must go for a person who stands still to look wrong."""

Film = tuple[str, str, bool]
"""Take, method, and whether it is broken."""


@dataclass(frozen=True)
class FilmStyle:
    """How films look."""

    width: int = 360
    height: int = 300
    seconds: float = 6.0
    """Longest film: the stretch in which the object moves most."""
    crf: int = 27
    """Quality of the video; higher is smaller."""
    backend: Backend = "auto"


def films_of(pages: Sequence[Page]) -> list[Film]:
    """The films that pages show, sorted."""
    shown: set[Film] = set()
    for item in (item for page in pages for item in page.items):
        q = item.question
        shown |= {(q.take, q.first, False), (q.take, q.second, item.intact is not None)}
    return sorted(shown)


def make_films(
    films: Sequence[Film],
    methods: Sequence[Method],
    style: FilmStyle,
    progress: Callable[[float], None],
) -> dict[Film, bytes]:
    """Draw films as MP4: those of a take have one camera, one clock and one length.

    Raises:
        InputError: a motion cannot be read, moves another object than the same take of another
            method, or has less than a second in common with it.
    """
    made: dict[Film, bytes] = {}
    takes = sorted({take for take, *_ in films})
    for k, take in enumerate(takes):
        wanted = [film for film in films if film[0] == take]
        motions = _motions(take, methods, style.seconds)
        made |= _filmed(wanted, motions, k, style)
        progress((k + 1) / len(takes))
    return made


def broken(motion: Motion, seed: int) -> Motion:
    """The same object with a person nobody can take for real.

    They stand still while the object moves (even seeds, where it moves far enough to be seen), or
    their moments come in disorder.
    """
    frames = len(motion.human.root)
    far = float(np.ptp(motion.object_motion.T_world_object[:, :3, 3], axis=0).max())
    if seed % 2 == 0 and far > _FAR:
        order = np.zeros(frames, int)
    else:
        blocks = np.array_split(np.arange(frames), max(2, frames // _BLOCK))
        mixed = np.random.default_rng(seed).permutation(len(blocks))
        order = np.concatenate([blocks[k] for k in mixed])
    human = HumanMotion(
        **{k: getattr(motion.human, k)[order] for k in HumanMotion.__dataclass_fields__}
    )
    return replace(motion, human=human)


def _motions(take: str, methods: Sequence[Method], seconds: float) -> dict[str, Motion]:
    """The take by each method, in one world, cut to the same frames."""
    chosen = [Choice(m.takes[take]) for m in methods]
    placed = placed_motions(load_motions(chosen))
    start = max(p.placement.begin for p in placed)
    stop = min(p.placement.begin + len(p.motion.human.root) for p in placed)
    if stop - start < _SHORTEST * FPS:
        raise InputError(
            "study-take-short",
            f"The methods have {max(0, stop - start) / FPS:.1f} s of this take in common.",
            where=take,
            fix="Take it out of the folders, or make all its results from the same recording.",
        )
    first, last = _liveliest(placed[0].motion, start, stop, round(seconds * FPS))
    return {
        m.name: stretch(p.motion, first - p.placement.begin, last - p.placement.begin)
        for m, p in zip(methods, placed, strict=True)
    }


def _liveliest(motion: Motion, start: int, stop: int, frames: int) -> tuple[int, int]:
    """The stretch of at most so many frames in which the object goes farthest."""
    if stop - start <= frames:
        return start, stop
    path = motion.object_motion.T_world_object[start:stop, :3, 3]
    way = np.concatenate([[0.0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
    first = start + int(np.argmax(way[frames - 1 :] - way[: len(way) - frames + 1]))
    return first, first + frames


def _filmed(
    chosen: Sequence[Film], motions: Mapping[str, Motion], seed: int, style: FilmStyle
) -> dict[Film, bytes]:
    # All methods are filmed, so that the camera does not depend on which of them a pair needs.
    cast = [(method, False) for method in motions]
    cast += [(method, True) for _, method, ruined in chosen if ruined]
    contenders = [
        _contender(broken(motions[method], seed + k) if ruined else motions[method])
        for k, (method, ruined) in enumerate(cast)
    ]
    pictures = views(
        contenders,
        range(len(contenders[0].human.root)),
        width=style.width,
        height=style.height,
        markers=False,
        time_code=False,
        backend=style.backend,
        samples=4,
    )
    columns = list(zip(*pictures, strict=True))
    take = chosen[0][0]
    return {
        (take, *role): _encoded(list(column), style.crf)
        for role, column in zip(cast, columns, strict=True)
        if (take, *role) in chosen
    }


def _contender(motion: Motion) -> Contender:
    """Recorded people look like all others."""
    return Contender(
        "", motion.human, motion.object_motion, motion.body, motion.contact, truth=False
    )


def _encoded(pictures: Sequence[Picture], crf: int) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        write_video(path, pictures, FPS, crf=crf)
        return path.read_bytes()


STYLE = """
:root { color-scheme: light dark; --paper: #faf9f7; --ink: #33363a; --faint: #85888c;
  --line: #dcdad5; --mark: #2f7d5b; --on-mark: #fff; }
@media (prefers-color-scheme: dark) { :root { --paper: #1d1f22; --ink: #e6e4df; --faint: #9a9c9f;
  --line: #3a3d41; --mark: #57b98c; --on-mark: #10231a; } }
* { box-sizing: border-box; }
body { margin: 0; min-height: 100vh; background: var(--paper); color: var(--ink);
  font: 17px/1.5 system-ui, sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 24px 20px 40px; }
h1 { font-size: 24px; font-weight: 600; margin: 0 0 14px; }
.bar { height: 5px; background: var(--line); border-radius: 3px; overflow: hidden; }
.bar div { height: 100%; width: 0; background: var(--mark); transition: width .2s; }
.count { color: var(--faint); margin: 6px 0 18px; font-variant-numeric: tabular-nums; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 18px; }
figure { margin: 0; }
video { display: block; width: 100%; border-radius: 8px; border: 3px solid transparent;
  background: var(--line); cursor: pointer; }
.chosen video { border-color: var(--mark); }
button { font: inherit; color: inherit; background: none; border: 1px solid var(--line);
  border-radius: 8px; padding: 10px 18px; cursor: pointer; }
button:hover, button:focus-visible { border-color: var(--mark); outline: none; }
figure button { width: 100%; margin-top: 10px; font-weight: 600; }
.chosen button, .main { background: var(--mark); border-color: var(--mark); color: var(--on-mark); }
.tools { display: flex; gap: 10px; margin-top: 22px; align-items: center; }
.tools span { color: var(--faint); margin-left: auto; font-size: 15px; }
kbd { border: 1px solid var(--line); border-radius: 4px; padding: 1px 6px; font: inherit;
  font-size: 14px; }
section[hidden] { display: none; }
p { max-width: 46em; }
"""


QUESTION = "Which person moves more naturally and handles the object more realistically?"
_POLICY = (
    "default-src 'none'; media-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
)


@dataclass(frozen=True)
class TrialFilms:
    """A pair on a page."""

    id: str
    left: Film
    right: Film


def rater_page(
    study: str, page: str, items: Sequence[TrialFilms], films: Mapping[Film, bytes], question: str
) -> str:
    """The whole page. It names neither methods nor takes; films stand in the order they are shown.

    Args:
        study, page: what the votes are to say they are of.
        items: the pairs in their order.
        films: MP4 of each film.
        question: what is asked about each pair.
    """
    order = list(dict.fromkeys(film for item in items for film in (item.left, item.right)))
    data = {
        "format": FORMAT,
        "study": study,
        "page": page,
        "items": [
            {"id": i.id, "left": order.index(i.left), "right": order.index(i.right)} for i in items
        ],
        "films": [base64.b64encode(films[film]).decode() for film in order],
    }
    stored = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Which is better?</title><style>{STYLE}</style></head><body><main>"
        f"{_intro(len(items), question)}{_question(question)}{_end()}</main>"
        f'<script id="data" type="application/json">{stored}</script>'
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def _intro(count: int, question: str) -> str:
    return (
        f'<section id="intro"><h1>{escape(question)}</h1>'
        f"<p>You will see {count} pairs of short films of a person who moves an object. The object "
        "moves the same in both. Watch both films, then choose the better one. There is no right "
        "answer: if they look alike, go with your first impression.</p>"
        "<p>Choose with the mouse, or with <kbd>←</kbd> and <kbd>→</kbd>. <kbd>Space</kbd> plays "
        "both again, <kbd>Backspace</kbd> goes back. At the end you save one small file and send "
        "it to whoever sent you this page. Nothing leaves this computer by itself.</p>"
        '<button id="start" class="main">Start</button></section>'
    )


def _question(question: str) -> str:
    pair = "".join(
        f'<figure id="{side}"><video id="{side}-film" muted playsinline></video>'
        f'<button id="{side}-button">{arrow}</button></figure>'
        for side, arrow in (("left", "← Left"), ("right", "Right →"))
    )
    return (
        '<section id="question" hidden><div class="bar"><div id="done"></div></div>'
        f'<p id="count" class="count"></p><h1>{escape(question)}</h1>'
        f'<div class="pair">{pair}</div><div class="tools">'
        '<button id="back">Back</button><button id="again">Play again</button>'
        "<span><kbd>←</kbd> <kbd>→</kbd> choose · <kbd>Space</kbd> again</span></div></section>"
    )


def _end() -> str:
    return (
        '<section id="end" hidden><h1>Thank you</h1>'
        "<p>That was the last pair. Save your votes and send the file to whoever sent you this "
        'page.</p><div class="tools"><button id="save" class="main">Save votes</button>'
        '<button id="review">Back</button></div></section>'
    )


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
            fix="Make room, or ask for smaller or shorter films (‹size›, ‹seconds›).",
        ) from error
