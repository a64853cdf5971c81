"""How much noise a fitted hypothesis needs, and how it may be distributed, where it is unknown."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar
from scipy.stats import binom

from ..._compiled import compiled
from ..._sites import Role
from ..._types import Response
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..noise_needed import NoiseNeeded, over_scatter, relative_size
from ._hypotheses import Hypothesis

OUTLIERS, SIZE_OF_OUTLIERS = 0.01, 10.0
"""Share of data that are outliers, and factor on their deviation, where the noise is not known."""

OF_COHERENCE = ("factor", "coherence")
"""Fields of a noise that are factors on what the coherence says."""


def is_noise_known(hypothesis: Hypothesis) -> bool:
    """Whether the level of the noise is stated, or read from the data."""
    noise = hypothesis.problem.experiment.noise
    return noise is not None and noise.deviation(hypothesis.problem.data) is not None


def scatter(hypothesis: Hypothesis) -> tuple[float, float]:
    """Residuals at the best fit over the scatter of neighbouring lines, and the p-value.

    With an earlier state, those of the later one, which come first.
    """
    problem = hypothesis.problem
    lines = np.argsort(np.asarray(problem.experiment.frequency))
    present = np.asarray(problem.data.measured)
    rows = hypothesis.residual[: present.size].reshape(-1, lines.size)[:, lines]
    return over_scatter(rows, present.reshape(-1, lines.size)[:, lines])


class Mixture(NamedTuple):
    """Errors that are normal, or with a small probability far larger.

    Parameters
    ----------
    gain
        Log likelihood over that of normal errors of the fitted deviations.
    outliers
        Expected number of outliers.
    """

    gain: float
    outliers: float


def gain_with_outliers(hypothesis: Hypothesis) -> float:
    """Gain of log likelihood where a few data may be outliers; none where the noise is known.

    The form of an unknown noise is assumed, so that what explains one line of one channel explains
    no more than that the noise may be larger there.
    """
    return 0.0 if is_noise_known(hypothesis) else _mixture_of(hypothesis).gain


def p_value_of_outliers(hypothesis: Hypothesis) -> float:
    """Probability of at least as many outliers, of the share that a mixture assumes.

    More of them are a misfit at many lines, which an effect may explain.
    """
    count = hypothesis.problem.count
    return float(binom.sf(np.ceil(_mixture_of(hypothesis).outliers) - 1, count, OUTLIERS))


def _mixture_of(hypothesis: Hypothesis) -> Mixture:
    return mixture(hypothesis.residual, hypothesis.problem.count)


def mixture(residual: Float[np.ndarray, "datum"], count: int) -> Mixture:
    """Fit a mixture to residuals (Box and Tiao 1968, doi:10.1093/biomet/55.1.119).

    The level of all is the most probable one, since outliers have raised the one that was fitted.

    Parameters
    ----------
    residual
        Residuals over their fitted standard deviations; zero where nothing was measured.
    count
        Number of data that were measured.
    """
    squares = residual**2

    def parts(log_level: float) -> tuple[np.ndarray, np.ndarray]:
        errors = -0.5 * squares * np.exp(-2 * log_level)
        outliers = errors / SIZE_OF_OUTLIERS**2 - np.log(SIZE_OF_OUTLIERS)
        return np.log1p(-OUTLIERS) + errors, np.log(OUTLIERS) + outliers

    def loss(log_level: float) -> float:
        return count * log_level - float(np.sum(np.logaddexp(*parts(log_level))))

    best = minimize_scalar(loss, bounds=(-np.log(SIZE_OF_OUTLIERS), 0.0))
    normal, outlying = parts(best.x)
    shares = np.exp(outlying - np.logaddexp(normal, outlying))
    return Mixture(float(0.5 * np.sum(squares) - best.fun), float(np.sum(shares[residual != 0])))


def noise_needed(hypothesis: Hypothesis) -> NoiseNeeded | None:
    """Noise that a hypothesis needs; None where it is known."""
    if is_noise_known(hypothesis):
        return None
    problem = hypothesis.problem
    values = problem.coordinates.named(hypothesis.fit.point[None])
    at_fit = {name: value[0] for name, value in values.items()}
    data, experiment = problem.data, problem.at_fixed_sizes
    deviation = np.asarray(compiled(_deviation)(experiment.fix(at_fit), data))
    factors = [
        float(at_fit[unknown.name])
        for unknown in experiment.unknowns
        if unknown.role is Role.OUTPUT_ERROR and unknown.field in OF_COHERENCE
    ]
    part = -2 if experiment.observe.parts > 1 else None
    present = np.asarray(data.measured)
    return NoiseNeeded(
        relative_size(np.where(present, deviation, 0.0), np.asarray(data.z), part),
        *scatter(hypothesis),
        over_coherence=factors[0] if factors else float("nan"),
    )


def _deviation(concrete: Experiment, data: Data) -> Response:
    """Deviation of the noise of each output."""
    assert concrete.noise is not None
    return jnp.sqrt(concrete.noise.distribution(jnp.asarray(data.z), data).variance)
