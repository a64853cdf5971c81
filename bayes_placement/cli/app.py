"""Commands of `bayes-placement` and their options; JAX is imported only once a command runs."""

from importlib.metadata import version as installed_version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from . import _options as option
from ._command import COMPUTING, PlainCommand, PlainGroup, command, effects_by_group, examples
from ._errors import errors_in_words

if TYPE_CHECKING:
    from ._run import Output

BEGIN, ASK, HAND_ON = "Begin", "Ask", "Hand on"
"""Groups of commands."""

app = typer.Typer(
    cls=PlainGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


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

    Begin with `bayes-placement init`, or `bayes-placement improve models/hidden_effect.py`. Options
    and examples of a command: `bayes-placement improve --help`.

    Exit codes: 0 done; 1 the model fails its check; 2 the command was typed wrongly; 3 the model
    file or the data are refused; 4 this program failed; 5 its words could not be printed; 129, 130,
    143 stopped.
    """


@app.command(
    cls=PlainCommand,
    rich_help_panel=BEGIN,
    epilog=examples("init bar", "init bar --channels channels.xlsx", "init laboratory --case"),
)
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


@command(
    app,
    without=COMPUTING,
    rich_help_panel=BEGIN,
    epilog=examples("show model.py", "show model.py --data measured.uff", "show measured.uff"),
)
def show(output: "Output", path: option.Shown, data: option.ShownData = None) -> int:
    """Show channels, places, FRFs and geometry of a model or file before anything is fitted."""
    from . import show

    return show.run(path, data, output)


@app.command(
    cls=PlainCommand,
    rich_help_panel=BEGIN,
    context_settings={"ignore_unknown_options": True},  # numbers of the effect
    epilog=examples(
        "add model.py point_mass --mass 0.5 --at 0.37 --save heavier.py",
        "add model.py ground_spring --stiffness 'LogUniform(1e3, 1e6)' --at 0.2 --save held.py",
    )
    + effects_by_group(),
)
def add(
    model: option.Study,
    effect: option.EffectName,
    save: option.NewModel,
    numbers: option.Numbers = None,
    quiet: option.Quiet = False,
    as_json: option.AsJson = False,
    traceback: option.Traceback = False,
) -> None:
    """Write a model with one effect more, whose numbers and places are typed in SI."""
    with errors_in_words(model, show_traceback=traceback, as_json=as_json):
        from . import add
        from ._terminal import Screen

        sentence = add.run(model, effect, numbers or [], save)
        Screen.of(quiet, as_json).written("add", sentence, [save])


@command(
    app,
    "import",
    without=COMPUTING,
    rich_help_panel=BEGIN,
    epilog=examples("import measured.mat --mapping measured.toml --out case"),
)
def import_file(output: "Output", path: option.ForeignFile, mapping: option.Mapping = None) -> int:
    """Turn files of other programs into a case folder, and say what was read and what was not."""
    from . import measured_files

    return measured_files.run_import(path, mapping, output)


@command(
    app,
    without=COMPUTING,
    rich_help_panel=BEGIN,
    epilog=examples("identify measured.uff", "identify hammer.uff --shapes-at actuators"),
)
def identify(
    output: "Output", data: option.MeasuredFile, shapes_at: option.ShapesAt = "sensors"
) -> int:
    """Identify natural frequencies, damping and mode shapes of FRFs, without a model."""
    from . import measured_files

    return measured_files.run_identify(data, shapes_at, output)


@command(
    app,
    rich_help_panel=ASK,
    epilog=examples("update model.py --data measured.uff", "update model.py --engine all"),
)
def update(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    engine: option.Engine = None,
    marginal: option.Marginal = None,
    seed: option.Seed = 0,
    workers: option.Workers = None,
    dask: option.Dask = None,
) -> int:
    """Infer what measured FRFs say about a model's parameters, with placement unknown."""
    from . import update

    return update.run(model, data, engine, marginal, output, seed, workers, dask)


@command(app, rich_help_panel=ASK, epilog=examples("check model.py --data measured.uff"))
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


@command(
    app,
    searches=True,
    rich_help_panel=ASK,
    epilog=examples(
        "explain model.py --data measured.uff",
        "explain model.py --effects point_mass,compliant_support",
    )
    + effects_by_group(),
)
def explain(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    effects: option.Effects = None,
    lines: option.MostLines = None,
    model_error: option.ModelError = False,
    baseline: option.Baseline = None,
    alone: option.Alone = False,
    workers: option.Workers = None,
    dask: option.Dask = None,
) -> int:
    """Say which physical effect a model lacks, with a probability for each."""
    from . import _missing_effects, improve

    asked = model, data, _split(effects), output, lines, model_error, baseline, alone
    return improve.run_explain(_missing_effects.Request(*asked, workers=workers, dask=dask))


@command(
    app,
    searches=True,
    rich_help_panel=ASK,
    epilog=examples(
        "improve model.py --data measured.uff --report",
        "improve model.py --baseline before.uff",
        "improve model.py --save completed.py",
    )
    + effects_by_group(),
)
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
    workers: option.Workers = None,
    dask: option.Dask = None,
) -> int:
    """Add what a model lacks, effect by effect, until only the noise is left."""
    from . import _missing_effects, _save, improve

    kinds, states = _split(effects), _missing_effects.states_by_label(state or [])
    completed = None if save is None else _save.completed_model(save, model, data, model_error)
    asked = model, data, kinds, output, lines, model_error, baseline, alone, states, completed
    return improve.run(_missing_effects.Request(*asked, workers, dask))


