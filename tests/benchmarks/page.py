"""The page of figures: what was measured, its anchor of the same run, and what was asked.

pytest-benchmark compares times of repeated calls; these figures are ratios, rates and memory, many
of them of processes begun afresh. Two files of `--json` are compared by
`python -m tests.benchmarks.page before.json after.json`.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from typing import NamedTuple

from rich import box
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
WIDTH = 160


class Bound(NamedTuple):
    """What is asked of a figure, or of its ratio to the anchor."""

    words: str
    number: float

    def holds(self, number: float) -> bool:
        return number <= self.number if self.words == "at most" else number >= self.number

    def __str__(self) -> str:
        return f"{self.words} {self.number:g}"


def at_most(number: float) -> Bound:
    return Bound("at most", number)


def at_least(number: float) -> Bound:
    return Bound("at least", number)


class Anchor(NamedTuple):
    """What a figure is compared with, in the same unit; NaN where it could not be measured."""

    name: str
    value: float = float("nan")


@dataclass(frozen=True)
class Figure:
    """A figure as it is shown and stored; `load` is the work on the machine besides, in cores."""

    value: float
    unit: str
    anchor: str
    anchor_value: float | None
    ratio: float | None
    asked: str
    met: bool | None
    load: float

    def cells(self) -> list[str]:
        value = self.anchor_value
        return [
            quantity(self.value, self.unit),
            self.anchor if value is None else f"{self.anchor}: {quantity(value, self.unit)}",
            "" if self.ratio is None else f"{self.ratio:.3g}",
            self.asked,
            {None: "", True: "yes", False: "NO"}[self.met],
            f"{self.load:.1f}",
        ]


def quantity(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}"


class Page:
    """Figures by name, in the order in which they were measured.

    Parameters
    ----------
    path
        File in which they are kept: a page is measured part by part, at one commit.
    """

    def __init__(self, path: Path | None = None):
        self.path = path
        self.figures: dict[str, Figure] = {}
        if path is not None and path.exists():
            stored = json.loads(path.read_text())
            if stored["commit"] != commit():
                raise ValueError(
                    f"{path} holds figures of commit {stored['commit']}; a file of commit "
                    f"{commit()} is needed, since a page is of one commit: name another file."
                )
            self.figures = figures_of(stored)

    def add(
        self,
        name: str,
        value: float,
        unit: str,
        asked: Bound | None = None,
        *,
        anchor: Anchor | None = None,
        rate: bool = False,
    ) -> Figure:
        """Note a figure; with an anchor, what is asked is asked of the ratio.

        The ratio says how many times as fast as its anchor a figure is: `rate` tells figures that
        are the better the greater they are. That to a floor says how many floors it takes.
        """
        compared = None if anchor is None or anchor.value != anchor.value else anchor.value
        ratio = None if compared is None else value / compared
        if ratio is not None and not rate and asked is not None and asked.words == "at least":
            ratio = 1 / ratio
        judged = value if anchor is None else ratio
        figure = Figure(
            value=float(value),
            unit=unit,
            anchor="" if anchor is None else anchor.name,
            anchor_value=compared,
            ratio=ratio,
            asked="" if asked is None else str(asked),
            met=None if asked is None or judged is None else bool(asked.holds(judged)),
            load=os.getloadavg()[0],
        )
        self.figures[name] = figure
        if self.path is not None:
            self.path.write_text(json.dumps(self.to_json(), indent=1))
        return figure

    def to_json(self) -> dict:
        return {
            "commit": commit(),
            "machine": machine(),
            "figures": {name: asdict(figure) for name, figure in self.figures.items()},
        }

    def lines(self) -> Iterator[str]:
        """The table, and where it was measured."""
        columns = ["figure", "measured", "anchor", "ratio", "asked", "met", "load"]
        rows = [[name, *figure.cells()] for name, figure in self.figures.items()]
        yield from drawn(columns, rows)
        yield f"commit {commit()}; {machine()}; load: mean number of running processes"


def figures_of(stored: dict) -> dict[str, Figure]:
    return {name: Figure(**figure) for name, figure in stored["figures"].items()}


def commit() -> str:
    """Name of the commit; `-dirty` where files differ from it."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()


def machine() -> str:
    cores = len(os.sched_getaffinity(0))
    return f"{platform.machine()}, {cores} cores, Python {platform.python_version()}, " + ", ".join(
        f"{package} {version(package)}" for package in ("jax", "numpy", "scipy")
    )


def compared(before: dict, after: dict) -> Iterator[str]:
    """Both pages side by side: figures, and how many times the later is the earlier."""
    old, new = figures_of(before), figures_of(after)
    columns = ["figure", before["commit"], after["commit"], "ratio", "asked", "met", "loads"]
    rows = []
    for name in [*old, *(name for name in new if name not in old)]:
        pair = [figures.get(name) for figures in (old, new)]
        last = pair[1] or pair[0]
        both = None not in pair
        rows.append(
            [
                name,
                *("" if figure is None else told(figure) for figure in pair),
                f"{pair[1].value / pair[0].value:.3g}" if both else "",
                last.asked,
                *last.cells()[-2:-1],
                " ".join("" if figure is None else f"{figure.load:.1f}" for figure in pair),
            ]
        )
    yield from drawn(columns, rows)


def told(figure: Figure) -> str:
    value = quantity(figure.value, figure.unit)
    return value if figure.ratio is None else f"{value} ({figure.ratio:.3g})"


def drawn(columns: list[str], rows: list[list[str]]) -> list[str]:
    """Lines of a table."""
    table = Table(*columns, box=box.SIMPLE, show_edge=False)
    for row in rows:
        table.add_row(*row)
    console = Console(width=WIDTH, file=StringIO())
    console.print(table)
    return console.file.getvalue().rstrip().splitlines()


if __name__ == "__main__":
    pages = [json.loads(Path(name).read_text()) for name in sys.argv[1:]]
    print("\n".join(compared(*pages)))
