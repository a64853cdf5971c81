"""Rows of benchmarks that take hours, whose parts are run one after another.

Where the environment names a folder in BENCHMARK_ROWS, a row that a file there holds is not
computed again, and a new one is added to it.
"""

import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Generic, TypeVar

Row = TypeVar("Row")


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
        path = self._path()
        if path is None or not path.exists():
            return []
        return [self.kind(**json.loads(line)) for line in path.read_text().splitlines()]

    def row(self, compute: Callable[[], Row], **key: str | int) -> Row:
        """Return the recorded row with these values of some fields, or compute and add it."""
        for row in self.recorded():
            if key.items() <= vars(row).items():
                return row
        row, path = compute(), self._path()
        if path is not None:
            with path.open("a") as file:
                file.write(json.dumps(asdict(row)) + "\n")
        return row

    def _path(self) -> Path | None:
        within = folder()
        return within / f"{self.name}.jsonl" if within else None
