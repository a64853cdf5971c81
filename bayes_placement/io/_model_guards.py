"""What a model file may not do to the program that runs it."""

import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NoReturn

import jax
import numpy as np

from .._shared.errors import InputError

SETTINGS = (
    "jax_enable_x64",
    "jax_default_matmul_precision",
    "jax_default_prng_impl",
    "jax_default_dtype_bits",
    "jax_numpy_dtype_promotion",
    "jax_numpy_rank_promotion",
    "jax_random_seed_offset",
    "jax_threefry_partitionable",
    "jax_disable_jit",
    "jax_debug_nans",
    "jax_debug_infs",
)
"""Settings of JAX that change numbers, or what is computed at all."""

ENDS = ("_exit", "abort", "execv", "execve")
"""Functions of `os` that end a program at once; all of its `exec` functions call the last two."""


@contextmanager
def guarded(path: Path) -> Iterator[None]:
    """Run a model file so that it leaves the program as it was.

    The folder, standard output and error, filters of warnings and errors of NumPy are as before. A
    model that ends the program, or changes a setting of JAX that changes numbers, is refused.
    """
    before = _settings()
    streams = redirect_stdout(sys.stdout), redirect_stderr(sys.stderr)
    with (
        chdir(Path.cwd()),
        streams[0],
        streams[1],
        warnings.catch_warnings(),
        np.errstate(),
        _ends_told(),
    ):
        try:
            yield
        except (Exception, KeyboardInterrupt):
            raise
        except BaseException as error:  # SystemExit, and others that no program catches
            raise _ended(path, error) from error
    _check_settings(path, before)


@contextmanager
def _ends_told() -> Iterator[None]:
    """Let functions raise that end a program without a word; in a fork they end that."""
    home, ends = os.getpid(), {name: getattr(os, name) for name in ENDS}

    def told(name: str) -> Callable[..., NoReturn]:
        def end(*arguments: Any) -> NoReturn:
            if os.getpid() != home:
                ends[name](*arguments)
            raise SystemExit(f"os.{name}")

        return end

    for name in ends:
        setattr(os, name, told(name))
    try:
        yield
    finally:
        for name, function in ends.items():
            setattr(os, name, function)


def _ended(path: Path, error: BaseException) -> InputError:
    frames = traceback.extract_tb(error.__traceback__)
    # A GeneratorExit comes here without the frames in which it was raised.
    lines = [f", line {frame.lineno}" for frame in frames if frame.filename == str(path)]
    return InputError(
        f"{path}{lines[0] if lines else ''}: the model file ended the program ({error!r}); it must "
        "run to its end, since `experiment` is read from it then. Leave that line out, or put what "
        'is no part of the model below if __name__ == "__main__":'
    )


def _settings() -> dict[str, Any]:
    return {name: jax.config.values[name] for name in SETTINGS if name in jax.config.values}


def _check_settings(path: Path, before: dict[str, Any]) -> None:
    """Refuse a changed setting, once it is as it was."""
    changed = {name: value for name, value in _settings().items() if value != before[name]}
    for name in changed:
        jax.config.update(name, before[name])
    for name, value in changed.items():
        raise InputError(
            f"{path} set {name} to {value!r}; {before[name]!r} is needed, since it changes "
            f'numbers of all that is computed. Leave out jax.config.update("{name}", ...).'
        )
