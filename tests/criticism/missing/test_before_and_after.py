"""A state and its baseline: flaws of the model cancel, and a small new effect is detected."""

import dataclasses

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects, explain, improve
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._before_and_after import state_of
from bayes_placement.inference.residuals import Problem
from bayes_placement.inference.residuals_of_state import State
from tests.criticism.small import LINES, MASS, TRUTH, experiment, recorded
from tests.criticism.small import measured as small_measured

SMALL = effects.point_mass(0.313, 0.05)
SIZES = {"frequency": 0.01, "damping": 0.2, "shape": 0.05, "gain": 0.01}


def imperfect(seed, *hidden):
    """The true bar, no mode and no channel of which is as the model has them.

    What is hidden adds its errors after those of the bar, which stay as they are.
    """
    declared = bp.model_error.Embedded(**SIZES, stiffness_and_mass=None)
    erroneous = experiment().fix(TRUTH).with_model_error(declared)
    for effect in hidden:
        erroneous = erroneous + effect
    random = np.random.default_rng(seed)
    return erroneous.fix(
        {
            unknown.name: random.standard_normal(unknown.distribution.shape())
            for unknown in erroneous.unknowns
        }
    )


def measured(true, seed):
    return recorded(true, seed, averages=100, coherence=0.998)


@pytest.fixture(scope="module")
def before():
    return measured(imperfect(1), 2)


@pytest.fixture(scope="module")
def after():
    return measured(imperfect(1, SMALL), 3)


@pytest.fixture(scope="module")
def candidates():
    return effects.library(experiment(), ["point_mass", "gain_error", "time_delay"])


@pytest.mark.long
def test_nothing_is_built_on_a_baseline_that_is_not_explained(before, after, candidates):
    """An exact model explains neither state: single effects tell what is nearest."""
    ledger = improve(experiment(), after, baseline=before, candidates=candidates, model_error=None)
    assert ledger.verdict == ()
    assert bp.decide(ledger.rows).reasons == ("the baseline is not explained by the model",)
    assert {len(row.kinds) for row in ledger.rows.rows} == {0, 1}


def test_a_mass_far_smaller_than_the_model_error_is_new(before, after, candidates):
    ledger = improve(experiment(), after, baseline=before, candidates=candidates, most_effects=1)
    assert ledger.verdict == ("point_mass",)
    parameters = ledger.steps[-1].parameters_of_added()
    for name, truth in (("at", 0.313), ("mass", 0.05)):
        (estimate,) = (value for key, value in parameters.items() if key.endswith(name))
        assert estimate.low < truth < estimate.high
    assert ledger.baseline.chi2_per_datum == pytest.approx(1.0, abs=0.2)
    assert "New since the baseline: point_mass" in str(ledger)
    assert "frequency" in ledger.table() and "without model error" not in ledger.table()


@pytest.mark.long
@pytest.mark.longest
def test_where_nothing_is_new_nothing_is_claimed(before, candidates):
    again = measured(imperfect(1), 4)
    ledger = improve(experiment(), again, baseline=before, candidates=candidates, most_effects=1)
    assert ledger.verdict == ()
    assert "Nothing is claimed to be new" in ledger.sentence()


@pytest.mark.long
def test_of_an_exact_model_an_effect_is_new_too():
    before, after, again = (
        small_measured(*hidden, seed=seed) for seed, hidden in enumerate([(), (MASS,), ()])
    )
    candidates = effects.library(experiment(), ["point_mass", "gain_error"])
    settings = {"baseline": before, "candidates": candidates, "model_error": None}
    ledger = improve(experiment(), after, **settings)
    assert ledger.verdict == ("point_mass",)
    assert ledger.steps[-1].chi2_per_datum == pytest.approx(1.0, abs=0.2)
    assert improve(experiment(), again, **settings).verdict == ()


@pytest.mark.long
@pytest.mark.parametrize(
    ("hidden", "kinds"),
    [
        (MASS, {(), ("point_mass",)}),
        (effects.segment_mass(0.5, 0.4, 0.6), {(), ("point_mass",), ("segment_mass",)}),
    ],
)
def test_what_takes_long_is_fitted_where_nothing_else_explains_the_data(hidden, kinds):
    before, after = small_measured(seed=4), small_measured(hidden, seed=5)
    candidates = effects.library(experiment(), ["point_mass", "segment_mass"])
    settings = {"baseline": before, "candidates": candidates, "model_error": None}
    ledger = improve(experiment(), after, **settings, most_effects=1)
    assert ledger.verdict == (hidden.kind,)
    assert {row.kinds for row in ledger.rows.rows} == kinds


