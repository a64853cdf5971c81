"""What a posterior says of its unknowns, in the units of people, with its peaks."""

import numpy as np
import pytest
import xarray as xr

from bayes_placement.inference import summary as summaries
from bayes_placement.inference.units import ReadableUnit, readable

UNIMODAL = {
    "normal": lambda random: random.normal(size=1000),
    "uniform": lambda random: random.uniform(size=1000),
    "exponential": lambda random: random.exponential(size=1000),
    "heavy tails": lambda random: random.standard_t(3, size=1000),
    "a shoulder": lambda random: np.r_[random.normal(size=700), random.normal(2, 1, size=300)],
    "a single value": lambda random: np.full(1000, 0.3),
}


@pytest.mark.parametrize("name", UNIMODAL)
def test_one_peak_is_not_taken_for_two(name):
    peaks = [summaries.peaks(UNIMODAL[name](np.random.default_rng(seed))) for seed in range(40)]
    assert not any(peaks)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
def test_two_peaks_are_two_with_their_shares(share):
    for seed in range(40):
        random, count = np.random.default_rng(seed), round(1000 * share)
        draws = np.r_[random.normal(0.263, 3e-3, count), random.normal(0.283, 2e-3, 1000 - count)]
        low, high = summaries.peaks(random.permutation(draws))
        assert low.mean == pytest.approx(0.263, abs=1.5e-3)
        assert high.mean == pytest.approx(0.283, abs=5e-4)
        assert low.share == pytest.approx(share, abs=0.02)


def test_three_peaks_are_three():
    random = np.random.default_rng(0)
    draws = [random.normal(centre, 1.0, 300) for centre in (0.0, 8.0, 20.0)]
    means = [peak.mean for peak in summaries.peaks(np.concatenate(draws))]
    assert means == pytest.approx([0.0, 8.0, 20.0], abs=0.3)


@pytest.mark.parametrize(
    ("unit", "field", "size", "expected"),
    [
        ("m", "position", 0.3, ReadableUnit(1e3, "mm")),
        ("Pa", "youngs_modulus", 2.1e11, ReadableUnit(1e-9, "GPa")),
        ("Pa", "pressure", 2e5, ReadableUnit(1e-6, "MPa")),
        ("1", "ratio", 0.03, ReadableUnit(100.0, "%")),
        ("1", "gain", 1.02, ReadableUnit(1.0, "")),
        ("kg", "mass", 0.5, ReadableUnit(1.0, "kg")),
        ("kg", "mass", 0.004, ReadableUnit(1e3, "g")),
        ("kg/m3", "density", 9000.0, ReadableUnit(1.0, "kg/m³")),
        ("s", "delay", 3e-5, ReadableUnit(1e6, "µs")),
    ],
)
def test_units_are_those_in_which_people_read(unit, field, size, expected):
    assert readable(unit, field, size) == expected


def test_a_row_of_ten_digits_becomes_a_power_of_ten():
    unit = readable("N/m3", "stiffness", 2.9e9)
    assert unit.number(2909968548.0, 3.2e6) == "2.9100e9"
    assert unit.spread(3.2e6, 2909968548.0) == "3.2e6"


def tree():
    random = np.random.default_rng(1)
    ratio = random.normal(0.035, 0.0014, (4, 250))
    place = np.where(random.random((4, 250)) < 0.5, 0.263, 0.283) + random.normal(0, 1e-3, (4, 250))
    attributes = {
        "ratio": {"units": "1", "field": "ratio"},
        "place": {"units": "m", "field": "position"},
    }
    variables = {
        name: (("chain", "draw"), values, attributes[name])
        for name, values in {"ratio": ratio, "place": place}.items()
    }
    return xr.DataTree.from_dict({"/posterior": xr.Dataset(variables)})


def test_tables_for_people_and_for_files():
    rows = summaries.summary(tree())
    words = summaries.words(rows)
    assert words.loc["ratio", ["sd", "unit"]].tolist() == ["0.14", "%"]
    assert float(words.loc["ratio", "mean"]) == pytest.approx(3.5, abs=0.02)
    low, high = map(float, words.loc["ratio", "95 % interval"].split(" to "))
    assert (low, high) == pytest.approx((3.5 - 1.96 * 0.14, 3.5 + 1.96 * 0.14), abs=0.05)
    assert words.loc["place", "mean"] == "263.0 or 283.0"
    numbers = summaries.numbers(rows)
    assert numbers.loc["place", "mean"] == pytest.approx(0.273, abs=1e-3)
    assert numbers.loc["place", "unit"] == "m"
    assert rows[1].in_words() == "place: two places, 263.0 or 283.0 mm (50 and 50 %)"
