"""The search for missing effects, which `explain` and `improve` begin with."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from .._progress import progress_bars
from ..effects import library
from ._inputs import Inputs, read_inputs

Result = TypeVar("Result")


@dataclass(frozen=True)
class Request:
    """What a command that looks for missing effects was given.

    Parameters
    ----------
    path
        Model file or case folder.
    data
        Universal file of the measurement; None for that of the study.
    kinds
        Kinds of effects to try; None for all that apply.
    out
        Folder of the results.
    most_lines
        Most lines that are taken; None for all, unless there are too many values.
    model_error
        Whether a model error is declared.
    """

    path: Path
    data: Path | None
    kinds: list[str] | None
    out: Path
    most_lines: int | None
    model_error: bool = False

    def search(self, command: str, function: Callable[..., Result]) -> tuple[Inputs, Result]:
        """Read the inputs, and return them and the result of `explain` or `improve`."""
        inputs = read_inputs(
            self.path, self.data, command, self.out, self.most_lines, self.model_error
        )
        settings: dict[str, Any] = {"candidates": library(inputs.experiment, self.kinds)}
        with progress_bars(inputs.console, [command]) as begin:
            settings["progress"] = begin(command)
            return inputs, function(inputs.experiment, inputs.measurement, **settings)
