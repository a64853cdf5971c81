"""How well a fitted hypothesis predicts lines that it was not fitted to.

Left out is one block of lines at a time, of all channels; each time the fit goes on from where it
was. No channel is left out: its place would go back to its prior, which no effect predicts.
"""

import functools
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from ...experiment.noise import Covariance
from ...inference.engines.least_squares import SquaresAndPrior
from ...inference.engines.levenberg_marquardt import minimise
from ...inference.residuals import Problem
from ..kept_fits import fitted_in_processes, stored_or_computed
from ._hypotheses import Hypothesis

BLOCKS = 10
"""Blocks of neighbouring lines, of as many each."""

PARTS = 4
"""Groups of blocks that are given to processes."""

STEPS = 12


def held_out(hypothesis: Hypothesis) -> float:
    """Mean log density of lines that are held out, in nats a real datum, in units of the noise.

    It is comparable between models of the same data and the same noise. NaN of a single line, where
    nothing can be held out.
    """
    blocks = scores(hypothesis)
    return float(np.mean(blocks)) if blocks.size else float("nan")


@functools.lru_cache(maxsize=32)  # asked for by the search and by the ledger
def scores(hypothesis: Hypothesis) -> Float[np.ndarray, "block"]:
    """Mean log density of a datum of each block, of which something is left to fit to."""
    problem, compute = hypothesis.problem, functools.partial(_scores, hypothesis)
    return stored_or_computed(compute, np.zeros(0), problem, hypothesis.fit.point, "held out")


def _scores(hypothesis: Hypothesis) -> Float[np.ndarray, "block"]:
    problem = hypothesis.problem
    measured = np.asarray(problem.data.measured).ravel()
    blocks = [problem.of_experiment(block & measured) for block in _blocks(problem)]
    fitted = [
        block
        for block in blocks
        if block.any() and (problem.of_experiment(measured) & ~block).any()
    ]
    # A fit with a model error takes seconds; without, it is done before a process has begun.
    parts = min(PARTS, len(fitted)) if hypothesis.has_errors else 1
    tasks = [(hypothesis, fitted[part::parts]) for part in range(parts)]
    fits = fitted_in_processes(_evidence_ratios, tasks)
    ratios = np.zeros(len(fitted))
    for part, of_part in enumerate(fits):
        ratios[part::parts] = of_part
    return ratios


def _evidence_ratios(hypothesis: Hypothesis, blocks: list[np.ndarray]) -> list[float]:
    return [_evidence_ratio(hypothesis, block) for block in blocks]


def _blocks(problem: Problem) -> Iterator[np.ndarray]:
    """Which data are held out, one block of lines after the other."""
    shape = np.shape(problem.data.z)
    for lines in np.array_split(np.arange(shape[-1]), min(BLOCKS, shape[-1])):
        block = np.zeros(shape, dtype=bool)
        block[..., lines] = True
        yield block.ravel()


def _evidence_ratio(hypothesis: Hypothesis, block: np.ndarray) -> float:
    """Evidence of all data over that of the other data, each by Laplace's method about its own fit.

    Unknowns that only the block tells go back to their prior, much farther than slopes hold.
    """
    problem, fit = hypothesis.problem, hypothesis.fit
    training, level = _training(hypothesis, block)
    _, normal = minimise(training, fit.point[None], steps=STEPS)
    all_data = -fit.cost + fit.gaussian.log_volume - 0.5 * problem.dimension * np.log(2 * np.pi)
    count = int(block.sum())
    return float((all_data - normal.log_evidence[0]) / count - 0.5 * np.log(2 * np.pi) - level)


def _training(hypothesis: Hypothesis, block: np.ndarray) -> tuple[SquaresAndPrior, float]:
    """What a fit to the other data minimises, and the log deviation a datum that it leaves out.

    Unknown noise is fitted to the remaining data alone. Known noise, and noise that allows no gaps,
    stays as it is.
    """
    problem = hypothesis.problem
    data, noise = problem.data, problem.experiment.noise
    assert noise is not None
    remaining = np.asarray(data.measured) & ~block[: data.z.size].reshape(data.z.shape)
    if hypothesis.is_noise_known or isinstance(noise, Covariance):
        _, log_scale = problem.squares.residuals(hypothesis.fit.point[None])
        weight = (~block).astype(float)
        return problem.squares.objective(weight=weight), log_scale[0] / problem.count
    return problem.with_measured(remaining).squares.objective(), 0.0
