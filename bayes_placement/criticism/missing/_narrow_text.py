"""Tables of fitted models as text of at most 80 columns, and how much evidence each one gained."""

import re
import textwrap

import numpy as np
import pandas as pd

from .fitted_model import FittedModel

WIDTH = 80
"""Columns of text."""

UNBROKEN = re.compile(r"(?<=\d) \S+(?= \(95 %)|\(95 %: \S+ to \S+")
"""The unit of a number, and an interval, which no end of a line divides."""

GLUE = "\N{NO-BREAK SPACE}"

GAINED = "log evidence gained"
"""Heading of the log evidence less that of the model as given, whose size alone says nothing."""

LARGE = 100.0
"""Gain of log evidence from which on no decimal is written."""


def gained(step: FittedModel, as_given: FittedModel) -> dict[str, str]:
    """Log evidence less that of the model as given; nothing where it cannot be said."""
    gain = step.log_evidence - as_given.log_evidence
    if not np.isfinite(gain):
        return {GAINED: ""}
    return {GAINED: f"{gain:.1f}" if abs(gain) < LARGE else f"{gain:.0f}"}


def narrow(table: pd.DataFrame) -> str:
    """Numbers side by side, and below them the parameters of each row."""
    numbers = _in_blocks(table.drop(columns="parameters"))
    paragraphs = [
        _paragraph(f"{name}: {words}") for name, words in table["parameters"].items() if words
    ]
    return "\n".join([numbers, *(["", *paragraphs] if paragraphs else [])])


def narrow_by_column(numbers: pd.DataFrame, words: pd.DataFrame) -> str:
    """Numbers side by side, and below them what each row of words says in each column."""
    blocks = [_in_blocks(numbers)]
    for title, row in words.iterrows():
        lines = [_paragraph(f"  {column}: {cell}", 4) for column, cell in row.items() if cell]
        blocks.append("\n".join([_paragraph(str(title)), *lines]))
    return "\n\n".join(blocks)


def _in_blocks(table: pd.DataFrame) -> str:
    """As many columns side by side as fit, and the others below, with the names of the rows."""
    blocks, left = [], table
    while left.shape[1]:
        counts = range(left.shape[1], 1, -1)
        count = next((count for count in counts if _width(left.iloc[:, :count]) <= WIDTH), 1)
        blocks.append(left.iloc[:, :count].to_string())
        left = left.iloc[:, count:]
    return "\n\n".join(blocks)


def _width(table: pd.DataFrame) -> int:
    return max(map(len, table.to_string().splitlines()))


def _paragraph(text: str, indent: int = 2) -> str:
    whole = UNBROKEN.sub(lambda part: part[0].replace(" ", GLUE), text)
    return textwrap.fill(whole, WIDTH, subsequent_indent=indent * " ").replace(GLUE, " ")
