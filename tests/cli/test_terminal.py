"""Tables of any width, text without markup, and progress bars that end."""

import io

import pandas as pd
import pytest
from rich.console import Console

import bayes_placement as bp
from bayes_placement import _progress
from bayes_placement.cli import _terminal

ROWS = {
    "all data": ["594", "2.14e+03", "0.995", "0.0409", "0", "9.46e-206", "0.123"],
    "band 1020 to 1212 Hz": ["75", "1.17e+03", "0.999", "0.115", "0", "3.01e-79", "0.456"],
}
COLUMNS = ["data", "chi2 per datum", "expected", "spread", "p", "p of whiteness", "predictive p"]


@pytest.fixture
def console():
    return Console(file=io.StringIO(), width=80)


def said(console):
    return console.file.getvalue()


def test_no_figure_is_broken_where_the_terminal_is_narrow(console):
    table = pd.DataFrame.from_dict(ROWS, "index", columns=COLUMNS)
    console.print(_terminal.terminal_table(table, "group"))
    words = said(console).split()
    for row in ROWS.values():
        assert all(figure in words for figure in row)
    assert max(map(len, said(console).splitlines())) <= 80


def test_words_are_printed_as_they_are(console):
    _terminal.print_text(console, "position [m] of sensor [bold]s1")
    _terminal.print_list(console, ["one " * 30, "other"])
    assert said(console).splitlines() == [
        "position [m] of sensor [bold]s1",
        "- " + "one " * 30,
        "- other",
    ]


def test_a_bar_ends_when_the_next_begins_and_the_last_with_the_work(console):
    with _progress.progress_bars(console, ["first", "second"]) as begin:
        begin("first")(1.0)
        begin("second")(0.5)
    first, second = said(console).strip().splitlines()[-2:]
    for name, shown in (("first", first), ("second", second)):
        assert shown.startswith(name)
        assert "100%" in shown and "took" in shown


def test_a_bar_for_any_function(console, monkeypatch):
    monkeypatch.setattr(_progress, "terminal_console", lambda: console)
    with bp.design.progress_bar("map") as progress:
        progress(0.5)
        progress(1.0)
    shown = said(console).strip().splitlines()[-1]
    assert shown.startswith("map") and "100%" in shown and "took" in shown


def test_brackets_in_a_table_are_no_markup(console):
    table = pd.DataFrame({"s1 [m]": ["0.2 [b]"]}, index=["[i]"])
    console.print(_terminal.terminal_table(table, "rank"))
    for word in ("s1 [m]", "0.2 [b]", "[i]"):
        assert word in said(console)
