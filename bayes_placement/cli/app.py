"""Commands of `bayes-placement` and their options; JAX is imported only once a command runs."""

from importlib.metadata import version as installed_version
from typing import TYPE_CHECKING, Annotated

import typer

from . import _options as option
from ._command import COMPUTING, command
from ._errors import errors_in_words

if TYPE_CHECKING:
    from ._run import Output

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
    file or the data are refused; 4 this program failed; 5 its words could not be printed; 129, 130,
    143 stopped.
    """


@command(app)
def update(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    engine: option.Engine = None,
    marginal: option.Marginal = None,
    seed: option.Seed = 0,
) -> int:
    """Infer what measured FRFs say about a model's parameters, with placement unknown."""
    from . import update

    return update.run(model, data, engine, marginal, output, seed)


@command(app)
def check(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    engine: option.FitEngine = "map",
    lines: option.MostLines = None,
    model_error: option.ModelError = False,
    seed: option.Seed = 0,
) -> int:
    """Say whether a model explains measured FRFs; if not, at which sensor, in which band."""
    from . import check

    return check.run(model, data, engine, output, seed, lines, model_error)


@command(app, searches=True)
def explain(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    effects: option.Effects = None,
    lines: option.MostLines = None,
    model_error: option.ModelError = False,
    baseline: option.Baseline = None,
    alone: option.Alone = False,
) -> int:
    """Say which physical effect a model lacks, with a probability for each."""
    from . import _missing_effects, explain

    kinds = _split(effects)
    request = _missing_effects.Request(
        model, data, kinds, output, lines, model_error, baseline, alone
    )
    return explain.run(request)


@command(app, searches=True)
def improve(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    effects: option.Effects = None,
    lines: option.MostLines = None,
    model_error: option.ModelError = False,
    baseline: option.Baseline = None,
    state: option.States = None,
    alone: option.Alone = False,
    save: option.Save = None,
) -> int:
    """Add what a model lacks, effect by effect, until only the noise is left."""
    from . import _missing_effects, _save, improve

    kinds, states = _split(effects), _missing_effects.states_by_label(state or [])
    completed = None if save is None else _save.completed_model(save, model, data, model_error)
    request = _missing_effects.Request(
        model, data, kinds, output, lines, model_error, baseline, alone, states, completed
    )
    return improve.run(request)


@command(app, "import", without=COMPUTING)
def import_file(output: "Output", path: option.ForeignFile, mapping: option.Mapping = None) -> int:
    """Turn files of other programs into a case folder, and say what was read and what was not."""
    from . import import_file

    return import_file.run(path, mapping, output)


@command(app)
def place(
    output: "Output",
    model: option.Study,
    data: option.EarlierData = None,
    estimator: option.Estimator = "kde",
    search: option.Search = "exhaustive",
    about: option.About = None,
    sensors: option.Sensors = None,
    places: option.Places = 19,
    lines: option.Lines = 20,
    noise: option.Noise = None,
    least_distance: option.LeastDistance = None,
    forbidden: option.Forbidden = None,
    cost: option.Cost = None,
    workers: option.Workers = None,
    dask: option.Dask = None,
    seed: option.Seed = 0,
) -> int:
    """Say where sensors and actuators tell most about the parameters, tolerances included."""
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
    return place.run(model, data, options, output)


@app.command()
def report(
    results: option.Results,
    to: option.To = None,
    label: option.Label = None,
    title: option.Title = None,
    comment: option.Comments = None,
    quiet: option.Quiet = False,
    as_json: option.AsJson = False,
    traceback: option.Traceback = False,
) -> None:
    """Write what a run found as one page that needs no network, and as JSON beside it."""
    with errors_in_words(results, show_traceback=traceback, as_json=as_json):
        from ..plots.report import write_report
        from ._terminal import Screen

        page = write_report(results, to=to, label=label, title=title, comments=comment or ())
        files = [page, page.with_suffix(".json")]
        Screen.of(quiet, as_json).written("report", f"Report to hand on: {page}", files)


@command(app, without=COMPUTING)
def show(output: "Output", path: option.Shown) -> int:
    """Show channels, places, FRFs and geometry of a model or file before anything is fitted."""
    from . import show

    return show.run(path, output)


@app.command()
def init(
    folder: option.NewFolder,
    channels: option.Channels = None,
    case: option.AsCase = False,
    quiet: option.Quiet = False,
    as_json: option.AsJson = False,
    traceback: option.Traceback = False,
) -> None:
    """Write a commented model file or mapping to begin with, from a channel table if any."""
    with errors_in_words(folder, show_traceback=traceback, as_json=as_json):
        from . import init
        from ._terminal import Screen

        Screen.of(quiet, as_json).written("init", *init.run(folder, channels, case))


def _split(words: str | None) -> list[str] | None:
    return None if words is None else [word.strip() for word in words.split(",")]
