"""What unknown noise means for a fit: how much it needs, and that data may be outliers."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._shared.compiled import compiled
from ..._shared.dimensions import Response
from ..._shared.sites import Role
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ...inference.residuals import Problem
from ..noise_needed import (
    NoiseNeeded,
    Rows,
    is_misfit_alike,
    over_noise,
    over_scatter,
    relative_size,
    share_of_noise,
)
from ._hypotheses import Hypothesis

OF_COHERENCE = ("factor", "coherence")
"""Fields of a noise that are factors on what the coherence says."""


def neumann_of(hypothesis: Hypothesis) -> tuple[float, float]:
    """Share of noise in the residuals at the best fit, and the inverse of its deviation."""
    ratio, certainty = share_of_noise(*_rows(hypothesis))
    return float(ratio), float(certainty)


def _rows(hypothesis: Hypothesis) -> tuple[Rows, np.ndarray, Rows | None]:
    """Residuals along sorted lines, which were measured, and the scatter of lines of the record.

    With an earlier state, those of the later one, which come first.
    """
    problem = hypothesis.problem
    present, scatter = np.asarray(problem.data.measured), problem.data.scatter
    over = None if scatter is None else np.asarray(scatter) / _deviation_at_fit(hypothesis)
    residual = _along_lines(problem, hypothesis.residual[: present.size])
    known = None if over is None else _along_lines(problem, over)
    return residual, _along_lines(problem, present), known


def _along_lines(problem: Problem, values: np.ndarray) -> np.ndarray:
    """Values of the outputs of the experiment as rows along sorted lines."""
    lines = np.argsort(np.asarray(problem.experiment.frequency))
    return values.reshape(-1, lines.size)[:, lines]


def _at_fit(hypothesis: Hypothesis) -> dict[str, Any]:
    """Unknowns at the best fit."""
    values = hypothesis.problem.coordinates.named(hypothesis.fit.point[None])
    return {name: value[0] for name, value in values.items()}


def _deviation_at_fit(hypothesis: Hypothesis) -> np.ndarray:
    """Deviation of the noise of each output at the best fit."""
    experiment = hypothesis.problem.at_fixed_sizes.fix(_at_fit(hypothesis))
    data = hypothesis.problem.data
    deviation = np.asarray(compiled(_deviation)(experiment, data))
    return np.broadcast_to(deviation, np.shape(data.z))


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
    data, experiment, at_fit = problem.data, problem.at_fixed_sizes, _at_fit(hypothesis)
    residual, present, scatter = _rows(hypothesis)
    beyond = over_noise(residual, present)
    deviation = beyond * _deviation_at_fit(hypothesis)
    factors = [
        beyond * float(at_fit[unknown.name])
        for unknown in experiment.unknowns
        if unknown.role is Role.OUTPUT_ERROR and unknown.field in OF_COHERENCE
    ]
    part = -2 if experiment.observe.parts > 1 else None
    return NoiseNeeded(
        relative_size(np.where(data.measured, deviation, 0.0), np.asarray(data.z), part),
        *over_scatter(residual, present, scatter),
        over_coherence=factors[0] if factors else float("nan"),
        is_misfit_alike=is_misfit_alike(
            _along_lines(problem, np.asarray(data.z) / deviation),
            present,
            None if scatter is None else scatter / beyond,
        ),
    )


def _deviation(concrete: Experiment, data: Data) -> Response:
    """Deviation of the noise of each output."""
    assert concrete.noise is not None
    return jnp.sqrt(concrete.noise.distribution(jnp.asarray(data.z), data).variance)
