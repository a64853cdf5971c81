"""Commands of `bayes-placement` and their options; JAX is imported only once a command runs."""

from importlib.metadata import version as installed_version
from typing import Annotated

import typer

from ._begun import Common, begun
from ._errors import errors_in_words
from ._options import (
    About,
    Alone,
    AsJson,
    Baseline,
    Channels,
    Cost,
    Dask,
    Data,
    EarlierData,
    Effects,
    Engine,
    Estimator,
    FitEngine,
    Forbidden,
    ForeignFile,
    LeastDistance,
    Lines,
    Mapping,
    Marginal,
    ModelError,
    MostLines,
    NewFolder,
    NoCache,
    Noise,
    Out,
    Places,
    Quiet,
    Save,
    Search,
    Seed,
    Sensors,
    Shown,
    States,
    Study,
    Traceback,
    Workers,
    WriteReport,
)
from ._report_command import report

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)


def _show_version(wanted: bool) -> bool:
    if wanted:
        typer.echo(f"bayes-placement {installed_version('bayes_placement')}")
        raise typer.Exit
    return wanted


Version = Annotated[
    bool,
    typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
]


@app.callback()
def main(version: Version = False) -> None:
    """Bayesian updating of structures whose sensors are at uncertain positions.

    Exit codes: 0 done; 1 the model fails its check; 2 the command was typed wrongly; 3 the model
    file or the data are refused; 4 this program failed; 130 interrupted.
    """


@app.command()
def update(
    model: Study,
    data: Data = None,
    engine: Engine = None,
    marginal: Marginal = None,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    report: WriteReport = False,
    seed: Seed = 0,
    no_cache: NoCache = False,
    traceback: Traceback = False,
) -> None:
    """Infer what measured FRFs say about a model's parameters, with placement unknown."""
    common = Common(model, "update", out, quiet, as_json, report, no_cache, traceback)
    with begun(common) as output:
        from . import update

        _end(update.run(model, data, engine, marginal, output, seed))


@app.command()
def check(
    model: Study,
    data: Data = None,
    engine: FitEngine = "map",
    lines: MostLines = None,
    model_error: ModelError = False,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    report: WriteReport = False,
    seed: Seed = 0,
    no_cache: NoCache = False,
    traceback: Traceback = False,
) -> None:
    """Say whether a model explains measured FRFs; if not, at which sensor, in which band."""
    common = Common(model, "check", out, quiet, as_json, report, no_cache, traceback)
    with begun(common) as output:
        from . import check

        _end(check.run(model, data, engine, output, seed, lines, model_error))


@app.command()
def explain(
    model: Study,
    data: Data = None,
    effects: Effects = None,
    lines: MostLines = None,
    model_error: ModelError = False,
    baseline: Baseline = None,
    alone: Alone = False,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    report: WriteReport = False,
    no_cache: NoCache = False,
    traceback: Traceback = False,
) -> None:
    """Say which physical effect a model lacks, with a probability for each."""
    common = Common(model, "explain", out, quiet, as_json, report, no_cache, traceback)
    with begun(common) as output:
        from . import _missing_effects, explain

        kinds = _split(effects)
        request = _missing_effects.Request(
            model, data, kinds, output, lines, model_error, baseline, alone
        )
        _end(explain.run(request))


@app.command()
def improve(
    model: Study,
    data: Data = None,
    effects: Effects = None,
    lines: MostLines = None,
    model_error: ModelError = False,
    baseline: Baseline = None,
    state: States = None,
    alone: Alone = False,
    save: Save = None,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    report: WriteReport = False,
    no_cache: NoCache = False,
    traceback: Traceback = False,
) -> None:
    """Add what a model lacks, effect by effect, until only the noise is left."""
    common = Common(model, "improve", out, quiet, as_json, report, no_cache, traceback)
    with begun(common) as output:
        from . import _missing_effects, _save, improve

        kinds, states = _split(effects), _missing_effects.states_by_label(state or [])
        mended = None if save is None else _save.mended(save, model, data, model_error)
        request = _missing_effects.Request(
            model, data, kinds, output, lines, model_error, baseline, alone, states, mended
        )
        _end(improve.run(request))


@app.command(name="import")
def import_file(
    path: ForeignFile,
    mapping: Mapping = None,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    traceback: Traceback = False,
) -> None:
    """Turn files of other programs into a case folder, and say what was read and what was not."""
    common = Common(path, "import", out, quiet, as_json, False, True, traceback)
    with begun(common) as output:
        from . import import_file

        _end(import_file.run(path, mapping, output))


@app.command()
def place(
    model: Study,
    data: EarlierData = None,
    estimator: Estimator = "kde",
    search: Search = "exhaustive",
    about: About = None,
    sensors: Sensors = None,
    places: Places = 19,
    lines: Lines = 20,
    noise: Noise = None,
    least_distance: LeastDistance = None,
    forbidden: Forbidden = None,
    cost: Cost = None,
    workers: Workers = None,
    dask: Dask = None,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    report: WriteReport = False,
    seed: Seed = 0,
    no_cache: NoCache = False,
    traceback: Traceback = False,
) -> None:
    """Say where sensors and actuators tell most about the parameters, tolerances included."""
    common = Common(model, "place", out, quiet, as_json, report, no_cache, traceback)
    with begun(common) as output:
        from . import place

        options = place.Options(
            estimator=estimator,
            search=search,
            about=_split(about),
            sensors=sensors,
            places=places,
            lines=lines,
            noise=noise,
            workers=workers,
            dask=dask,
            seed=seed,
            least_distance=least_distance,
            forbidden=tuple(forbidden or ()),
            cost=tuple(cost or ()),
        )
        _end(place.run(model, data, options, output))


app.command()(report)


@app.command()
def show(
    path: Shown,
    out: Out = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    traceback: Traceback = False,
) -> None:
    """Show channels, places, FRFs and geometry of a model or file before anything is fitted."""
    common = Common(path, "show", out, quiet, as_json, False, True, traceback)
    with begun(common) as output:
        from . import show

        _end(show.run(path, output))


@app.command()
def init(folder: NewFolder, channels: Channels = None, traceback: Traceback = False) -> None:
    """Write a commented model file to begin with, from a channel table where there is one."""
    with errors_in_words(folder, show_traceback=traceback):
        from . import init

        typer.echo(init.run(folder, channels))


def _end(code: int) -> None:
    """End a command with an exit code."""
    if code:
        raise typer.Exit(code)


def _split(words: str | None) -> list[str] | None:
    return None if words is None else [word.strip() for word in words.split(",")]
