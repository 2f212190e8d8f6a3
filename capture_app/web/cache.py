"""Names of files that can be made again: the same inputs and the same program, the same name."""

import hashlib
import json
from importlib.metadata import version
from typing import Any


def key(*inputs: Any) -> str:
    """For what is made from these inputs by this version of the program."""
    text = json.dumps([version("omocap"), *map(str, inputs)])
    return hashlib.sha256(text.encode()).hexdigest()[:16]
