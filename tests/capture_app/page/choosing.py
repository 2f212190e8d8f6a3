"""Files given to a drop area of the page."""

import re
from pathlib import Path
from typing import Any


def choose(page: Any, area: str, what: object) -> None:
    """Give files, or a folder, to the drop area of these words."""
    words = (
        "Choose a folder" if isinstance(what, Path) and what.is_dir() else "Choose (a file|files)"
    )
    with page.expect_file_chooser() as chooser:
        place = page.locator(".drop", has_text=area)
        place.get_by_role("button", name=re.compile(words)).click()
    chooser.value.set_files(what)
