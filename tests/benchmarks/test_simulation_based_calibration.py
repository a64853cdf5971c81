"""Simulation-based calibration of all engines: ranks of true values among draws are uniform.

Run with `python -m pytest tests/benchmarks/test_simulation_based_calibration.py -n 0 -s -m long`,
or a part of it with `-k "bar and smc"`. CALIBRATION_REPLICATES is how many replicates, 500 by
default. All methods see the same data, so that a deviation that all of them share is one of the
data. `recorded_rows` tells how parts are put together; the figures are written to its folder.
"""

import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.stats import norm

from tests.benchmarks import uniform_ranks
from tests.benchmarks.calibration_studies import (
    METHODS,
    REPLICATES,
    ROWS,
    STUDIES,
    Replicate,
    replicates,
)
from tests.benchmarks.recorded_rows import folder

LEVEL = 0.01
COUNT = int(os.environ.get("CALIBRATION_REPLICATES", REPLICATES))
pytestmark = [pytest.mark.usefixtures("optimised"), pytest.mark.long]


def by_unknown(rows: list[Replicate]) -> dict[str, np.ndarray]:
    """Ranks of each unknown in all replicates."""
    return {name: np.array([row.ranks[name] for row in rows]) for name in rows[0].ranks}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("study", STUDIES)
def test_ranks_are_uniform(study, method):
    rows = replicates(study, method, COUNT)
    ranks = by_unknown(rows)
    assert all(np.isfinite(values).all() for values in ranks.values())
    p_values = {name: uniform_ranks.p_value(values) for name, values in ranks.items()}
    adjusted = uniform_ranks.holm(p_values)
    seconds = np.median([row.seconds for row in rows])
    warned = sum(row.warned for row in rows)
    print(f"{study}, {method}: {len(rows)} replicates, {seconds:.2f} CPU s each, {warned} warned")
    for name, p in p_values.items():
        print(f"  {name}: p = {p:.4f}, by Holm {adjusted[name]:.4f}")
    assert min(adjusted.values()) > LEVEL


def test_ranks_that_are_not_uniform_are_told():
    random = np.random.default_rng(5)
    even = {"a": random.uniform(size=500), "b": random.uniform(size=500)}
    assert min(map(uniform_ranks.p_value, even.values())) > LEVEL
    # Intervals a fifth too narrow, and a bias of a fifth of a deviation.
    normal = random.standard_normal(500)
    for false in (1.25 * normal, normal + 0.25):
        assert uniform_ranks.p_value(norm.cdf(false)) < LEVEL / 10


def test_figures(tmp_path):
    rows = ROWS.recorded() or replicates("bar", "finalist", 20)
    for study in dict.fromkeys(row.study for row in rows):
        print(draw(folder() or tmp_path, study, [row for row in rows if row.study == study]))


def draw(folder: Path, study: str, rows: list[Replicate]) -> Path:
    """Share of ranks below a value less that value, with bands of 99 % for all values at once."""
    methods = list(dict.fromkeys(row.method for row in rows))
    names = list(rows[0].ranks)
    figure, axes = plt.subplots(
        len(methods),
        len(names),
        figsize=(2.2 * len(names), 1.7 * len(methods)),
        squeeze=False,
        sharex=True,
        sharey=True,
        layout="constrained",
    )
    for method, line in zip(methods, axes, strict=True):
        ranks = by_unknown([row for row in rows if row.method == method])
        for name, ax in zip(names, line, strict=True):
            _draw(ax, ranks[name])
            ax.set_title(name.removeprefix("structure."), fontsize=7)
        line[0].set_ylabel(f"{method} ({len(ranks[names[0]])})")
    figure.supxlabel("rank")
    figure.supylabel("share of true values below, less the rank")
    file = folder / f"{study}.png"
    figure.savefig(file, dpi=130)
    plt.close(figure)
    return file


def _draw(ax, ranks: np.ndarray) -> None:
    points = uniform_ranks.POINTS
    low, high = uniform_ranks.bands(len(ranks)) - points
    ax.fill_between(points, low, high, color="0.85", linewidth=0)
    ax.plot(points, uniform_ranks.below(ranks) / len(ranks) - points)
    ax.axhline(0.0, color="0.5", linewidth=0.5)
