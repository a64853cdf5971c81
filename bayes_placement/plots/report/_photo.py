"""A photograph as a part of a page."""

import base64
import re
from pathlib import Path

from ..._shared.errors import InputError

LARGEST = 5_000_000
"""Bytes of the largest photograph that is taken."""

_KINDS = {b"\x89PNG\r\n\x1a\n": "png", b"\xff\xd8\xff": "jpeg"}
"""Kinds by the bytes with which they begin."""

_EMBEDDED = re.compile(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/]+=*")


def embedded(path: str | Path) -> str:
    """Return a photograph, PNG or JPEG of at most 5 MB, as an address that holds it."""
    if not Path(path).is_file():
        raise FileNotFoundError(f"There is no photograph {path}. One that is there: --photo FILE.")
    content = Path(path).read_bytes()
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None or len(content) > LARGEST:
        raise InputError(
            f"{path} was given as a photograph, {len(content)} bytes; a PNG or JPEG of at most "
            f"{LARGEST} bytes is needed, since it becomes a part of the page: --photo bridge.jpg."
        )
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def checked_photo(address: str) -> str:
    """Return the photograph of a report of any origin; refuse all else, which a page would load."""
    if address and not _EMBEDDED.fullmatch(address):
        raise InputError(
            f'The photograph "{address[:40]}" was given; "data:image/png;base64,..." is needed, '
            "since a page loads nothing: write_report(folder, photo='bridge.jpg')."
        )
    return address
