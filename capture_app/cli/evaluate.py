"""`omocap evaluate`: how far generated people are from recorded ones."""

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from capture_app.cli import options
from capture_app.cli.console import asking, say
from capture_app.cli.figure_table import FigureRow, FigureTable
from omomo_core.whole_file import check_target, write_whole

if TYPE_CHECKING:
    from omomo_core.learning.evaluation.evaluation import Evaluation


class SkeletonChoice(StrEnum):
    """Whose skeleton the generated people get."""

    person = "person"
    shipped = "shipped"


FIGURES = {
    "mpjpe_cm": "MPJPE",
    "mpvpe_cm": "MPVPE",
    "t_root_cm": "T_root",
    "hand_jpe_cm": "HandJPE",
    "hand_jpe_best_cm": "least",
    "contact_f1": "F1",
    "contact_f1_all_frames": "F1 all",
    "foot_sliding_cm": "Sliding",
    "penetration_cm": "Inside",
    "hand_penetration_cm": "Hands in",
}
"""What is printed; the file has more."""
SPREAD = {
    "hand_jpe_cm_median": "HandJPE",
    "mpjpe_cm_median": "MPJPE",
    "t_root_cm_median": "T_root",
    "t_root_over_60_cm_share": ">60 cm",
    "onset_error_s_median": "Onset s",
    "toe_skating_cm_s": "Skating",
    "toe_swing_cm": "Swing",
    "toe_skimming_share": "Skim",
    "leaping_share": "Leaps",
}
"""Medians, the share of clips with the pelvis 60 cm off, onsets of contact, the steps of toes, and leaps."""
HOLDS = {
    "near_contact_f1": "F1 8 cm",
    "hands_right_share": "Hands",
    "side_right_share": "Side",
    "backwards_share": "Backwards",
    "first_head_cm": "Head",
}
"""Contact within 8 cm, the share of clips with the right number of hands and the right side, walking
backwards, and the height of the head in the first frame."""
BY_OBJECT = {
    "hand_jpe_cm": "HandJPE",
    "mpjpe_cm": "MPJPE",
    "t_root_cm": "T_root",
    "contact_f1_all_frames": "F1 all",
}
ANSWERS = ".answers.jsonl"
"""End of the name of the file with the answers of an evaluation, after the name of its JSON file."""
GIVEN = {
    "gt_palms": "palms",
    "gt_palms_first_frame": "palms, pose",
    "predicted_palms": "nothing",
    "predicted_palms_first_frame": "pose",
    "predicted_palms_stood": "place",
    "predicted_palms_stood_ends": "place, end",
    "predicted_palms_stood_ends_side_hands": "place, end, side, hands",
    "baseline_opposed_palms": "(unlearned)",
}


def evaluate(
    clips: Annotated[
        Path, typer.Option(help="Folder or file of clips; docs/evaluation.md describes them.")
    ],
    json_file: Annotated[
        Path | None,
        typer.Option(
            "--json",
            help="File to write every figure to. Answers are kept beside it: an interrupted "
            "evaluation goes on when it is started again.",
        ),
    ] = None,
    weights: options.Weights = None,
    samples: Annotated[
        int, typer.Option(help="K: people generated for each clip.", min=1, max=200)
    ] = 20,
    seed: options.Seed = 0,
    steps: options.Steps = 7,
    body: Annotated[
        SkeletonChoice,
        typer.Option(help="Bones of the generated people: the recorded person's, or our body's."),
    ] = SkeletonChoice.person,
    protocol: Annotated[
        list[str] | None, typer.Option(help="Only this protocol; may be given several times.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes to use.", min=1)] = 1,
) -> None:
    """Generate the people of recorded clips anew and measure how far they are from the real ones.

    People are generated for each clip under several protocols: from the recorded palms or from
    predicted ones, each with and without the person's first pose, and from predicted palms with the
    place where the person stood, the place at the end, and the side and the hands they held with. K1
    is the sample that the program shows; K20 is the one of 20 (of --samples) with the least MPJPE, as
    published, beside the least HandJPE of any sample. F1 is the mean over clips, as published;
    "F1 all" is over the frames of all clips together. Lengths are in centimetres.

    A second table has medians, the share of clips with the pelvis more than 60 cm off, by how many
    seconds a hand's first contact is early or late, the speed of low toes (cm/s), how high toes rise in a
    step, the share of steps under 3 cm, and of clips with a part of the body faster than people's. A third
    has contact within 8 cm (fingertips push), the share of clips with as many hands as people hold with
    and with the same side (60 degrees), of frames walked backwards, and the head's height in the first
    frame. A table of the classes of objects follows for each protocol; "moved" is the F1 of an answer
    without learning, that some hand touches exactly while the object moves.
    """
    from capture_app.tables.table_files import figures_json
    from omomo_core.generation.generation_options import GenerationOptions
    from omomo_core.learning.evaluation.evaluation import evaluate as run

    chosen = _protocols(protocol)
    if json_file is not None:
        check_target(json_file)
    kept = json_file and json_file.with_name(json_file.name + ANSWERS)
    generation = GenerationOptions(samples=samples, seed=seed, steps=steps)
    ask = partial(run, [clips], chosen, generation, weights, body.value)
    with asking(kept) as progress:
        made = ask(kept=kept, workers=workers, progress=progress)
    _print(made)
    if json_file is not None:
        write_whole(json_file, figures_json(made.figures(), made.origin))


