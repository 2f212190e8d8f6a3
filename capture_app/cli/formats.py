"""`omocap formats`: which phone logs can be read?"""

from rich.table import Table
from rich.text import Text

from capture_app.cli import options
from capture_app.cli.console import output, say


def formats(as_json: options.AsJson = False) -> None:
    """List the apps whose recordings can be read, what to give of each, and what it lacks."""
    from ingest.formats.registry import FORMATS

    known = [{"name": f.NAME, "files": f.FILES, "lacks": f.LACKS} for f in FORMATS]
    if as_json:
        output.print_json(data=known)
        return
    table = Table("app", "give", "lacks", box=None, pad_edge=False, header_style="dim")
    for row in known:
        table.add_row(*(Text(value) for value in row.values()))
    output.print(table)
    say(
        "Packed",
        "each also as .zip, .r3d, .tar or .tar.gz, and one or two folders down, if it is the only "
        "session there",
        "bold",
    )
