"""`bayes-placement explain` and `improve`: which effect a model lacks, and all that it lacks."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from ..criticism.missing._claims_in_words import claims_in_words
from ..criticism.missing.decide import is_unexplained
from ..criticism.missing.explain import explain
from ..criticism.missing.fitted_model import FittedModel
from ..criticism.missing.improve import improve
from ..criticism.missing.ledger import Ledger, misfit_columns
from ..criticism.missing.ranking import Ranking
from ..criticism.missing.states import LedgerOfStates
from ..criticism.reach.reach import Reach
from ..experiment.experiment import Measurements
from ..inference.engines import MAP
from ..io.laws import SIDES
from ..plots import ledger as ledger_plots
from ..plots import misfit as misfit_plots
from ..plots import modes as mode_plots
from ..plots import reach as reach_plots
from ..plots.report._style import look
from ..plots.report._svg import as_file, svg_of
from ._findings import FINDINGS, of_models, of_result, where_next
from ._inputs import Inputs, infer_posterior, named_method
from ._missing_effects import Request
from ._run import Drawing, Run, numbered
from ._save import CompletedModel
from ._terminal import Screen, command_on

FITS = "before_and_after.png"


def run(request: Request) -> int:
    """Add effects until only the noise is left, and write them; 1 where the model still fails."""
    inputs = request.read("improve")
    states = request.of_states(inputs.study)
    return _run_states(request, inputs, states) if states else _run_one(request, inputs)


def _run_one(request: Request, inputs: Inputs) -> int:
    """Treat one measurement, with a baseline or without."""
    screen = inputs.screen
    tell = partial(_tell_step, inputs.screen)
    ledger = request.search("improve", partial(improve, callback=tell), inputs)
    verdict, *further = ledger.words()
    screen.verdict(verdict)
    screen.table(ledger.table(), "added")
    show_reach(ledger.reach, inputs)
    screen.list(further)
    inputs.run.verdict(verdict)
    screen.list(write(ledger, inputs, inputs.run))
    if request.save is not None:
        _save(request.save, ledger, inputs)
    _baseline_first(request, ledger, screen)
    pictures = {
        "Where something may act": picture_of_where(ledger),
        "Response and error before and after": FITS,
    }
    for what, name in pictures.items():
        if name in inputs.run.files:  # what cannot be drawn is told at the end
            screen.text(f"{what}: {inputs.run.folder / name}")
    return inputs.run.finish(screen, verdict, ledger.to_json(), passed=not ledger.unexplained)


def _tell_step(screen: Screen, model: FittedModel) -> None:
    """Say what the search has found so far, and the error that is left."""
    what = " ".join(f"+ {model.named(name)}" for name in model.effects) or "as given"
    misfit = ", ".join(f"{word} {value}" for word, value in misfit_columns(model).items() if value)
    screen.step(f"So far: {what}: {misfit}")


def _baseline_first(request: Request, ledger: Ledger, screen: Screen) -> None:
    """Say the command that looks at a baseline that nothing explains, where one was given."""
    if request.baseline is not None and is_unexplained(ledger.rows.baseline, ledger.policy):
        command = command_on("improve", request.path, request.baseline, "--alone")
        screen.text(f"What is nearest for the baseline alone: {command}")


def _save(completed: CompletedModel, ledger: Ledger, inputs: Inputs) -> None:
    """Write the completed model, and its posterior to the folder of the results."""
    completed.write(inputs.experiment, ledger)
    method = named_method(inputs.study, "map", "latent")
    method = method._replace(engine=MAP(begin=ledger.steps[-1].values))
    with inputs.screen.progress(["posterior"]) as begin:
        posterior = infer_posterior(
            ledger.experiment, inputs.measurement, method, 0, begin("posterior")
        )
    inputs.run.tree("posterior.nc", posterior)
    has_errors = bool(ledger.steps[-1].model_error)
    said = f"Completed model: {completed.path}."
    if not ledger.verdict:
        said = (
            f"No effect is claimed: {completed.path} is the model as given, with what was fitted."
        )
    beside = _beside_errors(completed.model_error, has_errors)
    inputs.screen.text(f"{said} Its posterior: posterior.nc.{beside}")


def _beside_errors(is_declared: bool, has_errors: bool) -> str:
    """Say that the numbers were found beside a model error that the file does not declare."""
    if is_declared or not has_errors:
        return ""
    line = "experiment = experiment.with_model_error(bp.model_error.Embedded())"
    return f" Its numbers were found beside a model error, which it does not declare: {line}."


def _run_states(request: Request, inputs: Inputs, states: Mapping[str, Measurements]) -> int:
    """Treat several states; the ledger of each goes into a folder of its own."""
    screen, run = inputs.screen, inputs.run
    for label, measurement in [*states.items()][:-1]:  # those of the last were printed
        faults = inputs.experiment.check_data(measurement).sentences()
        screen.list(f'"{label}": {fault}' for fault in faults)
    of_states: Callable[..., LedgerOfStates] = improve
    ledger = request.searched("improve", of_states, inputs, states)
    verdict, *further = ledger.words()
    screen.verdict(verdict)
    screen.table(ledger.table(), "effect")
    screen.list(further)
    run.verdict(verdict)
    run.json("states.json", ledger.to_json())
    run.text("states.txt", str(ledger))
    run.table("states.csv", ledger.table())
    for number, (label, of_state) in enumerate(ledger.ledgers.items(), 1):
        within = run.within(f"state_{number}")
        write(of_state, inputs._replace(measurement=states[label]), within)
        screen.text(f'Ledger and figures of "{label}": {within.folder}/')
    explained = not any(of_state.unexplained for of_state in ledger.ledgers.values())
    return run.finish(screen, verdict, ledger.to_json(), passed=explained)


def write(ledger: Ledger, inputs: Inputs, run: Run) -> list[str]:
    """Write what was found, and return where to measure next in words."""
    falls = [lambda: {"error_falls.png": ledger_plots.error_falls(ledger)}]
    following = write_result(
        ledger,
        "ledger",
        inputs,
        run,
        falls,
        lambda kept: [lambda: _before_and_after(kept), lambda: residual_maps(kept)],
    )
    run.table("compared.csv", ledger.compared, index=False)
    return following


def _before_and_after(kept: xr.DataTree) -> dict[str, Figure]:
    """Figures of what was measured beside the model as given and with all effects, by name."""
    modes = of_models(kept, "modes")
    if modes:
        return {FITS: mode_plots.compared(modes)}
    return numbered(FITS, ledger_plots.before_and_after_pages(of_models(kept, "fit")))


def residual_maps(kept: xr.DataTree) -> dict[str, Figure]:
    """Figure of where the error of each model lies; none where modes were measured."""
    fits = of_models(kept, "fit")
    return {"residual_map.png": misfit_plots.residual_maps(fits)} if fits else {}


def run_explain(request: Request) -> int:
    """Rank the effects that a model may lack, write tables and figures, return the exit code."""
    inputs = request.read("explain")
    ranking = request.search("explain", explain, inputs)
    verdict, *further = ranking.words()
    inputs.screen.verdict(verdict)
    show_reach(ranking.reach, inputs)
    inputs.screen.table(ranking.table(), "effect")
    inputs.screen.list(further)
    inputs.run.verdict(verdict)
    inputs.screen.list(write_result(ranking, "explanation", inputs, inputs.run))
    inputs.run.table("explanation.csv", ranking.table())
    if ranking.claimed:
        inputs.screen.text(f"How far the error falls with it: {request.command('improve')}")
    else:
        inputs.screen.text(f"Where the misfit is: {request.command('check')}")
    return inputs.run.finish(inputs.screen, verdict, ranking.to_json())


HEADING = "What a single law at one place could do:"


def in_full(result: Ledger | Ranking, further: Sequence[str]) -> str:
    """Text of a file: the result, further sentences, and what acts where by which law."""
    lines = [str(result), *(f"- {sentence}" for sentence in further), *_lines_on_laws(result)]
    return "\n".join(lines)


def _lines_on_laws(result: Ledger | Ranking) -> list[str]:
    """Lines of a text file: where each claimed effect acts and its law, and what laws could do."""
    claimed = claims_in_words(result.effects)
    reached = [] if result.reach is None else result.reach.words()
    parts = {"Where it acts, and its law:": claimed, HEADING: reached}
    return [
        line
        for heading, sentences in parts.items()
        if sentences
        for line in ["", heading, *(f"- {sentence}" for sentence in sentences)]
    ]


def write_result(
    result: Ledger | Ranking,
    name: str,
    inputs: Inputs,
    run: Run,
    first: Sequence[Drawing] = (),
    further: Callable[[xr.DataTree], Sequence[Drawing]] = lambda kept: (),
) -> list[str]:
    """Write what was found under a name, and return where to measure next in words.

    Further figures are of what is kept for a report.
    """
    run.json(f"{name}.json", result.to_json())
    run.text(f"{name}.txt", in_full(result, ()))
    pictures = partial(_write_pictures, result, inputs, first, further)
    following = run.kept(pictures, result.to_json(), inputs.data_faults)
    run.text(f"{name}.txt", in_full(result, following))
    run.table("suspicion.csv", result.suspicion, index=False)
    return following


def _write_pictures(
    result: Ledger | Ranking,
    inputs: Inputs,
    first: Sequence[Drawing],
    further: Callable[[xr.DataTree], Sequence[Drawing]],
    run: Run,
) -> list[str]:
    """Write figures and what they are drawn from; return where to measure next in words."""
    draw_where(result, inputs, run)  # begun first: what follows takes as long as drawing it
    run.figures(*first, lambda: {"probabilities.png": ledger_plots.probabilities(result)})
    write_reach(result, run)
    measured = inputs.measurement, inputs.data_faults
    kept = of_result(result, inputs.experiment, *measured, with_next=run.with_report)
    run.tree(FINDINGS, kept)
    run.figures(*further(kept))
    return where_next(kept, result)


def show_reach(reach: Reach | None, inputs: Inputs) -> None:
    """Say which kind of port explains how much, whatever the law; nothing where none was read."""
    if reach is not None:
        inputs.screen.text(HEADING)
        inputs.screen.list(reach.words())


def write_reach(result: Ledger | Ranking, run: Run) -> None:
    """Write both curves and the law as measured.

    The law is that at the port of the claimed effect, or else at the most probable one.
    """
    reach = result.reach
    if reach is None:
        return
    law = reach.law_as_measured(result.port)
    run.table("reach.csv", reach.curves, index=False)
    run.table("law.csv", law, index=False)
    if law["unit"].iloc[0] in SIDES:  # a factor on channels is no law at a port
        run.law("law.unv", law)


def picture_of_where(result: Ledger | Ranking) -> str:
    """Name of the picture of where something may act: by any law, or else by each effect."""
    return "suspicion.png" if result.reach is None else "reach.png"


def draw_where(result: Ledger | Ranking, inputs: Inputs, run: Run) -> None:
    """Draw both curves and the law as measured, for a reader and for a report.

    Where no law was read, draw how strongly the data support each effect at each place.
    """
    reach, port, drawn = result.reach, result.port, inputs.experiment
    if reach is None:
        name = picture_of_where(result)
        run.figures(lambda: {name: ledger_plots.suspicion(result, experiment=drawn)})
        return
    drawings: dict[str, Callable[[], Figure]] = {
        "reach": lambda: reach_plots.curves(reach, experiment=drawn),
        "law": lambda: reach_plots.law(reach, acts_on=port),
    }
    for name, draw in drawings.items():
        run.figures(partial(_by_name, f"{name}.png", draw))
        run.attempt("A figure", partial(_begin_svg, run, f"{name}.svg", draw))


def _begin_svg(run: Run, name: str, draw: Callable[[], Figure]) -> None:
    with look():
        figure = draw()
    run.begin(name, partial(_write_svg, figure))


def _write_svg(figure: Figure, path: Path) -> None:
    with look():
        path.write_text(f"{as_file(svg_of(figure))}\n", encoding="utf-8")


def _by_name(name: str, draw: Callable[[], Figure]) -> dict[str, Figure]:
    return {name: draw()}
