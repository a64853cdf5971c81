"""What factors on channels can do: of each to first order, in full of those that may be it."""

from collections import Counter
from collections.abc import Sequence

from ...inference.engines.levenberg_marquardt import Fit, best_fit
from ...inference.residuals import Problem, at_known_noise
from ._at_port import ReachOfPort, reach_at_fit, reach_of_channel
from ._channels import channels_of, free_factor
from ._free_factor import Responses
from ._free_law import tells_phase
from ._left_out import LeftOut
from ._named_laws import STRONG, NamedLaw, laws_with_names

WITHIN = 2 * STRONG
"""Log odds behind the best law from which on a channel is told to first order alone."""


def reached_channels(
    problem: Problem, fit: Fit, laws: Sequence[NamedLaw]
) -> tuple[list[ReachOfPort], list[NamedLaw]]:
    """What factors on each channel, and on all, can do, and the best filters; none of amplitudes.

    In full those whose greatest evidence comes near that of the best law; of each kind one at
    least.

    The laws are at ports.
    """
    if not tells_phase(problem):
        return [], []
    problem, fit = _at_known_noise(problem, fit)
    responses, without = Responses(problem), LeftOut(problem, fit)
    ports = channels_of(problem.experiment)
    pieces = Counter(port.acts_on for port in ports)
    frees = [free_factor(port, responses) for port in ports]
    most = [without.most_evidence(free.data) for free in frees]
    reached: dict[int, ReachOfPort] = {}
    named: list[NamedLaw] = []
    for number in sorted(range(len(ports)), key=lambda number: -most[number]):
        port, free = ports[number], frees[number]
        best = max((law.log_odds for law in (*laws, *named)), default=-float("inf"))
        is_first = all(law.port.acts_on != port.acts_on for law in named)
        if is_first or most[number] > best - WITHIN:
            reached[number] = reach_of_channel(fit.point, port, free)
            named += laws_with_names(reached[number], pieces[port.acts_on])
        else:
            reached[number] = reach_at_fit(fit.point, port, free, without.squares(free.data))
    return [reached[number] for number in range(len(ports))], named


def _at_known_noise(problem: Problem, fit: Fit) -> tuple[Problem, Fit]:
    """Return a problem with the noise of a fit, and the fit in it."""
    known, point = at_known_noise(problem, fit.point)
    if known is problem:
        return problem, fit
    normal = known.squares.objective().normal_equations(point[None])
    return known, best_fit(point[None], normal, known.count)
