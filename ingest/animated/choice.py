"""Which of the animated things in a scene is the object?"""

from collections.abc import Sequence
from pathlib import Path

from omomo_core.errors import InputError


def choose(
    names: Sequence[str], candidates: Sequence[int], wanted: str | None, source: Path
) -> int:
    """Index of the object among all things of a scene.

    Args:
        names: of all of them.
        candidates: those that move and have a surface.
        wanted: the name the user gave; it need not be a candidate's.
        source: the file, for messages.

    Raises:
        InputError: "animation-missing" when nothing moves, "node-missing" for a name that is not
            there, "node-ambiguous" when several fit.
    """
    fits = [i for i, name in enumerate(names) if name == wanted] if wanted else list(candidates)
    if len(fits) == 1:
        return fits[0]
    listed = ", ".join(names[i] for i in candidates[:12]) or "none"
    if wanted and not fits:
        raise InputError(
            "node-missing",
            f"{source.name} has nothing of the name {wanted!r}; what moves in it: {listed}.",
            where=str(source),
            fix="Give one of these names with --node.",
        )
    if wanted:
        raise InputError(
            "node-ambiguous",
            f"{len(fits)} things in {source.name} are named {wanted!r}.",
            where=str(source),
            fix="Give the object a name of its own, and export again.",
        )
    if not fits:
        raise InputError(
            "animation-missing",
            f"Nothing with a surface is animated in {source.name}.",
            where=str(source),
            fix="Animate the location and rotation of the object itself, and export with animation.",
        )
    raise InputError(
        "node-ambiguous",
        f"Several things move in {source.name}: {listed}.",
        where=str(source),
        fix="Say which one the person moves: --node NAME.",
    )
