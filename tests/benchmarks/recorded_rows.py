"""Rows of benchmarks that take hours, whose parts are run one after another.

A row that is recorded beside this file is not computed again. Where the environment names another
folder in BENCHMARK_ROWS, rows there count instead, and new ones are added: name an empty folder to
compute all of them.
"""

import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Generic, TypeVar

Row = TypeVar("Row")

RECORDED = Path(__file__).parent / "rows"


def folder() -> Path | None:
    """Folder that the environment names; None where it names none."""
    name = os.environ.get("BENCHMARK_ROWS")
    return Path(name) if name else None


@dataclass(frozen=True)
class Rows(Generic[Row]):
    """Rows of one kind, a dataclass of what JSON holds, in the file of a name."""

    kind: type[Row]
    name: str

    def recorded(self) -> list[Row]:
        """Rows that the file holds."""
        path = (folder() or RECORDED) / f"{self.name}.jsonl"
        if not path.exists():
            return []
        return [self.kind(**json.loads(line)) for line in path.read_text().splitlines()]

    def row(self, compute: Callable[[], Row], **key: str | int) -> Row:
        """Return the recorded row with these values of some fields, or compute and add it."""
        for row in self.recorded():
            if key.items() <= vars(row).items():
                return row
        row, to = compute(), folder()
        if to is not None:
            with (to / f"{self.name}.jsonl").open("a") as file:
                file.write(json.dumps(asdict(row)) + "\n")
        return row

    def told(self, ask: Callable[..., Row], **key: str | int) -> Row:
        """Return the recorded row of what is asked, or ask, print and add it."""

        def asked() -> Row:
            row = ask(**key)
            print(row, flush=True)
            return row

        return self.row(asked, **key)
