"""print_qr: an address that a phone's camera reads off the terminal."""

import sys

import segno


def print_qr(address: str) -> None:
    """Print a QR code of an address, where the output can show its blocks."""
    try:
        segno.make(address, error="l", micro=False).terminal(sys.stdout, compact=True, border=2)
    except UnicodeEncodeError:
        # The terminal knows no block characters; the address stands above.
        return
