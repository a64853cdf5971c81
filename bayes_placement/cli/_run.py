"""A run of a command: its folder, what it was given, the files that it has written, what is kept.

What an earlier run found is kept in the user's cache by a hash of all that it follows from. Inputs
of a question come in, what was found goes out; what is asked is not known there.
"""

import os
import pickle
import stat
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from .._shared.errors import WritingError, warn
from .._shared.files import Json, write_atomically, write_csv, write_json
from .._shared.parts import begun_in_helper
from ..experiment.content_hash import ArrayStore, content_hash
from ..experiment.modal_parameters import ModalParameters
from ..inference.record import now, versions
from ..io import modal_parameters, netcdf
from ..io.laws import write_law
from ..io.model import _sources
from ._errors import MODEL_FAILS
from ._result_folder import RECORD, ResultFolder, identified, records, source_of
from ._terminal import Screen

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

DOTS_PER_INCH = 120

Result = TypeVar("Result")

Drawing = Callable[[], Mapping[str, "Figure"]]
"""Draws figures that belong together, by the names of their files."""


def numbered(name: str, pages: "Sequence[Figure]") -> "dict[str, Figure]":
    """Pages of a figure by the names of their files, numbered from the second on."""
    stem, suffix = Path(name).stem, Path(name).suffix
    further = {f"{stem}_{number}{suffix}": page for number, page in enumerate(pages[1:], 2)}
    return {name: pages[0], **further}


@dataclass(frozen=True)
class Run:
    """A run of a command; each file that it writes is complete or not there.

    `top` is the folder of its results, `folder` the same or one in it for a part of them; `shared`
    is what the runs of one model share, `fits` what all runs share. `record` is the content of
    `run.json`: what it was given, and what it has written so far. `traceback` tells where a figure
    failed. `began` is in s; each of `unfinished` awaits a figure that is being written, and notes
    it.
    """

    command: str
    top: Path
    folder: Path
    shared: Path
    fits: Path | None
    record: Json
    with_report: bool = False
    traceback: bool = False
    began: float = field(default_factory=time.perf_counter)
    unfinished: list[Callable[[], None]] = field(default_factory=list)
    written: list[str] = field(default_factory=list)
    not_drawn: list[str] = field(default_factory=list)

    @property
    def files(self) -> list[str]:
        """Names of the files that have been written."""
        return list(self.record["files"])

    def within(self, name: str) -> "Run":
        """Return the run with a folder inside its own, for the files of a part of it."""
        return replace(self, folder=self.folder / name)

    def text(self, name: str, text: str) -> None:
        """Write a text file."""
        self._write(name, lambda path: path.write_text(f"{text}\n", encoding="utf-8"))

    def report(self, name: str, table: "pd.DataFrame", sentences: Sequence[str]) -> None:
        """Write a table and the sentences below it as text."""
        lines = [table.to_string(), "", *(f"- {sentence}" for sentence in sentences)]
        self.text(name, "\n".join(lines))

    def table(self, name: str, table: "pd.DataFrame", *, index: bool = True) -> None:
        """Write a table as CSV."""
        self._write(name, lambda path: write_csv(path, table, index=index))

    def law(self, name: str, table: "pd.DataFrame") -> None:
        """Write a law as measured as a universal file."""
        write_law(self.folder / name, table)
        self._note(name)

    def modes(self, name: str, modes: ModalParameters) -> None:
        """Write modal parameters with their covariances."""
        self._write(name, partial(modal_parameters.write, modes))

    def json(self, name: str, content: Json) -> None:
        """Write numbers and words, with the record of the run, as JSON."""
        changing = {"finished", "files", "verdict", "exit_code", "seconds"}
        request = {key: value for key, value in self.record.items() if key not in changing}
        record = {**content.get("record", {}), **request}
        write_json(self.folder / name, {**content, "record": record})
        self._note(name)

    def tree(self, name: str, result: "xr.DataTree") -> None:
        """Write a tree of results as netCDF."""
        netcdf.write(result, self.folder / name)
        self._note(name)

    def dataset(self, name: str, dataset: "xr.Dataset") -> None:
        """Write labelled arrays as netCDF."""
        # In memory first: HDF5 ends the interpreter where the disk is full.
        content = bytes(dataset.to_netcdf(engine="h5netcdf"))
        self._write(name, lambda path: path.write_bytes(content))

    def figures(self, *drawings: Drawing) -> None:
        """Draw and write figures by the names of their files, in a helper where one is idle.

        One that cannot be drawn is a sentence at the end of the run, which ends for no picture.
        """
        for drawing in drawings:
            self.attempt("A figure", partial(self._begin_figures, drawing))

    def attempt(self, what: str, draw: Callable[[], object]) -> None:
        """Draw something; where that fails, a sentence says so at the end of the run."""
        try:
            draw()
        except OSError:  # a full disk, of which all files are told
            raise
        except Exception as error:  # noqa: BLE001, the results of hours are worth more than a figure
            reason = " ".join(str(error).split())
            where = "".join(traceback.format_exception(error)).rstrip()
            self.not_drawn.append(
                f"{what} was not drawn ({type(error).__name__}: {reason}); all numbers are in the "
                "other files. Please report it"
                + (f":\n{where}" if self.traceback else ", with what --traceback tells.")
            )

    def kept(self, write: Callable[["Run"], Result], *inputs: object) -> Result:
        """Return what is written, with its files, or what an earlier run wrote for these inputs."""
        answer = KeptAnswer(self.fits, self.command, self.with_report, *inputs)
        result: Result
        if (known := answer.read()) is not None:
            result, files = known
            for name, content in files.items():
                self._write(name, partial(Path.write_bytes, data=content))
            return result
        part = replace(self, unfinished=[], written=[])
        result = write(part)
        part._end_figures()
        if not self.not_drawn:
            files = {name: (self.folder / name).read_bytes() for name in part.written}
            answer.write((result, files))
        return result

    def _end_figures(self) -> None:
        for end in reversed(self.unfinished):  # the last are those that no helper has begun
            self.attempt("A figure", end)

    def _begin_figures(self, drawing: Drawing) -> None:
        for name, figure in drawing().items():
            self.begin(name, partial(figure.savefig, dpi=DOTS_PER_INCH))

    def begin(self, name: str, write: Callable[[Path], object]) -> None:
        """Begin to write a file, in a helper where one is idle."""
        written = begun_in_helper(write_atomically, self.folder / name, write)
        self.unfinished.append(partial(self._note_when, written, name))

    def finish(
        self, screen: Screen, verdict: str, result: Mapping[str, object], *, passed: bool = True
    ) -> int:
        """Note that the run is complete, and say where its results are in the last line.

        The result is told where JSON is asked for. The exit code comes back.
        """
        self._end_figures()
        code = 0 if passed else MODEL_FAILS
        seconds = time.perf_counter() - self.began
        self.record.update(finished=True, verdict=verdict, exit_code=code, seconds=seconds)
        self._write_record()
        if self.with_report:
            self.attempt("The report", partial(self._write_report, screen))
        screen.list(self.not_drawn)
        screen.always(f"Results are in {self.top}/")
        screen.json({**self.record, "folder": str(self.top), "result": result})
        return code

    def _write_report(self, screen: Screen) -> None:
        from ..plots.report import write_report  # a second, which `explore` has no use for

        page = write_report(self.top)
        self._note(page.name)
        self._note(page.with_suffix(".json").name)
        screen.text(f"Report to hand on: {page}")

    def verdict(self, verdict: str) -> None:
        """Note what the run says, before its pictures are drawn."""
        self.record["verdict"] = verdict
        self._write_record()

    def _write(self, name: str, write: Callable[[Path], object]) -> None:
        write_atomically(self.folder / name, write)
        self._note(name)

    def _note_when(self, written: Callable[[], object], name: str) -> None:
        written()
        self._note(name)

    def _note(self, name: str) -> None:
        self.written.append(name)
        path = str(self.folder.relative_to(self.top) / name)
        if path not in self.record["files"]:
            self.record["files"].append(path)
        self._write_record()

    def _write_record(self) -> None:
        others = records(self.top)
        write_json(self.top / RECORD, {**others, self.command: self.record})


