"""Commands with the options that all of them share: what they begin with, and how they end."""

import functools
import inspect
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from ._begun import Common, begun
from ._options import AsJson, NoCache, Quiet, Traceback, WriteReport, out

Function = Callable[..., int]

_SHARED = {
    "quiet": (Quiet, False),
    "as_json": (AsJson, False),
    "report": (WriteReport, False),
    "no_cache": (NoCache, False),
    "traceback": (Traceback, False),
}
"""Annotations and defaults of the options of every command, which has `--out` besides."""

COMPUTING = ("report", "no_cache")
"""Options of commands that compute."""


class PlainCommand(TyperCommand):
    """A command of which `--help` shows no type of its flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Options and arguments, flags without a type."""
        return _without_types(TyperCommand.get_params(self, ctx))


class PlainGroup(TyperGroup):
    """The program, of which `--help` shows no type of its flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Options of the program, flags without a type."""
        return _without_types(TyperGroup.get_params(self, ctx))


def _without_types(parameters: list[Any]) -> list[Any]:
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters


def command(
    app: typer.Typer,
    name: str | None = None,
    *,
    without: Collection[str] = (),
    searches: bool = False,
    **shown: Any,
) -> Callable[[Function], Function]:
    """Make a function a command: it gets its output first, and returns the exit code.

    `without` are shared options that it does not have; `searches` says that it shares its work with
    other processes; `shown` is for `typer.Typer.command`.
    """

    def register(function: Function) -> Function:
        parameters = [*inspect.signature(function).parameters.values()][1:]
        source = "MODEL" if parameters[0].name == "model" else "FILE"
        shared = {"out": (out(source, name or function.__name__), None), **_SHARED}
        parameters += [_option(word, *shared[word]) for word in shared if word not in without]

        @functools.wraps(function)
        def run(**options: Any) -> None:
            # What computes nothing has nothing to cache.
            given = {word: options.pop(word, word == "no_cache") for word in shared}
            model, word = options[parameters[0].name], name or function.__name__
            common = Common(model, word, **given, searches=searches)
            with begun(common) as output:
                code = function(output, **_absolute(options))
                if code:
                    raise typer.Exit(code)

        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        app.command(name, cls=PlainCommand, **shown)(run)
        return function

    return register


def _absolute(options: dict[str, object]) -> dict[str, object]:
    """Options with paths that are the same wherever a model file goes."""
    return {
        word: value.absolute() if isinstance(value, Path) else value
        for word, value in options.items()
    }


def _option(name: str, annotation: object, default: object) -> inspect.Parameter:
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    return inspect.Parameter(name, kind, default=default, annotation=annotation)
