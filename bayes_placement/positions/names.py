"""Names that tables, figures, files of results and terminals can hold."""

import unicodedata

from .._shared.arguments import check_kind
from .._shared.errors import InputError

LONGEST = 100
"""Greatest number of letters of a name."""


def printable_name(kind: str, name: str) -> str:
    """Return a name that can be printed.

    What has it is for the message: `Sensor of the name`.
    """
    needed = "a name is needed, since it stands in tables and files"
    check_kind(kind, name, str, needed, "a text such as 's1'")
    if not is_printable(name):
        better = "".join(letter for letter in name if letter.isprintable()).strip()[:LONGEST]
        raise InputError(
            f"{kind} {name[: 2 * LONGEST]!r} was given; a name of at most {LONGEST} letters is "
            "needed, all of which can be printed, since it stands in tables, figures and files: "
            f"{better or 's1'!r}."
        )
    return name


def is_printable(name: str) -> bool:
    """Whether a name has letters that can be printed, and not too many."""
    return name.isprintable() and bool(name.strip()) and len(name) <= LONGEST


def checked_name(kind: str, name: str) -> str:
    """Return a name that can be a word of the name of an unknown, and of a group in a file."""
    if not isinstance(name, str) or not name or "." in name:
        better = str(name).replace(".", "_") if isinstance(name, str) and name else "s1"
        raise InputError(
            f"{kind} {name!r} was given; a name without a dot is needed, since dots separate the "
            f'words in names of unknowns (sensor.s1.position): "{better}".'
        )
    if "/" in name:
        raise InputError(
            f"{kind} {name!r} was given; a name without a slash is needed, since slashes separate "
            f'groups in the files of results: "{name.replace("/", "_")}".'
        )
    return printable_name(kind, name)


def look_alike(name: str, others: list[str]) -> str:
    """Hint at a name that differs in case or in the form of its letters alone; empty of none."""
    alike = [other for other in others if _plain(other) == _plain(name) and other != name]
    if not alike:
        return ""
    return f" {alike[0]!a} differs from {name!a} in case or in the form of letters alone."


def _plain(name: str) -> str:
    return unicodedata.normalize("NFKC", name).casefold()
