"""Evidence by Laplace's method, SMC and randomised draws against nested quadrature.

Run with `python -m pytest tests/benchmarks/test_evidence.py -n 0 -s -m long`.
"""

import functools
from typing import NamedTuple

import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.special import logsumexp

import bayes_placement as bp
from bayes_placement.criticism.missing._descents import fit_alone
from bayes_placement.inference.engines.about_mode import (
    randomised_maximum_likelihood,
    sampled_about,
)
from bayes_placement.inference.residuals import Problem
from tests.benchmarks.calibration_studies import Study, beam, frame

pytestmark = [pytest.mark.usefixtures("optimised"), pytest.mark.long]

LAPLACE = 0.5
"""Error of log evidence that Laplace's method is allowed; it states none."""


class Case(NamedTuple):
    """An experiment with data to be simulated, and what is known of its modes.

    Parameters
    ----------
    experiment
        The experiment.
    modes
        Modes of equal evidence, of which a fit sees one; none where they are unequal.
    apart
        Whether the modes are so far apart that draws about one of them do not reach another.
    nodes
        Nodes of the quadrature along each place.
    """

    experiment: bp.Experiment
    modes: int = 1
    apart: bool = True
    nodes: int = 48


LINES = (np.arange(1, 11) - 0.5) * 43.3


def bar(sensor, actuator, noise, frequency=LINES) -> bp.Experiment:
    """Bar of two fixed ends, with transducers at (place, tolerance) [m]."""
    damping = bp.damping.Modal([dist.Uniform(0.02, 0.06), 0.04])
    modes = bp.beams.bar(8, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(modes, damping=damping),
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(sensor[0], within=sensor[1]))],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(actuator[0], within=actuator[1]))],
        frequency=frequency,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=bp.noise.Gaussian(noise),
    )


def with_mass() -> bp.Experiment:
    """The bar with a mass of unknown size and place."""
    mass = bp.effects.point_mass(at=dist.Uniform(0.5, 0.9), mass=dist.Uniform(0.0, 1.0))
    experiment = bar((0.22, 0.04), (0.34, 0.04), 0.05)
    return experiment.fix({"structure.damping.ratio.1": 0.04}) + mass


def with_known_noise(experiment: bp.Experiment, sigma: float) -> bp.Experiment:
    return experiment.fix({"noise.sigma": sigma})


ANYWHERE = (0.5, 0.4)
CASES = {
    "bar": lambda: Case(bar((0.22, 0.04), (0.34, 0.04), 0.1)),
    "little is known": lambda: Case(bar((0.22, 0.04), (0.34, 0.04), 0.5)),
    "much is known": lambda: Case(bar((0.22, 0.04), (0.34, 0.04), 0.02)),
    "unknown noise": lambda: Case(
        bar((0.22, 0.04), (0.34, 0.04), dist.LogUniform(0.02, 0.5)), nodes=24
    ),
    "mirrored": lambda: Case(bar(ANYWHERE, (0.5, 0.04), 0.1), modes=2, nodes=96),
    "exchanged": lambda: Case(bar((0.3, 0.08), (0.3, 0.08), 0.03), modes=2, apart=False),
    "mirrored and exchanged": lambda: Case(
        bar(ANYWHERE, ANYWHERE, 0.1), modes=4, apart=False, nodes=96
    ),
    "unequal modes": lambda: Case(
        bar(ANYWHERE, (0.34, 0.02), 0.1, [43.0, 105.0, 150.0, 190.0]), modes=0, nodes=96
    ),
    "beam": lambda: Case(with_known_noise(beam(), 2.0), nodes=20),
    "frame": lambda: Case(frame(), nodes=12),
    "mass": lambda: Case(with_mass(), nodes=24),
}


class Problems(NamedTuple):
    case: Case
    measured: bp.Measurement
    evidence: float


@functools.cache
def problem(name: str) -> Problems:
    """A case with data, and its evidence by quadrature, the same with fewer nodes."""
    case = CASES[name]()
    measured = Study(case.experiment, 1, key=3).measurement(0)
    few, many = (quadrature(case, measured, share) for share in (0.75, 1.0))
    assert abs(few - many) < 1e-2
    return Problems(case, measured, many)


def quadrature(case: Case, measured: bp.Measurement, share: float) -> float:
    nodes = round(share * case.nodes)
    tree = bp.infer(
        case.experiment,
        measured,
        engine=bp.engines.Grid(nodes=16),
        marginal=bp.marginals.Quadrature(nodes=nodes),
    )
    return float(tree["estimates"]["log_evidence"])


@pytest.mark.parametrize("name", CASES)
def test_smc_agrees_with_quadrature(name):
    case, measured, evidence = problem(name)
    tree = bp.infer(case.experiment, measured, engine=bp.engines.SMC(), key=1)
    estimate, error = (float(tree["estimates"][f"log_evidence{end}"]) for end in ("", "_error"))
    print(f"{name}: quadrature {evidence:.3f}, SMC {estimate - evidence:+.3f} +- {error:.3f}")
    assert error < 0.3
    assert abs(estimate - evidence) < 4 * error


@pytest.mark.parametrize("name", CASES)
def test_draws_about_a_mode_agree_with_quadrature(name):
    case, measured, evidence = problem(name)
    fitted = Problem(case.experiment, case.experiment.data(measured))
    fit = fit_alone(fitted).fit
    part = evidence - np.log(max(case.modes, 1))
    estimates = {"sampled": sampled_about(fitted.squares, fit)[1:]}
    randomised = fitted.squares.known_noise and randomised_evidence(fitted.squares, fit)
    if randomised:
        estimates["randomised"] = randomised
    words = [
        f"{word} {estimate - part:+.3f} +- {error:.3f}"
        for word, (estimate, error) in estimates.items()
    ]
    print(f"{name}: {part:.3f}, Laplace {fit.log_evidence - part:+.3f}, {', '.join(words)}")
    for estimate, error in estimates.values():
        assert error < 0.1
        assert estimate < evidence + 4 * error
        if case.modes and case.apart:
            assert abs(estimate - part) < 4 * error
        elif case.modes:  # something of the other modes is reached, nobody can say how much
            assert estimate > part - 4 * error
    if case.modes:
        assert abs(fit.log_evidence - part) < LAPLACE


def randomised_evidence(problem, fit) -> tuple[float, float] | None:
    """Log evidence and its standard error by randomised data; None where draws are lost."""
    weighted = randomised_maximum_likelihood(problem, fit, 0)
    if weighted is None:
        return None
    count, total = len(weighted.log_weight), logsumexp(weighted.log_weight)
    share = np.exp(weighted.log_weight - total) * count
    return float(total - np.log(count)), float(np.std(share) / np.sqrt(count))
