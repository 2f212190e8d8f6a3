"""A rater's page: one HTML file with its films in it, that loads nothing from anywhere."""

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

from capture_app.study.films import Film
from capture_app.study.page_script import SCRIPT
from capture_app.study.votes import FORMAT

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
