"""How much noise a fitted hypothesis needs, where the noise is not known."""

import jax.numpy as jnp
import numpy as np

from ..._compiled import compiled
from ..._sites import Role
from ..._types import Response
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..noise_needed import NoiseNeeded, over_scatter, relative_size
from ._hypotheses import Hypothesis

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
    residual, _ = problem.squares.residuals(hypothesis.fit.point[None])
    lines = np.argsort(np.asarray(problem.experiment.frequency))
    present = np.asarray(problem.data.measured)
    rows = residual[0, : present.size].reshape(-1, lines.size)[:, lines]
    return over_scatter(rows, present.reshape(-1, lines.size)[:, lines])


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