class Output(NamedTuple):
    """Where a command puts what it finds: a folder that is there, see also `Screen` and `Run`."""

    folder: ResultFolder
    quiet: bool = False
    as_json: bool = False
    report: bool = False
    fits: Path | None = None
    traceback: bool = False

    @property
    def screen(self) -> Screen:
        """Where the command shows what it does."""
        return Screen.of(self.quiet, self.as_json)

    def begin(
        self,
        command: str,
        model: Path,
        *,
        files: Sequence[Path] = (),
        seed: int = 0,
        **settings: object,
    ) -> Run:
        """Begin a run, of data from these files; settings are options of the command."""
        record: Json = {
            "command": command,
            "date": now(),
            "versions": versions(),
            "model": source_of(model),
            "data": [identified(file) for file in files if file.is_file()],
            "seed": seed,
            "units": "SI",
            "settings": {key: _plain(value) for key, value in settings.items()},
            "finished": False,
            "files": [],
        }
        folder, shared = self.folder
        given = self.fits, record, self.report, self.traceback
        return Run(command, folder, folder, shared, *given)


def _plain(value: object) -> object:
    """Write an option as JSON can hold it."""
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


NOT_WRITTEN = (pickle.PicklingError, AttributeError, TypeError)
"""Raised where an object of the user cannot be written to bytes."""


class KeptAnswer:
    """A result that follows from inputs, the text of the model and versions of libraries alone.

    Nothing is kept without a folder, or in one to which others may write: a result is a pickle.
    """

    def __init__(self, folder: Path | None, *inputs: object):
        self._files = ArrayStore(folder) if folder and _is_private(folder) else None
        try:
            self._key = "" if self._files is None else content_hash(versions(), _sources(), *inputs)
        except NOT_WRITTEN:
            self._files = None

    def read(self) -> Any:
        """Return what an earlier run found; None where none did."""
        known = None if self._files is None else self._files.read(self._key)
        return None if known is None else pickle.loads(known["content"].tobytes())

    def write(self, result: object) -> None:
        """Keep what was found; a run does not end where that fails."""
        if self._files is None:
            return
        try:
            content = np.frombuffer(pickle.dumps(result), np.uint8)
            self._files.write(self._key, {"content": content})
        except NOT_WRITTEN:
            return
        except WritingError as error:
            warn(f"What this run found is not kept for a later one: {error}")


def _is_private(folder: Path) -> bool:
    """Whether the user alone may write to a folder, which is made; on Windows its place says so."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if sys.platform == "win32":
        return True
    state = folder.stat()
    return state.st_uid == os.getuid() and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
