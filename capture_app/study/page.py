"""A rater's page: one HTML file with its films in it, that loads nothing from anywhere."""

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

from capture_app.study.films import Film
from capture_app.study.page_script import SCRIPT
from capture_app.study.page_style import STYLE
from capture_app.study.votes import FORMAT

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
