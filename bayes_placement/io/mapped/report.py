"""What was read of a file, in which unit, and what was left out and why."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..._shared.reprs import notebook_html
from ...experiment.measurement import Measurement

if TYPE_CHECKING:
    pass

_CHUNK = 1 << 20


class ImportReport(NamedTuple):
    """What an import did.

    Parameters
    ----------
    source
        The file, what it is, and its checksum.
    read
        What was read and how, a sentence each.
    left_out
        What was not read, by name, and why.
    result
        What came out, in a sentence.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.read("measured.uff").report.left_out
    {}
    """

    source: str
    read: tuple[str, ...]
    left_out: Mapping[str, str]
    result: str

    def words(self) -> list[str]:
        """Sentences of the report, in their order."""
        left_out = [f"Left out: {name}, since {why}." for name, why in self.left_out.items()]
        return [self.source, *self.read, *left_out, self.result]

    def __repr__(self) -> str:
        """Say what came out."""
        return f"ImportReport: {self.result}"

    def _repr_html_(self) -> str:
        import pandas as pd

        return notebook_html(repr(self), pd.DataFrame(), self.words())

    def __str__(self) -> str:
        """One sentence a line."""
        return "\n".join(self.words())


def report(
    path: Path,
    form: str,
    sentences: Sequence[str],
    left_out: Mapping[str, str],
    measurement: Measurement,
) -> ImportReport:
    """Make the report of a file that was read."""
    source = f"{path} is {form} of {path.stat().st_size} bytes, sha256 {_checksum(path)[:16]}."
    return ImportReport(source, tuple(sentences), dict(left_out), repr(measurement))


def _checksum(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
    return digest.hexdigest()