@pytest.mark.long
@pytest.mark.longest
def test_with_unknown_noise_the_same_mass_is_new(before, after):
    unknown = bp.noise.Relative(dist.LogUniform(1e-3, 0.3))
    noisy = eqx.tree_at(lambda tree: tree.noise, experiment(), unknown)
    candidates = effects.library(noisy, ["point_mass", "gain_error"])
    ledger = improve(noisy, after, baseline=before, candidates=candidates, most_effects=1)
    assert ledger.verdict == ("point_mass",)
    assert "the noise that the model needs is" in ledger.sentence()
    assert "The baseline alone needs noise of" in ledger.sentence()


@pytest.mark.long
@pytest.mark.longest
def test_explain_ranks_what_is_new(before, after, candidates):
    ranking = explain(experiment(), after, baseline=before, candidates=candidates)
    assert ranking.claimed == ("point_mass",)
    assert ranking.baseline.chi2_per_datum == pytest.approx(1.0, abs=0.2)
    assert ranking.words()[0].startswith("New since the baseline is point_mass, ")


@pytest.mark.long
@pytest.mark.longest
def test_explain_says_that_nothing_is_new(before, candidates):
    again = measured(imperfect(1), 4)
    ranking = explain(experiment(), again, baseline=before, candidates=candidates)
    assert ranking.claimed == ()
    assert ranking.words()[0].startswith("Nothing is new since the baseline was measured, with")


def test_residuals_of_both_states_are_those_of_each(before, after):
    later = experiment() + effects.point_mass(0.3, 0.1)
    earlier = state_of(experiment(), before)
    problem = Problem(later, later.data(after), baseline=earlier)
    point = np.random.default_rng(0).uniform(-1, 1, (2, problem.dimension))
    joint, log_scale = problem.squares.residuals(point)
    parts = [
        Problem(later, later.data(after)).squares.residuals(point),
        Problem(earlier.experiment, earlier.data).squares.residuals(point),
    ]
    np.testing.assert_allclose(joint, np.concatenate([part[0] for part in parts], axis=1))
    np.testing.assert_allclose(log_scale, parts[0][1] + parts[1][1])


def test_an_earlier_state_may_have_other_lines_and_fewer_channels(before):
    fewer = before.lines(LINES[10:50:2])
    alone = fewer.channels(fewer.sensors[:1], fewer.actuators)
    state = state_of(experiment(), alone)
    assert isinstance(state, State)
    assert [*state.experiment.sensor] == ["s1"]
    np.testing.assert_array_equal(state.experiment.frequency, LINES[10:50:2])


def test_a_baseline_of_other_channels_is_refused(before):
    others = tuple(bp.Channel(f"x{channel.name}", channel.direction) for channel in before.sensors)
    renamed = dataclasses.replace(before, sensors=others)
    with pytest.raises(ValueError, match="shares no line, no sensor or no actuator"):
        state_of(experiment(), renamed)


def test_modal_parameters_beside_frfs_are_a_wrong_argument(before):
    modes = bp.ModalParameters([160.0], [0.1])
    with pytest.raises(InputError, match="the same is needed of both") as refused:
        improve(experiment(), before, baseline=modes)
    assert refused.type is InputError, "another method would not help"


@pytest.mark.long
@pytest.mark.longest
def test_two_effects_that_each_win_alone_elsewhere_are_found_together():
    """Alone, a removed mass at another place explains more than the mass that is there."""
    stiffness, at = 2e6, 0.8
    hidden = MASS, effects.ground_spring(at, stiffness)
    ledger = bp.improve(
        experiment(),
        small_measured(*hidden, seed=4),
        baseline=small_measured(seed=3),
        candidates=effects.library(experiment(), ["point_mass", "ground_spring"]),
        most_effects=2,
    )
    assert not ledger.unexplained
    assert "removed" not in ledger.sentence()
    parameters = ledger.steps[-1].parameters
    for name, true in (
        ("point_mass.mass", MASS.mass),
        ("point_mass.at", MASS.at),
        ("ground_spring.stiffness", stiffness),
        ("ground_spring.at", at),
    ):
        estimate = parameters[f"structure.effects.{name}"]
        assert estimate.low < true < estimate.high, name
