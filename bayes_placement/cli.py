"""cli: in, the words of a command line; out, tables in the terminal and files in a folder.

Not known here: any physics or statistics. JAX is imported only once a command runs.
"""

import enum
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


class MarginalName(enum.StrEnum):
    """Marginals by name."""

    LATENT = "latent"
    QUADRATURE = "quadrature"
    KDE = "kde"


Model = Annotated[Path, typer.Argument(help="Python file that defines `experiment`.")]
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
Out = Annotated[Path, typer.Option(help="Folder for result.nc, tables and figures.")]
Seed = Annotated[int, typer.Option(help="The same seed gives the same result.")]


@app.callback()
def main() -> None:
    """Bayesian updating of structures whose sensors sat nobody knows exactly where."""


@app.command()
def update(
    model: Model,
    data: Data = None,
    engine: EngineOption = EngineName.ALL,
    marginal: MarginalOption = None,
    out: Out = Path("results"),
    seed: Seed = 0,
) -> None:
    """Infer what measured FRFs say about a model's parameters, with placement unknown."""
    from . import commands

    try:
        chosen = None if marginal is None else marginal.value
        commands.update(model, data, engine.value, chosen, out, seed)
    except (ValueError, OSError) as error:
        typer.secho(f"error: {error}", err=True, fg="red")
        raise typer.Exit(2) from error
