"""What is new since a baseline: laws act in the later state, and all else is shared by both."""

import dataclasses
import functools

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._before_and_after import state_of
from bayes_placement.criticism.reach._channels import channels_of, free_factor
from bayes_placement.criticism.reach._free_factor import Responses
from bayes_placement.criticism.reach._free_law import AnyLaw, FreeLaw
from bayes_placement.criticism.reach._ports import ports_of
from bayes_placement.inference.residuals import Problem
from tests.criticism.reach.cantilever import AT, LINES, experiment, maxwell, measured
from tests.criticism.reach.test_free_law import gradient_of
from tests.experiment import modal_bars

OTHER_LINES = slice(None, None, 3)


def before():
    """The cantilever without anything, at fewer lines than later."""
    all_lines = measured(seed=1)
    return dataclasses.replace(
        all_lines,
        frequency=all_lines.frequency[OTHER_LINES],
        frf=all_lines.frf[..., OTHER_LINES],
        coherence=all_lines.coherence[..., OTHER_LINES],
    )


@pytest.fixture(scope="module")
def problem():
    setup = experiment()
    later = setup.data(measured(maxwell, seed=2))
    return Problem(setup, later, baseline=state_of(setup, before()))


@pytest.fixture(scope="module")
def free(problem):
    return FreeLaw(problem.with_effect(ports_of(problem.experiment)[0].effect))


def points_of(free):
    return 0.3 * np.random.default_rng(0).standard_normal((2, free.problem.dimension))


def test_no_law_changes_the_earlier_state(free):
    at = free.at(points_of(free))
    later = free.problem.data.z.shape[0]  # of one actuator
    assert np.all(at.slope[:, later:] == 0.0) and np.all(at.slope[:, :later] != 0.0)
    ones = np.ones((2, LINES.size), complex)
    with_law = free.residuals(points_of(free), ones, ones)  # as the effect of the port has it
    residual, _ = free.problem.squares.residuals(points_of(free))
    assert np.sum(np.abs(with_law) ** 2) == pytest.approx(np.sum(residual**2), rel=1e-12)


def test_slopes_with_both_states(free):
    objective, point = AnyLaw(free), points_of(free)[0]
    found = objective.normal_equations(point[None])
    expected = gradient_of(lambda p: objective.cost(p[None])[0], point, range(len(point)))
    assert np.allclose(found.gradient[0], expected, rtol=1e-3, atol=1e-3)


def test_a_factor_is_on_channels_of_the_later_state_alone(problem):
    factor = free_factor(channels_of(problem.experiment)[0], Responses(problem))
    at = factor.at(np.zeros((1, problem.dimension)))
    moved = np.any(at.slope[0] != 0.0, axis=-1)
    assert moved.tolist() == [True] + [False] * (len(moved) - 1)
    assert len(moved) == len(LINES[OTHER_LINES]) * 3 / len(LINES) + 3


@functools.cache
def reached(law):
    return bp.reach(experiment(), measured(law, seed=2), baseline=before())


@pytest.mark.long
def test_place_and_law_of_what_is_new_come_out():
    found = reached(maxwell)
    best = found.laws.iloc[0]
    assert (best["acts_on"], best["law"].tree()) == ("displacement", ["-", "c", "k"])
    assert best["x"] == pytest.approx(AT, abs=2e-3)
    assert found.chi2_per_datum > 10
    assert best["chi2_per_datum"] == pytest.approx(1.0, abs=0.15)
    assert found.words()[0].startswith("New since the baseline: displacement at 2")
    table = found.law_as_measured("displacement")
    apart = np.abs(table["real"] - maxwell(2 * np.pi * table["frequency"].to_numpy()).real)
    assert np.mean(apart < 1.96 * table["deviation_real"]) > 0.85


@pytest.mark.long
@pytest.mark.longest
def test_where_nothing_is_new_that_is_all_that_is_said():
    (sentence,) = reached(None).words()
    assert sentence.startswith("Nothing is seen to be new since the baseline")
    assert repr(reached(None)).endswith(sentence)


def test_of_modal_parameters_states_are_not_compared():
    modes = modal_bars.measured((0.1, 0.4), 3)
    with pytest.raises(InputError, match="FRFs of both states"):
        bp.reach(modal_bars.experiment(modes, (0.1, 0.4)), modes, baseline=modes)
