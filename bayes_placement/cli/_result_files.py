"""Tables, texts and figures in the folder of the results; each file is complete or not there."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from .._files import write_atomically
from .._types import InputError

DOTS_PER_INCH = 120


def make_folder(out: Path) -> None:
    """Make the folder before anything is computed, since results could not be written later.

    Raises
    ------
    InputError
        If it is a file.
    """
    if out.exists() and not out.is_dir():
        raise InputError(
            f"--out {out} is a file. A folder is needed, which is made if it is not there: "
            "--out results."
        )
    out.mkdir(parents=True, exist_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    write_atomically(path, lambda temporary: temporary.write_text(f"{text}\n", encoding="utf-8"))


def write_report(path: Path, table: pd.DataFrame, sentences: Sequence[str]) -> None:
    """Write a table and the sentences below it as text."""
    write_text(path, "\n".join([table.to_string(), "", *(f"- {line}" for line in sentences)]))


def write_table(path: Path, table: pd.DataFrame, *, index: bool = True) -> None:
    """Write a table as CSV."""
    write_atomically(path, lambda temporary: table.to_csv(temporary, index=index))


def write_figures(figures: Mapping[str, Figure], out: Path) -> None:
    """Write figures to a folder, by the names of their files."""
    for name, figure in figures.items():
        write_atomically(out / name, partial(figure.savefig, dpi=DOTS_PER_INCH))
