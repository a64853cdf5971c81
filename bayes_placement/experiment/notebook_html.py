"""How nouns and results are shown in a notebook: a sentence, a table, further sentences."""

from collections.abc import Sequence
from html import escape

import pandas as pd


def notebook_html(title: str, table: pd.DataFrame, sentences: Sequence[str] = ()) -> str:
    """Return HTML that a notebook shows in the place of `repr`.

    Parameters
    ----------
    title
        What it says, in a sentence.
    table
        What is shown below.
    sentences
        Sentences below the table.
    """
    rows = table.rename_axis(columns=None).reset_index() if table.index.name else table
    shown = rows.to_html(index=False, border=0, na_rep="") if len(rows) else ""
    further = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    list_items = f"<ul>{further}</ul>" if further else ""
    return f"<div><p><b>{escape(title)}</b></p>{shown}{list_items}</div>"
