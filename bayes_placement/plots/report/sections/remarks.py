"""The set-up of the test; warnings of every method, settings, versions and files with hashes."""

from collections.abc import Iterator, Mapping
from pathlib import PurePath

from ...._shared.files import Json
from .._saved import Saved
from ..content import Cell, Item, Table, Text
from ..report import SET_UP, SETTINGS, WARNINGS

FIELDS = ("date", "seed", "seconds", "units", "settings", "versions")
"""Fields of the record of a run that are told."""


def warnings(saved: Saved) -> Iterator[Item]:
    """List what each method warns of; say so where none does."""
    pairs = [(str(method), str(words)) for method, words in saved.about.get("warnings", [])]
    pairs += [("improve", str(words)) for words in saved.ledger.get("cautions", [])]
    unique = tuple(dict.fromkeys(pairs))
    if not saved.about and not saved.ledger:
        return  # what the method said was not kept
    if not unique:
        yield Item(WARNINGS, "Warnings", Text(("There are no warnings.",)), tags=("warning",))
        return
    words = "Warnings of each method about its own result."
    yield Item(WARNINGS, "Warnings", Table(("method", "warning"), unique), words, ("warning",))


def settings(saved: Saved) -> Iterator[Item]:
    """List how each run was made, so that it can be made again."""
    rows: list[tuple[Cell, ...]] = [("folder", saved.folder.resolve().name)]
    files: list[tuple[Cell, ...]] = []
    for command, run in saved.runs.items():
        rows += _flat({command: {word: run[word] for word in FIELDS if word in run}})
        sources = [("model", run.get("model")), *(("data", file) for file in run.get("data", []))]
        files += [(command, role, *_name_and_hash(file)) for role, file in sources if file]
    if not saved.runs:
        rows += _flat(saved.ledger.get("record", {}))
    table = Table(("setting", "value"), tuple(dict.fromkeys(rows)))
    words = "Settings, seed and versions; a run with the same ones gives the same result."
    yield Item(SETTINGS, "How this was made", table, words, ("settings",))
    if files:
        content = Table(("command", "role", "file", "SHA-256"), tuple(files))
        words = "Files that the run read, by name, with the hash of their content."
        yield Item(SETTINGS, "Files", content, words, ("settings",))


def _name_and_hash(file: Json) -> tuple[str, str]:
    """Name of a file and hash of its content; folders of a person's machine are left out."""
    return PurePath(str(file.get("path", ""))).name, str(file.get("sha256", ""))


def _flat(values: object, name: str = "") -> Iterator[tuple[Cell, ...]]:
    """Names and values of nested fields, one a row."""
    if isinstance(values, Mapping):
        for word, value in values.items():
            yield from _flat(value, f"{name}.{word}".removeprefix("."))
    elif isinstance(values, list):
        for number, value in enumerate(values, 1):
            yield from _flat(value, f"{name} {number}")
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield (name, values)
    elif values is not None:
        yield (name, str(values))


SET_UP_TAGS = ("set-up",)

COLUMNS = ("channels", "kind", "recorded position [m]", "gain on its FRFs [1]")


def set_up(saved: Saved) -> Iterator[Item]:
    """List what was measured, and the channels."""
    known = saved.about.get("set_up")
    if known is None:
        return
    facts = Table(("what", "as measured"), tuple(map(tuple, known["facts"])))
    yield Item(SET_UP, "Measurement", facts, tags=SET_UP_TAGS)
    channels = Table(COLUMNS, tuple(map(tuple, known["channels"])))
    words = "The sign and the letter of a channel are its direction; a gain of 1 is exact."
    yield Item(SET_UP, "Channels", channels, words, SET_UP_TAGS)
