"""Commands with the options that all of them share, what they begin with, and their help."""

import functools
import hashlib
import inspect
import os
import platform
import re
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

from ._errors import errors_in_words
from ._options import AsJson, NoCache, Quiet, Traceback, WriteReport, out
from .results import cache_folder, delete_old_files, folder_of_fits

if TYPE_CHECKING:
    from ._run import Output

OF_HELPERS = (
    "bayes_placement.criticism.missing.improve",
    "bayes_placement.plots.ledger",
    "matplotlib.backends.backend_agg",
)
"""What helpers need for a search and its figures; they import it while the model is read."""


class Common(NamedTuple):
    """What every command is given."""

    model: Path
    command: str
    out: Path | None
    quiet: bool
    as_json: bool
    report: bool
    no_cache: bool
    traceback: bool
    searches: bool


@contextmanager
def begun(options: Common) -> Iterator["Output"]:
    """Run a command in its folder, with the compilation cache, and with errors for people."""
    with errors_in_words(options.model, show_traceback=options.traceback, as_json=options.as_json):
        # Zeros and overflows within this package and its libraries are treated where they occur;
        # those of a model file are the user's to see.
        warnings.filterwarnings(
            "ignore", category=RuntimeWarning, module=r"(?!_model_)", append=True
        )
        fits = None
        if not options.no_cache:
            use_compilation_cache()
            fits = folder_of_fits()
        if options.searches:
            from .._shared.processes import begin_with_helpers

            begin_with_helpers(*OF_HELPERS)
        from ._result_folder import result_folder

        out = None if options.out is None else options.out.absolute()
        with result_folder(options.model.absolute(), options.command, out) as folder:
            from ._run import Output

            shown = options.quiet, options.as_json, options.report
            yield Output(folder, *shown, fits, options.traceback)


SHORTEST_COMPILATION = 0.01
"""Compilations that take less [s] are not worth a file: one is read in some milliseconds."""


def use_compilation_cache() -> None:
    """Keep compiled functions in a folder of the user's cache directory.

    A cache that the user has chosen (the environment variable JAX_COMPILATION_CACHE_DIR) is used as
    it is; where no folder can be made, there is none.
    """
    # XLA reports every difference between two processors as an error, although it checks them. It
    # reads this when JAX is imported.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    import jax

    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", SHORTEST_COMPILATION)
    if jax.config.values["jax_compilation_cache_dir"]:
        return
    folder = cache_folder(f"jax-{jax.__version__}-{_processor()}")
    if folder is None:
        return
    delete_old_files(folder.parent.glob("jax-*/*-cache"))
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    # A file that another run is just writing cannot be read; the function is then compiled.
    warnings.filterwarnings(
        "ignore", message=".*persistent compilation cache", category=UserWarning, append=True
    )


def _processor() -> str:
    """Name of a processor and its instructions: others may not run what was compiled for it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    instructions = [line for line in lines if line.startswith(("flags", "Features"))]
    known = [platform.machine(), platform.processor(), *instructions[:1]]
    return hashlib.sha256(" ".join(known).encode()).hexdigest()[:12]


Function = Callable[..., int]
BY_POSITION = inspect.Parameter.POSITIONAL_OR_KEYWORD

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
        parameters += [
            inspect.Parameter(word, BY_POSITION, default=default, annotation=annotation)
            for word, (annotation, default) in shared.items()
            if word not in without
        ]

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


def examples(*lines: str) -> str:
    """List commands as they are typed, without the name of the program."""
    typed = [f"- `bayes-placement {line}`" for line in lines]
    return "\n".join(["Examples:", "", *typed, "", ""])


REGISTRY = Path(__file__).parents[1] / "effects" / "registry.py"
"""Names are read from it as text, since effects load JAX."""

GROUPS = {
    "attached": "point_mass segment_mass rotary_inertia eccentric_mass tuned_absorber "
    "ground_spring ground_dashpot rotational_spring strut foundation maxwell_mount "
    "fractional_mount damping_layer cubic_stiffness coulomb_friction gap",
    "structure": "local_stiffness_loss region_stiffness_loss hysteretic_damping "
    "viscoelastic_modulus modulus_change axial_preload member_preload shear_and_rotary_inertia "
    "residual_modes further_mode dimension_error beyond_prior",
    "supports": "compliant_support soft_support loose_joint",
    "sensors and actuators": "gain_error misplaced_sensor misplaced_actuator reversed_sensor "
    "reversed_channel swapped_sensors swapped_actuators sensor_mass actuator_mass stinger "
    "mount_resonance low_pass high_pass channel_delay cross_axis",
    "record": "time_delay exponential_window frequency_drift frequency_scale phase_drift mains_hum",
}
"""Names of effects by what they are part of."""

LAWS = {"attached", "inserted", "over", "modulus"}
"""They hold a law that is typed in Python, and no search suggests one."""


def effects_by_group() -> str:
    """List all effects that `--effects` takes, a line for each group."""
    names = re.findall(r"^from \.\w+ import \w+ as (\w+)$", REGISTRY.read_text(), re.MULTILINE)
    groups = {title: words.split() for title, words in GROUPS.items()}
    known = {name for words in groups.values() for name in words} | LAWS
    others = [name for name in names if name not in known]
    listed = groups | ({"others": others} if others else {})
    lines = [f"- {title}: {', '.join(words)}" for title, words in listed.items()]
    return "\n".join(["Effects:", "", *lines])
