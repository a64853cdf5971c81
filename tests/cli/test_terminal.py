"""Tables of any width, text without markup, and progress bars that end."""

import io

import pandas as pd
import pytest
from rich.console import Console

import bayes_placement as bp
from bayes_placement._shared import progress as shown_progress
from bayes_placement._shared.errors import COMMANDS, in_commands
from bayes_placement.cli import _terminal
from bayes_placement.design.running import chunks
from bayes_placement.inference.engines.map import _warnings as map_warnings

ROWS = {
    "all data": ["594", "2.14e+03", "0.995", "0.0409", "0", "9.46e-206", "0.123"],
    "band 1020 to 1212 Hz": ["75", "1.17e+03", "0.999", "0.115", "0", "3.01e-79", "0.456"],
}
COLUMNS = [
    "data",
    "reduced chi-square",
    "expected",
    "spread",
    "p",
    "p of whiteness",
    "predictive p",
]


@pytest.fixture
def console():
    return Console(file=io.StringIO(), width=80)


@pytest.fixture
def terminal():
    return Console(file=io.StringIO(), width=80, force_terminal=True)


def said(console):
    return console.file.getvalue()


def test_no_figure_is_broken_where_the_terminal_is_narrow(console):
    table = pd.DataFrame.from_dict(ROWS, "index", columns=COLUMNS)
    console.print(_terminal.terminal_table(table, "group", 80))
    words = said(console).split()
    for row in ROWS.values():
        assert all(figure in words for figure in row)
    assert max(map(len, said(console).splitlines())) <= 80


WIDE = {
    "effect": ["shear_and_rotary_inertia", "misplaced_actuator"],
    "probability": ["0.999", "0.001"],
    "reduced chi-square": ["1.02", "2.14e+03"],
    "log evidence gained": ["1264254", "-1.2"],
    "held out": ["3.214", "-4.1"],
    "p of score": ["1.2e-300", "0.5"],
    "parameters": [
        "share 1.0003 ± 0.0002, 367.8 mm, (95 %: 365.4 to 370.2), loss",
        "offset 0.01 ± 0.002 m",
    ],
}


@pytest.mark.parametrize("width", [60, 80, 100, 140])
def test_no_word_is_broken_at_any_width(width):
    console = Console(file=io.StringIO(), width=width)
    table = pd.DataFrame(WIDE).set_index("effect")
    console.print(_terminal.terminal_table(table, "effect", width))
    text = said(console)
    for column, cells in WIDE.items():
        assert all(word in text.split() for word in column.split())
        for cell in cells:
            words = cell.replace("at ", "").split(", ")
            assert all(word in text for word in words)
    assert max(map(len, text.splitlines())) <= width


def test_columns_that_are_not_plain_are_explained(console):
    screen = _terminal.Screen(console, console)
    screen.table(pd.DataFrame(WIDE).set_index("effect"), "effect")
    assert "held out: how well data left out of the fit are predicted" in said(console)
    assert "nat:" not in said(console)
    screen.table(pd.DataFrame({"information [nat]": ["2.1"]}), "rank")
    assert "nat: unit of information" in said(console)


def test_words_are_printed_as_they_are(console):
    screen = _terminal.Screen(console, console)
    screen.text("position [m] of sensor [bold]s1")
    screen.list(["one " * 30, "other"])
    assert said(console).splitlines() == [
        "position [m] of sensor [bold]s1",
        "- " + "one " * 30,
        "- other",
    ]


def test_advice_is_in_commands(console):
    screen = _terminal.Screen(console, console)
    screen.list(map_warnings(True, 0.9, 1, 8))
    screen.text("a change of the structure: baseline=before.")
    text = said(console)
    assert "direction; use bayes-placement update --engine smc." in text
    assert "more starts, engine = bp.engines.MAP(starts=128) in the model file." in text
    assert "change of the structure: --baseline before.uff." in text
    assert "engines.SMC()" not in text


def test_every_line_of_advice_has_a_command_and_no_other_is_changed(console):
    for line, command in COMMANDS.items():
        assert in_commands(f"so use {line}.") == f"so use {command}."
    assert in_commands("engine=bp.engines.SMC()") == "engine=bp.engines.SMC()"


