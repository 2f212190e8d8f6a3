"""JSON as people and apps hand it in: with or without a byte order mark, and no key given twice."""

import json
from collections.abc import Callable

_Json = dict[str, object]


def parse(data: bytes | str, *, constant: Callable[[str], object] | None = None) -> object:
    """The value that a JSON text holds.

    Args:
        data: UTF-8, with a byte order mark or without.
        constant: what becomes of NaN and Infinity, by their names; None takes them as numbers.

    Raises:
        ValueError: it is no UTF-8, no JSON (`json.JSONDecodeError`), nested too deeply, or an object has a
            key twice, so that nobody can tell which is meant.
    """
    text = data.decode("utf-8") if isinstance(data, bytes) else data
    try:
        return json.loads(
            text.removeprefix("\ufeff"), object_pairs_hook=_once, parse_constant=constant
        )
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _once(pairs: list[tuple[str, object]]) -> _Json:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise DoubledKeyError(twice)
    return found


class DoubledKeyError(ValueError):
    """A key that stands twice in one object."""

    def __init__(self, key: str) -> None:
        """The key is named in the message."""
        super().__init__(f'the key "{key[:40]}" is given twice')
