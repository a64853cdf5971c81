"""What stands in a report: texts, tables, figures, what moves, as JSON and back."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from ..._shared.errors import InputError
from ..._shared.files import Json, no_formula
from ...inference.summary import INTERVAL
from ...inference.units import decimals
from ._svg import checked_svg

Cell: TypeAlias = str | float | int | None

DIGITS = 6
"""Significant digits of numbers in the data of a figure."""


class Table(NamedTuple):
    """A table: the names of its columns and its rows."""

    columns: tuple[str, ...]
    """Names of the columns, with units."""
    rows: tuple[tuple[Cell, ...], ...]
    """Cells, numbers as numbers."""

    @classmethod
    def from_json(cls, stated: Json) -> "Table":
        """Read it from lists."""
        rows = tuple(tuple(_cell(cell) for cell in row) for row in stated["rows"])
        return cls(tuple(str(column) for column in stated["columns"]), rows)

    @classmethod
    def of(cls, frame: pd.DataFrame, *, index: str | None = None) -> "Table":
        """Take a data frame, with its index as a first column of the name `index`."""
        columns = [str(column) for column in frame.columns]
        cells = [[_cell(value) for value in row] for row in frame.itertuples(index=False)]
        if index is not None:
            columns = [index, *columns]
            cells = [
                [str(name), *row] for name, row in zip(frame.index.tolist(), cells, strict=True)
            ]
        return cls(tuple(columns), tuple(map(tuple, cells)))

    def csv(self) -> str:
        """Comma-separated values with a heading."""
        text = io.StringIO()
        rows = ([_written(cell) for cell in row] for row in (self.columns, *self.rows))
        csv.writer(text, lineterminator="\n").writerows(rows)
        return text.getvalue()


class Text(NamedTuple):
    """A paragraph, or a list of sentences."""

    sentences: tuple[str, ...]
    """The sentences."""

    @classmethod
    def from_json(cls, stated: Json) -> "Text":
        """Read it from a list."""
        return cls(tuple(str(sentence) for sentence in stated["sentences"]))


class Drawing(NamedTuple):
    """A figure as SVG, with its numbers."""

    svg: str
    """The drawing, one `svg` element."""
    data: Table | None = None
    """What is drawn; None where that is not known."""
    follows_theme: bool = False
    """Whether its black and white are those of the page; a figure of another origin stays on a
    light ground."""

    @classmethod
    def from_json(cls, stated: Json) -> "Drawing":
        """Read the drawing and its numbers."""
        data = stated["data"]
        table = None if data is None else Table.from_json(data)
        return cls(checked_svg(str(stated["svg"])), table, bool(stated["follows_theme"]))


class MovingShapes(NamedTuple):
    """Mode shapes that move, of one or several models beside each other."""

    points: list[list[float]]
    """Points of the structure [m], three coordinates each."""
    lines: list[list[int]]
    """Pairs of numbers of points that are joined; none where the points stand alone."""
    models: list[Json]
    """By the name of a model, its natural frequencies [Hz] and shapes [mode, point, 3], the
    greatest displacement of each being 1."""
    note: str
    """How displacements are drawn."""
    marks: list[Json]
    """What is marked on the structure: a `name`, where it is (`at` [m]), and its `kind`, a sensor,
    an actuator or an effect."""

    @classmethod
    def from_json(cls, stated: Json) -> "MovingShapes":
        """Read it from lists of numbers."""
        models = [
            {
                "name": str(model["name"]),
                "frequencies": np.asarray(model["frequencies"], float).tolist(),
                "shapes": np.asarray(model["shapes"], float).tolist(),
            }
            for model in stated["models"]
        ]
        points = np.asarray(stated["points"], float).tolist()
        lines = np.asarray(stated["lines"], int).tolist()
        marks = [
            {word: str(mark[word]) for word in ("name", "kind")}
            | {"at": np.asarray(mark["at"], float).tolist()}
            for mark in stated["marks"]
        ]
        return cls(points, lines, models, str(stated["note"]), marks)

    @property
    def data(self) -> Table:
        """The shapes, one row for each model, mode and point."""
        rows = tuple(
            (model["name"], number + 1, frequency, *point, *shift)
            for model in self.models
            for number, (frequency, shape) in enumerate(
                zip(model["frequencies"], model["shapes"], strict=True)
            )
            for point, shift in zip(self.points, shape, strict=True)
        )
        places, shifts = ("x [m]", "y [m]", "z [m]"), ("ux [1]", "uy [1]", "uz [1]")
        return Table(("model", "mode", "natural frequency [Hz]", *places, *shifts), rows)


class Interactive(NamedTuple):
    """Channels, matrix and structure on a page that can be zoomed, turned and switched."""

    frames: str
    """What it shows, as letters: see `page/standalone.py`."""

    @classmethod
    def from_json(cls, stated: Json) -> "Interactive":
        """Read letters; no others than these get into the page."""
        frames = str(stated["frames"])
        if not _LETTERS.fullmatch(frames):
            raise InputError(
                f'Frames of an interactive page were given that begin with "{frames[:40]}"; base64 '
                "is needed, since they become a part of a page. Run the command again."
            )
        return cls(frames)

    @property
    def data(self) -> None:
        """The figures beside it have its numbers."""


_LETTERS = re.compile(r"[A-Za-z0-9+/]+=*")

Content: TypeAlias = Text | Table | Drawing | MovingShapes | Interactive

KINDS: dict[str, type[Content]] = {
    "text": Text,
    "table": Table,
    "figure": Drawing,
    "moving_shapes": MovingShapes,
    "interactive": Interactive,
}
"""Kinds of content by their names in JSON."""


@dataclass(frozen=True)
class Item:
    """One piece of a report."""

    section: str
    """Section in which it stands."""
    title: str
    """Its heading."""
    content: Content
    """What is shown."""
    caption: str = ""
    """One sentence that says what is to be seen."""
    tags: tuple[str, ...] = ()
    """Words by which a reader filters."""
    by_user: bool = field(default=False)
    """Whether a user added it: a new run leaves it in place."""

    @property
    def kind(self) -> str:
        """Name of the kind of its content."""
        return next(name for name, kind in KINDS.items() if isinstance(self.content, kind))

    @property
    def data(self) -> Table | None:
        """Its numbers, for a file; None for a text."""
        if isinstance(self.content, Table):
            return self.content
        return None if isinstance(self.content, Text) else self.content.data

    def to_json(self) -> Json:
        """Return it as numbers and words for a file."""
        return {
            "section": self.section,
            "title": self.title,
            "kind": self.kind,
            "caption": self.caption,
            "tags": list(self.tags),
            "by_user": self.by_user,
            "content": {
                word: part._asdict() if isinstance(part, Table) else part
                for word, part in self.content._asdict().items()
            },
        }

    @classmethod
    def from_json(cls, stated: Json) -> "Item":
        """Read it from a file."""
        kind = stated["kind"]
        if kind not in KINDS:
            raise InputError(
                f'An item of the kind "{kind}" was given; {", ".join(KINDS)} are known, since only '
                'these can be shown: "kind": "text".'
            )
        return cls(
            section=str(stated["section"]),
            title=str(stated["title"]),
            content=KINDS[kind].from_json(stated["content"]),
            caption=str(stated["caption"]),
            tags=tags_of(stated["tags"]),
            by_user=bool(stated["by_user"]),
        )


def tags_of(words: Sequence[str]) -> tuple[str, ...]:
    """Tags without repetition, in their order."""
    return tuple(dict.fromkeys(str(word) for word in words))


def _cell(value: object) -> Cell:
    """Return a number that JSON knows, or text; None for what is not known."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return str(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return None if value is None else str(value)


def _written(cell: Cell) -> Cell:
    """Return a cell as it stands in comma-separated values; nothing for what is not known."""
    return f"{cell:.{DIGITS}g}" if isinstance(cell, float) else no_formula(cell)


def rounded(value: float, spread: float) -> float:
    """Round a number to the second digit of its standard deviation; as it is where that is zero."""
    return round(value, decimals(spread)) if np.isfinite(spread) and spread > 0 else value


def rounded_summary(draws: np.ndarray) -> tuple[float, float, float, float]:
    """Mean, standard deviation and both ends of the 95 % interval of draws, rounded."""
    spread = float(draws.std())
    numbers = (draws.mean(), *np.quantile(draws, INTERVAL))
    mean, low, high = (rounded(float(number), spread) for number in numbers)
    return mean, float(f"{spread:.2g}"), low, high
