"""Where something that is missing may act, whatever it is: the place before the law."""

from collections.abc import Sequence
from concurrent.futures import Executor

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.garbage import long_computation
from ..._shared.parts import done_by
from ..._shared.progress import Progress, no_progress
from ...experiment.data_checks.without_model import check_signal
from ...experiment.experiment import Experiment, Measurements
from ...experiment.model_error import Embedded
from ...experiment.noise import Data
from ...inference.chi2 import LEVEL
from ...inference.residuals import Problem
from ...inference.residuals_of_state import State
from ..reach._free_law import tells_phase
from ..reach._named_laws import NamedLaw, reached_ports
from ..reach._of_modes import ports_of_effects, reached_modes
from ..reach._ports import can_be_reached, ports_of, ports_of_many
from ..reach._scanned import step_of_fits
from ..reach.reach import Reach, Reached, fails, reach_of
from ..screening_lines import thinned
from ._before_and_after import fitted_baseline, nothing_new, over_both, state_of
from ._candidates import check_experiment
from ._hypotheses import Hypothesis, null_hypothesis
from ._model_error_choice import ticks
from ._posterior_odds import passes

SHARE = 0.75
"""Share of the work that the laws at all ports are; the best of them and the channels follow."""


@arguments_checked
@long_computation()
def reach(
    experiment: Experiment,
    measurement: Measurements,
    *,
    baseline: Measurements | None = None,
    model_error: Embedded | None = Embedded(),  # noqa: B008  it never changes
    executor: Executor | None = None,
    progress: Progress = no_progress,
) -> Reach:
    """Say where something missing may act, whatever it is: no list of effects is used.

    The response of a structure with any law on one port is linear in one complex number at each
    line. So a law that is free at each line is fitted at every place, all unknowns of the model
    with it: that is what any law there could remove. Passive networks of three elements are fitted
    to what it asks for: these decide, since a free law explains much from anywhere.

    Parameters
    ----------
    experiment
        The model as given, with its priors.
    measurement
        Measured FRFs. Of amplitudes alone only laws of few numbers are tried: one that is free at
        each line has two unknowns there, and each channel gives one equation. Of modal parameters a
        mass, a spring, a dashpot or a local loss of stiffness. Of more than 131,072 numbers laws
        are fitted at lines that are evenly spread. Where descents all over a mesh would take long,
        all its nodes are scanned at all lines, and laws fitted at the hundred best of each kind.
        Laws on segments of a line and in the modulus, which take long, are tried on complex FRFs
        where no law at one place, or between two, explains these.
    baseline
        What was measured before, in an earlier state of the same structure: all unknowns are
        shared, and laws act in the later state alone, so that they are what is new since. Its lines
        may be other ones, and channels may be missing.
    model_error
        Model error that both states share, where the experiment has none and does not reach the
        noise of the baseline; None where the model must be taken for exact. Without a baseline
        there is none: it would take up what laws do.
    executor
        Any `concurrent.futures.Executor` that does the parts, such as `design.workers()` gives, or
        one of a cluster; by default this process and its helpers do. The result is the same.
    progress
        Called with the share of the work done.

    Returns
    -------
    Reach
        The share of the misfit that can be explained at each place of each kind of port.

    Raises
    ------
    InputError
        If no law can be read: at several force levels, of modal parameters of two states, or where
        an effect of the model needs other lines than the measured ones.
    WorkerError
        If the executor loses a worker again and again, or takes no more.

    Examples
    --------
    >>> print(bp.reach(experiment, surprise).words()[0][:17])
    displacement at 4
    """
    check_experiment(experiment, "reach")
    check_signal(experiment, measurement)
    is_modal = experiment.observe.is_modal
    if is_modal and baseline is not None:
        raise InputError(
            "baseline= was given with modal parameters; FRFs of both states are needed, since no "
            "law is read from modes. What is new in them is told by bp.explain(experiment, modes, "
            "baseline=before)."
        )
    data, whole = experiment.data(measurement), None
    if baseline is None:
        exact, step = State(experiment.with_errors(None), data), step_of_fits(data)
        fewer = thinned(exact, step) if step > 1 else exact
        whole = None if fewer is exact else Problem(exact.experiment, data)
        known = null = null_hypothesis(fewer.experiment, fewer.data)
    else:
        known = _as_before(experiment, data, baseline, model_error)
        null = nothing_new(known)
    if not is_modal and not can_be_reached(known.problem):
        raise InputError(
            f"{experiment.observe!r} was given; FRFs at one force level are needed, and no effect "
            "that changes the record or the size of the structure, since a law is read from the "
            "response at each line: observe=bp.observe.Complex()."
        )
    with done_by(executor):
        reached, laws = _reached(known, whole, progress)
    # Bands of a sample of the lines would be others.
    found = reach_of(known.problem, null.fit, reached, laws, with_bands=whole is None)
    progress(1.0)
    return found


def _reached(
    known: Hypothesis, whole: Problem | None, progress: Progress
) -> tuple[Sequence[Reached], list[NamedLaw]]:
    """What laws can do at all kinds of ports, and the best of them; of modal parameters effects."""
    problem, point = known.problem, known.fit.point
    experiment = problem.experiment
    if experiment.observe.is_modal:
        effects = ports_of_effects(experiment)
        return reached_modes(problem, point, effects, ticks(progress, 0.0, (len(effects), SHARE)))
    ports = ports_of(experiment)
    many = ports_of_many(experiment) if tells_phase(problem) else []
    tick = ticks(progress, 0.0, (len(ports) + len(many), SHARE))
    reached, laws = reached_ports(problem, point, ports, tick, whole)
    if many and fails(problem, min(law.fit.squares for law in laws)) is not False:
        further, named = reached_ports(problem, point, many, tick)
        reached, laws = [*reached, *further], [*laws, *named]
    return reached, laws


def _as_before(
    experiment: Experiment, data: Data, baseline: Measurements, rival: Embedded | None
) -> Hypothesis:
    """The model of two states as the earlier one tells it; with a model error if it needs one."""
    earlier = state_of(experiment, baseline)
    before = fitted_baseline(earlier, experiment.model_error)
    if experiment.model_error is None and rival is not None and not passes(before, LEVEL):
        return _as_before(experiment.with_model_error(rival), data, baseline, None)
    return over_both(State(experiment, data), earlier, before)
