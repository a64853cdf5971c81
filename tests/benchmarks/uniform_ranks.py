"""Whether ranks are uniform: simultaneous bands of their distribution function, Holm's correction.

Säilynoja, Bürkner and Vehtari (2022), doi:10.1007/s11222-022-10090-6: at each of several points the
number of ranks below is binomial. The least of the probabilities of a number as extreme, over all
points, is compared with those of uniform ranks.
"""

import functools

import numpy as np
from scipy.stats import binom

POINTS = np.linspace(0.0, 1.0, 51)[1:-1]
SIMULATIONS = 20_000


def p_value(ranks: np.ndarray) -> float:
    """Probability that uniform ranks lie as far from the diagonal."""
    least = tails(len(ranks))[np.arange(len(POINTS)), below(ranks[None])].min()
    null = least_tails(len(ranks))
    return float((1 + np.sum(null <= least * (1 + 1e-9))) / (1 + len(null)))


def bands(count: int, probability: float = 0.99) -> np.ndarray:
    """Least and greatest share of uniform ranks below each point, at all points together [2, n]."""
    least = np.quantile(least_tails(count), 1 - probability)
    inside = tails(count) > least
    first = inside.argmax(axis=1)
    last = count - inside[:, ::-1].argmax(axis=1)
    return np.stack([first, last]) / count


def below(ranks: np.ndarray) -> np.ndarray:
    """Number of ranks [..., rank] up to each point [..., point]."""
    return np.sum(ranks[..., None, :] <= POINTS[:, None], axis=-1)


@functools.cache
def tails(count: int) -> np.ndarray:
    """Twice the probability of a number as extreme [point, number]."""
    numbers, points = np.arange(count + 1), POINTS[:, None]
    low, high = binom.cdf(numbers, count, points), binom.sf(numbers - 1, count, points)
    return 2 * np.minimum(low, high)


@functools.cache
def least_tails(count: int) -> np.ndarray:
    """Least tail over all points, of simulated uniform ranks [simulation]."""
    random, table = np.random.default_rng(0), tails(count)
    edges = np.concatenate([[0.0], POINTS, [1.0]])
    shares = np.diff(edges)
    numbers = np.cumsum(random.multinomial(count, shares, SIMULATIONS), axis=1)[:, :-1]
    return table[np.arange(len(POINTS)), numbers].min(axis=1)


def holm(p_values: dict[str, float]) -> dict[str, float]:
    """Holm's adjusted p values (1979), by name."""
    ordered = sorted(p_values, key=lambda name: p_values[name])
    adjusted, greatest = {}, 0.0
    for number, name in enumerate(ordered):
        greatest = max(greatest, min(1.0, (len(ordered) - number) * p_values[name]))
        adjusted[name] = greatest
    return adjusted
