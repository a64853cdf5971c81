"""Warnings of every method, then settings, versions and files with their hashes."""

from collections.abc import Iterator, Mapping
from typing import Any

from .._saved import Saved
from ..content import Cell, Item, Table, Text
from ..report import SETTINGS, WARNINGS

KNOWN = ("steps", "verdict", "probabilities", "confounded", "unexplained", "cautions")
"""Fields of a ledger that stand elsewhere in the report."""


def warnings(saved: Saved) -> Iterator[Item]:
    """List what each method warns of; say so where none does."""
    pairs = [(str(method), str(words)) for method, words in saved.about.get("warnings", [])]
    pairs += [("improve", str(words)) for words in saved.ledger.get("cautions", [])]
    unique = tuple(dict.fromkeys(pairs))
    if not unique:
        yield Item(WARNINGS, "Warnings", Text(("No method warns of anything.",)), tags=("warning",))
        return
    words = "What each method says against its own result."
    yield Item(WARNINGS, "Warnings", Table(("method", "warning"), unique), words, ("warning",))


def settings(saved: Saved) -> Iterator[Item]:
    """List how the run was made, so that it can be made again."""
    rows: list[tuple[Cell, ...]] = [
        *_flat(saved.runs),
        *_flat({name: value for name, value in saved.ledger.items() if name not in KNOWN}),
        ("folder", saved.folder.name),
    ]
    table = Table(("setting", "value"), tuple(dict.fromkeys(rows)))
    words = "Settings, seed, versions, files with their SHA-256: with these the run is repeated."
    yield Item(SETTINGS, "How this was made", table, words, ("settings",))


def _flat(values: Any, name: str = "") -> Iterator[tuple[Cell, ...]]:
    """Names and values of nested fields, one a row."""
    if isinstance(values, Mapping):
        for word, value in values.items():
            yield from _flat(value, f"{name}.{word}".removeprefix("."))
    elif isinstance(values, list):
        for number, value in enumerate(values, 1):
            yield from _flat(value, f"{name} {number}")
    elif values is not None:
        yield (name, values if isinstance(values, int | float) else str(values))
