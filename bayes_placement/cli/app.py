"""app: in, the words of a command line; out, tables in the terminal and files in a folder.

Not known here: any physics or statistics. JAX is imported only once a command runs.
"""

import enum
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)


class EngineName(enum.StrEnum):
    """Engines by name."""

    ALL = "all"
    IMPORTANCE = "importance"
    GRID = "grid"
    MAP = "map"
    NUTS = "nuts"
    SMC = "smc"


class FitEngineName(enum.StrEnum):
    """Engines that fit a model to be criticised, by name."""

    MAP = "map"
    SMC = "smc"
    NUTS = "nuts"


class MarginalName(enum.StrEnum):
    """Marginals by name."""

    LATENT = "latent"
    QUADRATURE = "quadrature"
    KDE = "kde"


class EstimatorName(enum.StrEnum):
    """Estimators of information by name."""

    KDE = "kde"
    EXACT = "exact"
    EXPECTED_GAIN = "expected-gain"
    SEPARATION = "separation"


class SearchName(enum.StrEnum):
    """Ways to search for a placement by name."""

    EXHAUSTIVE = "exhaustive"
    SEQUENTIAL = "sequential"
    FORWARD = "forward"
    EVOLUTIONARY = "evolutionary"


Study = Annotated[
    Path,
    typer.Argument(help="Python file that defines `experiment`, or folder with case.json."),
]
Data = Annotated[
    Path | None,
    typer.Option(help="Measured FRFs (UFF dataset 58). Default: the model's `measurement`."),
]
EngineOption = Annotated[
    EngineName, typer.Option(help="One engine, or all of those that check each other.")
]
MarginalOption = Annotated[
    MarginalName | None,
    typer.Option(help="What becomes of the placement, with one engine. Default: latent."),
]
FitEngine = Annotated[
    FitEngineName,
    typer.Option(
        "--engine", help="Engine of the posterior: the fast Laplace approximation, or a sampler."
    ),
]
Effects = Annotated[
    str | None,
    typer.Option(
        help="Effects to be tried, with commas: point_mass,gain_error. Default: all that apply."
    ),
]
EstimatorOption = Annotated[
    EstimatorName,
    typer.Option(
        help="How information is estimated: the paper's KDE, placement integrated exactly, the "
        "average over data to come, or which of the explanations of --data is right."
    ),
]
SearchOption = Annotated[
    SearchName,
    typer.Option(help="All placements, one moved at a time, one added at a time, or CMA-ES."),
]
About = Annotated[
    str | None,
    typer.Option(
        help="Parameters to learn about, with commas, all others at nominal values: "
        "structure.damping.ratio.1. Default: all."
    ),
]
Sensors = Annotated[
    int | None, typer.Option(help="Sensors to place. Default: those that the model declares.")
]
Places = Annotated[
    int,
    typer.Option(
        help="Places to try for each sensor and actuator, evenly along a line, far apart in space.",
        min=1,
    ),
]
Lines = Annotated[
    int,
    typer.Option(help="Lines to use, evenly over the band, where the model has more.", min=1),
]
After = Annotated[
    Path | None,
    typer.Option(
        "--data",
        help="What has been measured (UFF dataset 58): the next measurement is to add to it.",
    ),
]
Sigma = Annotated[
    float | None,
    typer.Option(
        "--noise",
        help="Standard deviation of log10 of the amplitude. Default: as the model declares, or as "
        "the coherence of its data tells.",
    ),
]
Workers = Annotated[int | None, typer.Option(help="Processes on this machine.", min=1)]
Dask = Annotated[
    str | None,
    typer.Option(help='Dask scheduler, tcp://host:8786, or "local" with --workers processes.'),
]
Out = Annotated[Path, typer.Option(help="Folder for results, tables and figures.")]
Seed = Annotated[int, typer.Option(help="The same seed gives the same result.")]

RESULTS = Path("results")


@app.callback()
def main() -> None:
    """Bayesian updating of structures whose sensors sat nobody knows exactly where."""


@app.command()
def update(
    model: Study,
    data: Data = None,
    engine: EngineOption = EngineName.ALL,
    marginal: MarginalOption = None,
    out: Out = RESULTS,
    seed: Seed = 0,
) -> None:
    """Infer what measured FRFs say about a model's parameters, with placement unknown."""
    with _errors_in_words():
        from . import update as commands

        chosen = None if marginal is None else marginal.value
        commands.update(model, data, engine.value, chosen, out, seed)


@app.command()
def check(
    model: Study,
    data: Data = None,
    engine: FitEngine = FitEngineName.MAP,
    out: Out = RESULTS,
    seed: Seed = 0,
) -> None:
    """Say whether a model explains measured FRFs; if not, at which sensor, in which band."""
    with _errors_in_words():
        from . import criticism as criticism_commands

        criticism_commands.check(model, data, engine.value, out, seed)


@app.command()
def explain(
    model: Study,
    data: Data = None,
    engine: FitEngine = FitEngineName.MAP,
    effects: Effects = None,
    out: Out = RESULTS,
    seed: Seed = 0,
) -> None:
    """Say which physical effect a model lacks, with a probability for each."""
    with _errors_in_words():
        from . import criticism as criticism_commands

        criticism_commands.explain(model, data, engine.value, _words(effects), out, seed)


@app.command()
def improve(model: Study, data: Data = None, effects: Effects = None, out: Out = RESULTS) -> None:
    """Add what a model lacks, effect by effect, until only the noise is left."""
    with _errors_in_words():
        from . import criticism as criticism_commands

        criticism_commands.improve(model, data, _words(effects), out)


@app.command()
def place(
    model: Study,
    data: After = None,
    estimator: EstimatorOption = EstimatorName.KDE,
    search: SearchOption = SearchName.EXHAUSTIVE,
    about: About = None,
    sensors: Sensors = None,
    places: Places = 19,
    lines: Lines = 20,
    noise: Sigma = None,
    workers: Workers = None,
    dask: Dask = None,
    out: Out = RESULTS,
    seed: Seed = 0,
) -> None:
    """Say where sensors and actuators tell most about the parameters, tolerances included."""
    with _errors_in_words():
        from . import place as placement_commands

        options = placement_commands.Options(
            estimator.value,
            search.value,
            _words(about),
            sensors,
            places,
            lines,
            noise,
            workers,
            dask,
            seed,
        )
        placement_commands.run(model, data, options, out)


def _words(words: str | None) -> list[str] | None:
    return None if words is None else [word.strip() for word in words.split(",")]


@contextmanager
def _errors_in_words() -> Iterator[None]:
    """End with the words of an error in place of a traceback."""
    try:
        yield
    except (ValueError, OSError) as error:
        typer.secho(f"error: {error}", err=True, fg="red")
        raise typer.Exit(2) from error