def test_a_verdict_is_bold_on_a_terminal_and_plain_in_a_file(console, terminal):
    for place in (console, terminal):
        screen = _terminal.Screen(place, place)
        screen.verdict("The model fails.")
        screen.always("Results are in results/")
    assert said(console) == "The model fails.\nResults are in results/\n"
    assert said(terminal) == "\x1b[1mThe model fails.\x1b[0m\nResults are in results/\n"


def test_a_bar_ends_when_the_next_begins_and_the_last_with_the_work(terminal):
    with shown_progress.progress_bars(terminal, ["first", "second"]) as begin:
        begin("first")(1.0)
        begin("second")(0.5)
    *_, first, second = (line for line in said(terminal).splitlines() if "took" in line)
    for name, shown in (("first", first), ("second", second)):
        assert name in shown
        assert "100%" in shown and "took" in shown


def test_a_bar_for_any_function(terminal, monkeypatch):
    monkeypatch.setattr(chunks, "progress_console", lambda: terminal)
    with bp.design.progress_bar("map") as progress:
        progress(0.5)
        progress(1.0)
    *_, shown = (line for line in said(terminal).splitlines() if "took" in line)
    assert "map" in shown and "100%" in shown


def test_progress_in_a_file_is_plain_lines_that_never_run_backwards(console, monkeypatch):
    clock = iter(range(0, 1000, 6))
    monkeypatch.setattr(shown_progress.time, "monotonic", lambda: float(next(clock)))
    with shown_progress.progress_bars(console, ["map"]) as begin:
        report = begin("map")
        for share in (0.1, 0.5, 0.3, 0.4, 0.75):
            report(share)
    assert said(console).splitlines() == [
        "map: 50 %, about 12 s left",
        "map: 75 %, about 10 s left",
        "map: 100 %, took 36 s",
    ]


def test_no_time_left_is_told_before_enough_is_done(console, terminal, monkeypatch):
    with shown_progress.progress_bars(terminal, ["map"]) as begin:
        begin("map")(0.01)
    assert "-:--:--" in said(terminal)
    clock = iter(range(0, 1000, 20))
    monkeypatch.setattr(shown_progress.time, "monotonic", lambda: float(next(clock)))
    with shown_progress.progress_bars(console, ["map"]) as begin:
        report = begin("map")
        for share in (0.001, 0.019, 0.1):
            report(share)
    first, second, third, _ = said(console).splitlines()
    assert (first, second) == ("map: 0 %", "map: 2 %")
    assert third.startswith("map: 10 %, about") and third.endswith("left")


@pytest.mark.parametrize(
    ("reports", "times"),
    [
        ([(10, 0.01), (20, 0.02), (30, 0.03)], 1),  # 16 min are left at 2 and 3 %
        ([(10, 0.02), (20, 0.04), (300, 0.3)], 1),  # 12 min are left at 30 %
        ([(10, 0.02), (20, 0.04), (3000, 0.6)], 0),  # 33 min, of which few would be saved
        ([(10, 0.01), (20, 0.1)], 0),
    ],
)
def test_advice_is_given_once_where_much_time_is_left(monkeypatch, reports, times):
    clock, shares, advice = iter([0, *(time for time, _ in reports)]), [], []
    monkeypatch.setattr(shown_progress.time, "monotonic", lambda: float(next(clock, 0)))
    report = shown_progress.with_advice(shares.append, lambda: advice.append("shorter"))
    for _, share in reports:
        report(share)
    assert shares == [share for _, share in reports]
    assert len(advice) == times


def test_a_bar_never_runs_backwards(terminal):
    with shown_progress.progress_bars(terminal, ["map"]) as begin:
        report = begin("map")
        report(0.5)
        report(0.2)
        shares = [task.completed for task in report.__closure__[1].cell_contents.bars.tasks]
    assert shares == [0.5]


def test_progress_and_answers_go_to_different_places():
    screen = _terminal.Screen.of(quiet=False, as_json=False)
    assert screen.progress_console.stderr and not screen.console.stderr


def test_brackets_in_a_table_are_no_markup(console):
    table = pd.DataFrame({"s1 [m]": ["0.2 [b]"]}, index=["[i]"])
    console.print(_terminal.terminal_table(table, "rank", 80))
    for word in ("s1 [m]", "0.2 [b]", "[i]"):
        assert word in said(console)
