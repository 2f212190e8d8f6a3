"""`omocap study`: ask people which motions they prefer, and count their votes."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options
from capture_app.cli.console import output as console
from capture_app.cli.console import progress_bars, say
from capture_app.commands.text_values import read_size

app = typer.Typer(no_args_is_help=True, help="Ask people which motions they prefer.")

Methods = Annotated[
    list[Path],
    typer.Argument(
        help="A folder for each method, with a result folder (or a recorded clip's npz) for "
        "each take, called the same in all of them.",
        show_default=False,
    ),
]
NewFolder = Annotated[
    Path, typer.Option("-o", "--output", help="Folder to make.", show_default=False)
]
Raters = Annotated[
    int, typer.Option(help="People who answer each question; one page each.", min=1, max=500)
]
Pairs = Annotated[int, typer.Option(help="Questions for each two methods.", min=1, max=1000)]
Checks = Annotated[
    int, typer.Option(help="Pairs on each page with one broken motion.", min=0, max=20)
]
PerPage = Annotated[
    int, typer.Option(help="Most questions on a page; more make more pages.", min=1, max=500)
]
Seconds = Annotated[float, typer.Option(help="Longest film.", min=1, max=60)]
Size = Annotated[str, typer.Option(help="Width x height of a film in pixels.")]
Question = Annotated[str | None, typer.Option(help="What raters are asked.", show_default=False)]


@app.command()
def make(
    methods: Methods,
    file: NewFolder,
    raters: Raters = 20,
    pairs: Pairs = 30,
    checks: Checks = 4,
    per_page: PerPage = 40,
    seconds: Seconds = 6.0,
    size: Size = "360x300",
    question: Question = None,
    seed: options.Seed = 0,
    backend: options.Backend = options.DrawingBackend.auto,
) -> None:
    """Draw pairs of motions and make a web page for each rater, which works without a network.

    Send each file of *pages* to one person and collect the votes it saves. Keep *key.json* to
    yourself: it says which method is where.

    Example: `omocap study make ours baseline recorded -o study --raters 20 --pairs 30`
    """
    width, height = read_size(size, "--size")
    from capture_app.study.study_design import Plan
    from capture_app.study.study_pages import QUESTION, FilmStyle, make_study
    from capture_app.study.votes import KEY, PAGES

    with progress_bars() as progress:
        key = make_study(
            methods,
            file,
            Plan(raters, pairs, checks, per_page, seed),
            FilmStyle(width, height, seconds, backend=backend.value),
            question=question or QUESTION,
            progress=lambda done: progress("video", done),
        )
    largest = max(p.stat().st_size for p in (file / PAGES).iterdir())
    say(
        "Done", f"{len(key.pages)} pages of up to {largest / 1e6:.1f} MB in {file / PAGES}", "green"
    )
    say("Keep", f"{file / KEY} from the raters: it is the answer key", "yellow")


@app.command()
def analyse(
    study: Annotated[
        Path, typer.Argument(help="Folder that `omocap study make` wrote.", show_default=False)
    ],
    votes: Annotated[
        list[Path],
        typer.Argument(
            help="Files of votes that the pages saved, or folders of them.", show_default=False
        ),
    ],
    file: Annotated[
        Path, typer.Option("-o", "--output", help="Folder to make.", show_default=False)
    ],
    may_miss: Annotated[
        int, typer.Option(help="Attention checks a rater may miss and still count.", min=0)
    ] = 0,
) -> None:
    """Count the votes: how often each method was preferred to each other, and how sure that is.

    Example: `omocap study analyse study votes/ -o findings`
    """
    from capture_app.study.study_report import analyse as count
    from capture_app.study.study_report import write_report
    from capture_app.study.votes import read_key, read_votes, vote_files

    key = read_key(study)
    analysis = count(key, read_votes(vote_files(votes), key), may_miss=may_miss)
    write_report(file, key, analysis)
    for name, why in analysis.left_out:
        say("left out", f"{name}: {why}", "yellow")
    for p in analysis.preferences:
        rate = p.rate
        interval = f"{rate.low:.1%} to {rate.high:.1%}"
        what = f"{rate.share:.1%} ({interval}, {rate.votes} votes)"
        console.print(f"{p.first} preferred to {p.second}: {what}", markup=False, soft_wrap=True)
    say("Done", str(file), "green")
