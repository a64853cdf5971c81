"""Amplitudes alone: the place and the law of few numbers come out, and no law is read by lines."""

import functools
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.reach._at_port import omega_of, rows_of
from bayes_placement.criticism.reach._free_law import FreeLaw
from bayes_placement.criticism.reach._laws_in_full import LawsInFull
from bayes_placement.criticism.reach._ports import place_columns, ports_of
from bayes_placement.laws.rows import NUMBERS
from tests.criticism.reach.cantilever import AT, experiment, maxwell, measured
from tests.criticism.reach.test_free_law import gradient_of


def of_amplitudes():
    return experiment(bp.observe.LogAmplitude("acceleration"))


@functools.cache
def plain():
    setup = of_amplitudes()
    return null_hypothesis(setup, setup.data(measured(maxwell))).problem


@functools.cache
def reached():
    return bp.reach(of_amplitudes(), measured(maxwell))


@pytest.mark.long
@pytest.mark.longest
def test_the_place_and_the_law_come_out():
    best = reached().laws.iloc[0]
    assert (best["acts_on"], best["law"].tree()) == ("displacement", ["-", "c", "k"])
    assert best["x"] == pytest.approx(AT, abs=5e-3)
    assert best["chi2_per_datum"] == pytest.approx(1.0, abs=0.25)
    curves = reached().curves
    assert curves["any_law"].isna().all()
    along = curves[curves["acts_on"] == "displacement"]
    assert along["few_numbers"].max() > 0.9
    assert along["x"][along["few_numbers"].idxmax()] == pytest.approx(AT, abs=0.02)


@pytest.mark.long
@pytest.mark.longest
def test_what_amplitudes_do_not_tell_is_said():
    *kinds, last = reached().words()
    assert last.startswith("From amplitudes only laws of few numbers are tried")
    assert not any("any law" in sentence for sentence in kinds)
    assert json.loads(json.dumps(reached().to_json()))[0]["curve"][0]["any_law"] is None
    with pytest.raises(InputError, match="complex FRFs are needed"):
        reached().law_as_measured()
    with pytest.raises(InputError, match="complex FRFs of one state at fewer lines are needed"):
        reached().any_law_within(0.0, 1e4)


@pytest.mark.long
@pytest.mark.longest
def test_curves_are_drawn_without_channels():
    figure = bp.plots.reach.curves(reached(), experiment=of_amplitudes())
    titles = [axes.get_title() for axes in figure.axes]
    assert sum("probability" in title for title in titles) == 4
    plt.close(figure)


@pytest.mark.parametrize("is_held", [True, False])
@pytest.mark.parametrize("kind", ["displacement", "relative", "cut"])
def test_slopes_of_laws_of_amplitudes(kind, is_held):
    base = plain()
    port = next(port for port in ports_of(base.experiment) if port.acts_on == kind)
    problem = base.with_effect(port.effect)
    free = FreeLaw(problem, place_columns(port, problem) if is_held else [])
    rows = rows_of(port, free)
    objective = LawsInFull(free, rows, omega_of(free), port.is_cut)
    random = np.random.default_rng(3)
    point = 0.3 * random.standard_normal(problem.dimension + NUMBERS)
    row = np.append(point, rows.trees.index(["-", "c", "k"]))
    found = objective.normal_equations(row[None])
    moved = [number for number in range(len(point)) if number not in free.held]
    expected = gradient_of(lambda p: objective.cost(p[None])[0], row, moved)
    assert np.allclose(found.gradient[0, moved], expected, rtol=1e-2, atol=1e-2)
    assert np.all(found.gradient[0, free.held] == 0.0)
    # The law does something there: its prior is about what the port feels.
    assert np.linalg.norm(found.gradient[0, problem.dimension : -1]) > 1.0
