"""People who answer a study: `python -m tests.docs.votes STUDY VOTES`."""

import json
import sys
from pathlib import Path

from capture_app.study.votes import read_key


def main(study: Path, votes: Path) -> None:
    """Write what each rater's page would save."""
    key = read_key(study)
    votes.mkdir()
    for k, page in enumerate(key.pages):
        answers = [
            {"item": item.id, "choice": item.intact or ("left", "right")[j % 2], "ms": 900}
            for j, item in enumerate(page.items)
        ]
        file = {"format": "omocap study votes", "version": 1, "study": key.study}
        (votes / f"{k}.json").write_text(json.dumps({**file, "page": page.id, "answers": answers}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
