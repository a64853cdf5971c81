"""The pooled variance against draws from the distribution that repeats give."""

import numpy as np
import pytest

from bayes_placement.experiment import _noise_level

LINES = np.arange(1.0, 401.0)
FRF = 1 / np.abs(1 - (LINES / 120) ** 2 + 0.04j * LINES / 120) + 0.001  # 5 lines in its bandwidth
FORCE = np.exp(-((LINES / 250) ** 2))
PARTS = {"response": (1.0, 0.0), "force": (0.0, 0.1), "both": (1.0, 0.02)}


def drawn(random, repeats, parts):
    """Variances as they are, and as they are estimated from repeats at each line by itself."""
    flat, slope = parts
    truth = (flat + slope * FRF**2) / FORCE
    degrees = repeats - 1
    return truth, truth * random.gamma(degrees, 1 / degrees, LINES.size)


def pool(scatter, repeats, count=None):
    repeats = float(repeats)
    count = count or _noise_level.neighbours(repeats, 1.0)
    return _noise_level.pooled(scatter, FORCE, FRF, repeats, count)


@pytest.mark.parametrize("parts", PARTS.values(), ids=PARTS)
@pytest.mark.parametrize("repeats", [3, 5, 10, 30])
def test_a_right_model_has_a_chi2_of_1(repeats, parts):
    random = np.random.default_rng(repeats)
    runs = [drawn(random, repeats, parts) for _ in range(40)]
    chi2 = np.array([np.mean(truth / pool(scatter, repeats)) for truth, scatter in runs])
    assert abs(chi2.mean() - 1) < 0.04
    alone = np.mean([np.mean(truth / scatter) for truth, scatter in runs])
    if repeats > 3:  # of three repeats this mean has no variance
        assert alone == pytest.approx((repeats - 1) / (repeats - 2), rel=0.06)


@pytest.mark.parametrize(
    "parts",
    [
        pytest.param(parts, id=name, marks=() if name == "both" else pytest.mark.long)
        for name, parts in PARTS.items()
    ],
)
def test_it_follows_the_resonance(parts):
    random = np.random.default_rng(7)
    runs = [drawn(random, 5, parts) for _ in range(200)]
    ratio = np.mean([pool(scatter, 5) / truth for truth, scatter in runs], axis=0)
    assert np.all(np.abs(ratio - 1) < 0.2)
    assert abs(np.mean(ratio) - 1) < 0.03


def test_a_line_with_hum_keeps_its_own_and_its_neighbours_theirs():
    random = np.random.default_rng(8)
    truth, scatter = drawn(random, 10, PARTS["both"])
    scatter[[50, 51, 200]] *= 400.0
    pooled = pool(scatter, 10)
    np.testing.assert_array_equal(pooled[[50, 51, 200]], scatter[[50, 51, 200]])
    neighbours = [48, 49, 52, 53, 199, 201]
    assert np.all(pooled[neighbours] < 2 * truth[neighbours])


def test_many_repeats_need_no_neighbours():
    assert _noise_level.neighbours(200.0, 1.0) == 1
    assert _noise_level.neighbours(11.0, 1.0) == 11
    assert _noise_level.neighbours(11.0, 2.0) == 21
    scatter = np.random.default_rng(9).uniform(0.5, 2.0, LINES.size)
    assert pool(scatter, 200) is scatter


def test_no_scatter_at_all_stays_none():
    np.testing.assert_array_equal(pool(np.zeros(LINES.size), 5), 0.0)


def test_the_unit_has_no_consequence():
    scatter = np.random.default_rng(10).gamma(4.0, 0.25, LINES.size)
    other = _noise_level.pooled(1e-18 * scatter, 1e6 * FORCE, 1e-9 * FRF, 5.0, 25)
    np.testing.assert_allclose(other, 1e-18 * pool(scatter, 5, 25), rtol=1e-6)
