"""What unknown noise means for a fit: how much it needs, and that data may be outliers."""

import jax.numpy as jnp
import numpy as np

from ..._shared.compiled import compiled
from ..._shared.dimensions import Response
from ..._shared.sites import Role
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..noise_needed import NoiseNeeded, Rows, neumann, over_scatter, relative_size
from ._hypotheses import Hypothesis

OF_COHERENCE = ("factor", "coherence")
"""Fields of a noise that are factors on what the coherence says."""


def scatter(hypothesis: Hypothesis) -> tuple[float, float]:
    """Residuals at the best fit over the scatter of neighbouring lines, and the p-value.

    With an earlier state, those of the later one, which come first.
    """
    return over_scatter(*_rows(hypothesis))


def neumann_of(hypothesis: Hypothesis) -> tuple[float, float]:
    """Von Neumann's ratio of the residuals at the best fit, and the inverse of its deviation."""
    ratio, certainty = neumann(*_rows(hypothesis))
    return float(ratio), float(certainty)


def _rows(hypothesis: Hypothesis) -> tuple[Rows, np.ndarray]:
    """Residuals of the experiment along sorted lines, and which of them were measured."""
    problem = hypothesis.problem
    lines = np.argsort(np.asarray(problem.experiment.frequency))
    present = np.asarray(problem.data.measured)
    rows = hypothesis.residual[: present.size].reshape(-1, lines.size)[:, lines]
    return rows, present.reshape(-1, lines.size)[:, lines]


def gain_with_outliers(hypothesis: Hypothesis) -> float:
    """Gain of log likelihood where a few data may be outliers; none where the noise is known.

    The form of an unknown noise is assumed, so that what explains one line of one channel explains
    no more than that the noise may be larger there.
    """
    return 0.0 if hypothesis.is_noise_known else hypothesis.with_outliers.gain


def noise_needed(hypothesis: Hypothesis) -> NoiseNeeded | None:
    """Noise that a hypothesis needs; None where it is known."""
    if hypothesis.is_noise_known:
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
