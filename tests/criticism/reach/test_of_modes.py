"""Modal parameters: the place of a mass or a cut, and that no law over frequency can be read."""

import functools
import json

import matplotlib.pyplot as plt
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.reach._of_modes import Held
from tests.experiment import modal_bars

PLACES = (0.11, 0.27, 0.45, 0.62, 0.83)
AT, MASS = 0.3, 0.3


def bar(modes):
    return modal_bars.experiment(
        modes, PLACES, modulus=modal_bars.unknown_modulus(), ratio=dist.Uniform(0.005, 0.03)
    )


@functools.cache
def reached():
    noise = np.random.default_rng(0)
    modes = modal_bars.measured(PLACES, 6, noise=noise, mass_at=AT, mass=MASS, ratio=0.01)
    return bp.reach(bar(modes), modes)


@pytest.mark.long
@pytest.mark.longest
def test_a_mass_is_found_at_its_place():
    found = reached()
    best = found.laws.iloc[0]
    assert (best["acts_on"], best["law"].kind) == ("displacement", "point_mass")
    assert best["x"] == pytest.approx(AT, abs=5e-3)
    assert best["law"].numbers["mass"][0] == pytest.approx(MASS, rel=0.05)
    assert found.chi2_per_datum > 10 and best["chi2_per_datum"] < 1.5
    assert found.kinds().index[0] == "displacement"
    along = found.curves[found.curves["acts_on"] == "displacement"]
    assert along["x"][along["few_numbers"].idxmax()] == pytest.approx(AT, abs=0.03)


@pytest.mark.long
@pytest.mark.longest
def test_what_modes_do_not_tell_is_said():
    first, *_, last = reached().words()
    assert first.startswith("displacement at 3") and "point_mass of mass 0.3" in first
    assert last.startswith("From modal parameters no law over frequency can be read")
    assert reached().curves["any_law"].isna().all()
    assert json.loads(json.dumps(reached().to_json()))[0]["best"]["law_tree"] == "point_mass"
    with pytest.raises(InputError, match="complex FRFs are needed"):
        reached().law_as_measured()


@pytest.mark.long
@pytest.mark.longest
def test_curves_of_modes_are_drawn():
    figure = bp.plots.reach.curves(reached())
    assert "point_mass" in figure.axes[0].get_title()
    plt.close(figure)


def test_what_is_held_is_not_moved():
    modes = modal_bars.measured(PLACES, 3)
    problem = null_hypothesis(bar(modes), bar(modes).data(modes)).problem
    objective = problem.squares.objective()
    point = np.array([[0.4, -0.3]])
    held, whole = (each.normal_equations(point) for each in (Held(objective, [1]), objective))
    step = np.linalg.solve(held.curvature, -held.gradient[..., None])[0, :, 0]
    expected = -whole.gradient[0, 0] / whole.curvature[0, 0, 0]
    assert step == pytest.approx([expected, 0.0])
