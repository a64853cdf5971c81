"""`bayes-placement explore`: the live page of a model and its measurement."""

import itertools
import webbrowser
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from .._shared.files import Json
from .._shared.progress import Progress
from ..experiment.experiment import Measurements
from ..explorer.opened import Given, opened
from ..explorer.page_frames import LongSave
from ..inference.engines import MAP
from ..io.model import Study
from ._inputs import Inputs, infer_posterior, named_method, read_inputs
from ._missing_effects import Request
from ._run import Run
from ._save import CompletedModel
from ._terminal import Screen

if TYPE_CHECKING:
    from ..criticism.missing.ledger import Ledger
    from ..explorer.actions import ValuedModel
    from ..explorer.live import LivePage


Save = Callable[["LivePage"], Path]
Written = tuple[Path, Json]


def run(request: Request, port: int, browser: bool) -> int:
    """Open the page, and serve it until Ctrl-C."""
    # Nothing that takes time before the page stands.
    asked = request.path, request.data, "explore", request.output, request.most_lines
    inputs = read_inputs(*asked, request.model_error, is_quick=True)
    screen, run, head = inputs.screen, inputs.run, _head(request, is_thinned=inputs.is_thinned)
    kept, saves = (run.shared, run.fits), _saves(request)
    given = Given(request.path.stem, head, *kept, port, saves, PageReport(inputs))
    baseline = request.earlier(inputs.study)
    explorer = opened(inputs.experiment, inputs.measurement, baseline, given)
    screen.verdict(f"The page is at {explorer.address}")
    screen.text("It is for this machine and you alone. Ctrl-C ends it; its state is kept.")
    screen.list(filter(None, [explorer.words]))
    if browser:
        webbrowser.open(explorer.address)
    try:
        explorer.wait()
    except KeyboardInterrupt:
        screen.text("")
    finally:
        explorer.close()
    run.text("script.py", explorer.session.script().rstrip())
    chi2 = explorer.session.chi2.get(explorer.session.current, float("nan"))
    words = f"Explored: reduced chi-square {chi2:.3g} at the last step."
    run.verdict(words)
    return run.finish(screen, words, {"script": explorer.session.script()})


def _head(request: Request, *, is_thinned: bool) -> str:
    """Lines of Python that make experiment and measurement as the page has them."""
    reader = "case" if request.path.is_dir() else "model"
    measured = (
        "study.measurement"
        if request.data is None
        else f"bp.io.read_measurement({str(request.data)!r})"
    )
    lines = [
        f"study = bp.io.{reader}.read({str(request.path)!r})",
        "experiment = study.experiment",
        f"measurement = {measured}",
    ]
    if request.model_error:
        lines.append("experiment = experiment.with_model_error(bp.model_error.Embedded())")
    if is_thinned:
        lines.insert(0, "from bayes_placement.cli._inputs import choose_lines")
        chosen = f"choose_lines(experiment, measurement, {request.most_lines})"
        lines.append(f"experiment = {chosen}.experiment")
    return "\n".join(lines)


def _saves(request: Request) -> Mapping[str, Save]:
    """Files that the page can be saved as; a case where its data and model are those of a case."""
    is_case = request.path.is_dir() and request.data is None and not request.model_error
    case = {"case": partial(explored_model, request, "")} if is_case else {}
    model = partial(explored_model, request, ".py")
    return {"model": model, **case}


@dataclass(frozen=True)
class PageReport(LongSave):
    """The report of the last search, or of a check of the model at hand."""

    inputs: Inputs

    def writer(self, page: "LivePage") -> Callable[[Progress], Written]:
        """Return what the worker calls; a screen stays in its process."""
        _, run, study, measurement, faults, _ = self.inputs
        if page.ledger is not None:
            return partial(_searched, run, study, measurement, faults, page.ledger)
        return partial(_checked, run, study, measurement, page.session.model)

    def take_over(self, written: Written) -> Path:
        """Note the files that were written in the run."""
        path, record = written
        self.inputs.run.record.update(record)
        return path


def _searched(
    run: Run,
    study: Study,
    measurement: Measurements,
    faults: list[str],
    ledger: "Ledger",
    progress: Progress,
) -> Written:
    """Write what a search found."""
    from . import improve as improve_command

    screen = Screen.of(quiet=True, as_json=False)
    improve_command.write(ledger, Inputs(screen, run, study, measurement, faults), run)
    run.verdict(ledger.words()[0])
    return _written(run)


def _checked(
    run: Run, study: Study, measurement: Measurements, model: "ValuedModel", progress: Progress
) -> Written:
    """Write a check of a model with values of its unknowns."""
    # What draws figures takes a second to import, and the page is to stand at once.
    from ..criticism.check.check import check
    from . import check as check_command
    from ._findings import FINDINGS, of_check

    method = named_method(study, "map", "latent")
    method = method._replace(engine=MAP(begin=model.values))
    posterior = infer_posterior(model.experiment, measurement, method, 0, progress)
    misfit = check(posterior)
    check_command.write(misfit, misfit.words(), run)
    run.tree(FINDINGS, of_check(posterior, misfit, model.experiment, measurement))
    run.verdict(misfit.verdict())
    return _written(run)


def _written(run: Run) -> Written:
    from ..plots.report import write_report

    return write_report(run.top), run.record


def explored_model(request: Request, suffix: str, page: "LivePage") -> Path:
    """Write the model at hand beside the model, under a new name, and return its path.

    The suffix is `.py`, or none for a case folder, which only a case folder can become.
    """
    session = page.session
    given = session.states[0].model.experiment
    added = session.new_effects(session.model)
    values = {name: float(value) for name, value in session.model.values.items()}
    names = (f"{request.path.stem}_explored_{n}{suffix}" for n in itertools.count(1))
    path = next(new for new in map(request.path.with_name, names) if not new.exists())
    model = CompletedModel(path, request.path, request.data, request.model_error)
    model.write_effects(given, added, {}, values)
    return path