def _protocols(names: list[str] | None) -> list[str]:
    """Return those of these names, or all."""
    from omomo_core.errors import InputError
    from omomo_core.learning.evaluation.protocols import PROTOCOLS

    unknown = [name for name in names or () if name not in PROTOCOLS]
    if unknown:
        raise InputError(
            "unknown-protocol",
            f"There is no protocol {unknown[0]!r}.",
            where="--protocol",
            fix=f"Use {', '.join(PROTOCOLS)}.",
        )
    return [name for name in PROTOCOLS if not names or name in names]


def _print(made: "Evaluation") -> None:
    from omomo_core.learning.evaluation.protocols import BASELINE

    left_out = {**made.origin.skipped, **made.origin.failed}
    for name, reason in left_out.items():
        say("skipped", f"{Path(name).name}: {reason}", "yellow")
    best, table = f"K{made.samples}", made.table()
    title = f"Mean of {len(made.clips)} clips, {len(left_out)} skipped"
    _print_protocols(title, FIGURES, table, made.recorded(), best)
    table.pop(BASELINE)
    _print_protocols("Medians, onset of contact and steps", SPREAD, table, made.recorded(), best)
    _print_protocols("How the object is held", HOLDS, table, made.recorded(), best)
    for protocol in table:
        _print_objects(made, protocol, best)


def _print_protocols(
    title: str,
    figures: dict[str, str],
    table: dict[str, Any],
    recorded: dict[str, float],
    best: str,
) -> None:
    rows = [
        FigureRow([GIVEN[protocol], k], _cells(columns[k], figures), ends_section=k == best)
        for protocol, columns in table.items()
        for k in dict.fromkeys(("K1", best))
    ]
    rows.append(FigureRow(["real clips", ""], _cells(recorded, figures)))
    FigureTable(title, ["given", ""], list(figures.values()), rows).print()


def _print_objects(made: "Evaluation", protocol: str, best: str) -> None:
    """One row for each class of objects: one result and the best of K, and contact without learning."""
    samples = list(dict.fromkeys(("K1", best)))
    parts = made.by_object() | {"all": made}
    rows: list[FigureRow] = []
    for name, part in parts.items():
        columns = part.table()[protocol]
        cells = [f"{columns[k][key]:.2f}" for key in BY_OBJECT for k in samples]
        moved = f"{part.recorded()['must_hold_contact_f1_all_frames']:.2f}"
        rows.append(FigureRow([name, str(len(part.clips))], [*cells, moved]))
    titles = [f"{title} {k}" for title in BY_OBJECT.values() for k in samples]
    title = f"By object, given {GIVEN[protocol]}"
    FigureTable(title, ["object", "clips"], [*titles, "moved"], rows).print()


def _cells(row: dict[str, float], figures: dict[str, str]) -> list[str]:
    return [f"{row[key]:.2f}" if key in row else "" for key in figures]
