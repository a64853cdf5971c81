"""A state and its baseline by modal parameters: what the model does not know cancels."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._before_and_after import over_both, state_of
from bayes_placement.criticism.missing._cautions import cautions_of_fit
from bayes_placement.criticism.missing._hypotheses import null_hypothesis, with_errors
from bayes_placement.inference.residuals_of_state import State
from tests.criticism import small
from tests.experiment import modal_bars

PLACES = (0.12, 0.27, 0.43, 0.81)
MODES = 5
OFF = np.array([1.015, 0.985, 1.01, 0.98, 1.02, 0.99])
"""What natural frequencies are of those of the model."""

MASS = {"mass_at": 0.33, "mass": 0.3}


def state(seed, count=MODES, modulus=1.0, **hidden):
    """Modal parameters of a bar whose natural frequencies the model does not have."""
    noise = np.random.default_rng(seed)
    known = modal_bars.measured(PLACES, count, noise=noise, ratio=0.01, **hidden)
    return bp.ModalParameters(
        known.natural_frequency * OFF[:count] * np.sqrt(modulus),
        damping_ratio=known.damping_ratio,
        shape=known.shape,
        sensors=known.sensors,
        covariance=known.covariance,
    )


def observing(measurement):
    ratio = dist.Uniform(0.005, 0.02)
    return modal_bars.experiment(
        measurement, PLACES, modulus=modal_bars.unknown_modulus(), ratio=ratio
    )


@pytest.mark.long
@pytest.mark.longest
def test_a_mass_that_moves_modes_less_than_the_model_errs_is_new_where_it_is():
    states = {"new": state(1), "again": state(3, MODES - 1), "loaded": state(2, **MASS)}
    declared = observing(states["new"])
    candidates = bp.effects.library(declared, ["point_mass", "ground_spring"])
    ledger = bp.improve(declared, states, candidates=candidates, most_effects=1)
    assert ledger.new == {"again": (), "loaded": ("point_mass",)}
    again, loaded = ledger.ledgers.values()
    assert again.sentence().startswith("Nothing is claimed to be new since the baseline")
    assert again.baseline.chi2_per_datum < 1.5
    parameters = loaded.steps[-1].parameters_of_added()
    for name, truth in (("at", MASS["mass_at"]), ("mass", MASS["mass"])):
        (estimate,) = (value for key, value in parameters.items() if key.endswith(name))
        assert estimate.low < truth < estimate.high


@pytest.mark.long
def test_another_temperature_is_another_modulus_and_no_mass():
    warm = state(2, modulus=0.97)
    declared = observing(warm)
    kinds = ["point_mass", "sensor_mass", "modulus_change"]
    candidates = bp.effects.library(declared, kinds)
    ledger = bp.improve(declared, warm, baseline=state(1), candidates=candidates, most_effects=1)
    assert ledger.verdict == ("modulus_change",)
    (change,) = ledger.steps[-1].parameters_of_added().values()
    assert change.low < -0.03 < change.high
    alone = bp.improve(declared, warm, candidates=candidates, most_effects=1, model_error=None)
    assert "point_mass" in alone.probabilities and "modulus_change" not in alone.probabilities
    asked = bp.effects.library(declared, ["modulus_change"])
    alone = bp.improve(declared, warm, candidates=asked, most_effects=1, model_error=None)
    assert "modulus_change" in alone.probabilities


@pytest.mark.long
def test_one_state_of_modes_does_not_tell_a_change_from_an_error():
    later = observing(state(1)).with_model_error(bp.model_error.Embedded())
    words = "modes of this one state, which do not tell"
    exact = null_hypothesis(later.with_errors(None), later.observe.own_data())
    assert not any(words in sentence for sentence in cautions_of_fit(exact))
    alone = with_errors(exact, later.model_error)
    assert any(words in sentence for sentence in cautions_of_fit(alone))
    both = over_both(State(later, exact.problem.data), state_of(later, state(3)), alone)
    assert not any(words in sentence for sentence in cautions_of_fit(both))


def test_an_earlier_state_has_the_modes_of_which_the_model_has_errors():
    later = observing(state(2)).with_model_error(bp.model_error.Embedded())
    assert later.model_error.modes == MODES
    earlier = state_of(later, state(1, MODES + 1).channels(["s2", "s0"]))
    np.testing.assert_array_equal(
        earlier.experiment.frequency, state(1, MODES + 1).natural_frequency[:MODES]
    )
    assert [*earlier.experiment.sensor] == ["s0", "s2"]
    assert np.asarray(earlier.data.measured).shape == (4, 1, MODES)
    with pytest.raises(InputError, match="a mode of both states is needed"):
        state_of(later, bp.ModalParameters([900.0], [1.0], number=[6]))


def test_each_measured_mode_has_an_error_though_it_fell_by_an_eighth():
    fallen = state(1).natural_frequency * np.r_[np.ones(MODES - 1), 0.88]
    measured = bp.ModalParameters(fallen, 1e-3 * fallen, number=range(1, MODES + 1))
    declared = modal_bars.experiment(measured, ())
    errors = declared.with_model_error(bp.model_error.Embedded()).model_error
    assert errors.modes == MODES


def test_states_of_modes_are_not_those_of_an_experiment_of_frfs():
    with pytest.raises(InputError, match="measured FRFs are needed"):
        bp.improve(small.experiment(), {"new": state(1), "again": state(3)})