@command(
    app,
    rich_help_panel=ASK,
    without=("report",),
    epilog=examples("explore model.py", "explore model.py --data measured.uff --port 8000"),
)
def explore(
    output: "Output",
    model: option.Study,
    data: option.Data = None,
    lines: option.MostLines = None,
    model_error: option.ModelError = False,
    baseline: option.Baseline = None,
    alone: option.Alone = False,
    port: option.Port = 0,
    no_browser: option.NoBrowser = False,
) -> int:
    """Open a page to compare a model with its data, change it by hand, fit and search."""
    from . import _missing_effects, explore

    request = _missing_effects.Request(
        model, data, None, output, lines, model_error, baseline, alone
    )
    return explore.run(request, port, not no_browser)


@command(
    app,
    rich_help_panel=ASK,
    epilog=examples(
        "place model.py --least-distance 0.05 --forbidden 0.4:0.45",
        "place model.py --data measured.uff --estimator separation",
    ),
)
def place(
    output: "Output",
    model: option.Study,
    data: option.EarlierData = None,
    estimator: option.Estimator = "kernel-gain",
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


@app.command(
    cls=PlainCommand,
    rich_help_panel=HAND_ON,
    epilog=examples(
        "report results/model/improve-1",
        'report results/model/improve-2 --to report.html --label "week 2"',
        'report results/model/improve-1 --title "Footbridge" --client "City" --photo bridge.jpg',
    ),
)
def report(
    results: option.Results,
    to: option.To = None,
    label: option.Label = None,
    title: option.Title = None,
    author: option.Author = None,
    client: option.Client = None,
    photo: option.Photo = None,
    comment: option.Comments = None,
    quiet: option.Quiet = False,
    as_json: option.AsJson = False,
    traceback: option.Traceback = False,
) -> None:
    """Write what a run found as one page that needs no network, and as JSON beside it."""
    with errors_in_words(results, show_traceback=traceback, as_json=as_json):
        from ..plots.report import write_report
        from ._terminal import Screen

        page = write_report(
            results,
            to=to,
            label=label,
            title=title,
            author=author,
            client=client,
            photo=photo,
            comments=comment or (),
        )
        files = [page, page.with_suffix(".json")]
        Screen.of(quiet, as_json).written("report", f"Report to hand on: {page}", files)


@app.command(
    cls=PlainCommand,
    rich_help_panel=HAND_ON,
    epilog=examples("results", "results --clean"),
)
def results(
    folder: option.AllResults = None,
    clean: option.Clean = False,
    quiet: option.Quiet = False,
    as_json: option.AsJson = False,
    traceback: option.Traceback = False,
) -> None:
    """List the results of all models with age and size, and delete fits that can be made again."""
    with errors_in_words(Path(), show_traceback=traceback, as_json=as_json):
        from . import results
        from ._terminal import Screen

        results.run(folder, clean, Screen.of(quiet, as_json))


def _split(words: str | None) -> list[str] | None:
    return None if words is None else [word.strip() for word in words.split(",")]
