"""Information gained by smaller tolerances, at the best places and at the same places."""

import numpy as np
import pytest
import xarray as xr

import bayes_placement as bp
from bayes_placement import design, information
from bayes_placement.design import tolerance
from models import bar

PLACES = np.array([0.2, 0.25, 0.3, 0.4])
SMALL = information.KernelGain(draws=128, placement_draws=64)


@pytest.fixture(scope="module")
def study():
    experiment = bar.placed(0.3, 0.3, None, structure=bar.bar(0.04, bar.PRIOR))
    shares = []
    result = design.tolerance_study(
        experiment, {"s1": PLACES, "a1": [0.25]}, estimator=SMALL, progress=shares.append
    )
    assert np.all(np.diff(shares) >= 0) and shares[-1] == 1
    return result


def declared(factor):
    """The same map with the tolerance as it would be declared."""
    experiment = bar.placed(0.3, 0.3, None, structure=bar.bar(0.04, bar.PRIOR))
    seats = [bp.positions.Segment(at, within=0.04 * factor) for at in PLACES]
    across = [bp.positions.Segment(0.25, within=0.04 * factor)]
    return bp.information_map(experiment, {"s1": seats, "a1": across}, estimator=SMALL)


@pytest.mark.parametrize("factor", [1.0, 0.25])
def test_each_map_is_that_of_the_tolerance(study, factor):
    scaled = study.maps["information_gain"].sel(tolerance_factor=factor)
    np.testing.assert_allclose(
        scaled.values, declared(factor)["information_gain"].values, rtol=1e-5
    )


def test_the_table_says_what_a_jig_buys(study):
    table, kl = study.table, study.maps["information_gain"]
    assert list(table.index) == [1.0, 0.5, 0.25]
    home = int(np.argmax(kl.sel(tolerance_factor=1.0).values))
    for factor in table.index:
        row, gains = table.loc[factor], kl.sel(tolerance_factor=factor).values.ravel()
        assert row["s1"] == PLACES[np.argmax(gains)] and row["a1"] == 0.25
        assert row["improvement"] == pytest.approx(
            gains.max() - kl.sel(tolerance_factor=1.0).values.max()
        )
        assert row["relocation"] == pytest.approx(gains.max() - gains[home])
    assert (
        table["improvement"][0.25]
        > table["improvement"][0.5]
        > 5 * table["improvement_se"][0.5]
        > 0
    )


def handmade(*kl):
    """A map over two places, with two replicates that differ by 0.1 and 0.3 nat."""
    kl = np.array(kl)
    without = kl[:, None] + np.array([[0.1, -0.1], [0.3, -0.3]])
    variables = {
        "information_gain": ("s1", kl),
        "information_gain_se": ("s1", kl),
        "information_gain_jackknife": (("s1", "replicate"), without),
    }
    return xr.Dataset(variables, coords={"s1": [0.2, 0.3]})


def test_the_optimum_may_move():
    table = tolerance._table([handmade(2.0, 1.5), handmade(2.5, 4.0)], [1.0, 0.5])
    assert list(table["s1"]) == [0.2, 0.3]
    assert table["improvement"][0.5] == pytest.approx(2.0) and table["relocation"][
        0.5
    ] == pytest.approx(1.5)
    # Both differences are between a place of each kind: their replicates differ by 0.2 nat.
    assert table["relocation_se"][0.5] == pytest.approx(0.2)
    assert table["improvement_se"][0.5] == pytest.approx(0.2)
    assert list(table.loc[1.0, ["improvement", "relocation"]]) == [0.0, 0.0]


def test_it_speaks(study):
    first, second, _ = str(study).splitlines()
    assert first.startswith("1 times the tolerance: best s1 at 0.25 m, a1 at 0.25 m, ")
    assert second.startswith("0.5 times the tolerance: best s1 at") and "nat more" in second


@pytest.mark.parametrize("factors", [[], [1.0, 0.0]])
def test_tolerances_are_positive(factors):
    with pytest.raises(ValueError, match=r"factors=.* positive multiples of the tolerance"):
        design.tolerance_study(bar.placed(0.3, 0.3, None), {"s1": [0.5]}, factors=factors)


def test_a_place_without_tolerance_has_none_to_change():
    base = bar.placed(0.3, 0.3, None)
    exact = bp.Experiment(
        base.structure,
        sensors=[bp.Sensor("s1", at=0.3)],
        actuators=list(base.actuator.values()),
        frequency=base.frequency,
        observe=base.observe,
        noise=None,
    )
    with pytest.raises(ValueError, match=r'Sensor "s1" was to have 1 times its tolerance, but'):
        design.tolerance_study(exact, {"s1": [0.5]})
