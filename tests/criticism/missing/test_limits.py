"""Explain and improve with few data, unknown noise, known effects, or nothing to fit."""

import json

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.errors import InfeasibleError, InputError
from bayes_placement.criticism.missing._model_error_choice import ticks
from bayes_placement.criticism.missing.explain import explain
from bayes_placement.criticism.missing.improve import improve
from tests.criticism import small
from tests.criticism.small import GAIN, LINES, MASS, measured


def experiment(sensors=("s1", "s2"), frequency=LINES, noise=None, effect=None):
    """Return the small bar with some of its sensors and lines."""
    bar = small.experiment()
    return bp.Experiment(
        bar.structure if effect is None else bar.structure + effect,
        sensors=[bar.sensor[name] for name in sensors],
        actuators=list(bar.actuator.values()),
        frequency=frequency,
        observe=bar.observe,
        noise=bar.noise if noise is None else noise,
    )


def without_sensor(measurement, sensor):
    """Return a measurement in which nothing was measured by one sensor."""
    frf = np.array(measurement.frf)
    frf[sensor] = np.nan
    return bp.Measurement.from_arrays(
        frf,
        measurement.frequency,
        sensors=measurement.sensors,
        actuators=measurement.actuators,
        quantity="accelerance",
        coherence=measurement.coherence,
        averages=measurement.averages,
    )


DELAY = effects.library(small.experiment(), ["time_delay"])


def test_a_ledger_of_few_lines_and_a_dead_sensor_can_be_written(tmp_path):
    setup = experiment(frequency=LINES[[10, 20, 30]])
    ledger = improve(setup, without_sensor(measured(), 1), candidates=DELAY)
    ledger.write(tmp_path / "ledger.json")
    (step,) = json.loads((tmp_path / "ledger.json").read_text())["steps"]
    assert np.isfinite(step["held_out"])  # one line at a time


def test_what_a_single_line_cannot_tell_is_left_out(tmp_path):
    one_line = experiment(["s1"], LINES[[20]])
    ledger = improve(one_line, measured(), candidates=DELAY)
    ledger.write(tmp_path / "ledger.json")
    (step,) = json.loads((tmp_path / "ledger.json").read_text())["steps"]
    assert step["held_out"] is None
    assert ledger.table()["held out"].tolist() == [""]
    assert "nan" not in str(ledger)


def test_an_unknown_factor_on_the_noise_is_fitted_beside_each_effect():
    unknown = experiment(noise=bp.noise.FromCoherence(dist.LogUniform(0.5, 4.0)))
    candidates = effects.library(unknown, ["gain_error"])
    ranking = explain(unknown, measured(GAIN, seed=5), candidates=candidates)
    assert max(ranking.probabilities, key=ranking.probabilities.get) == "gain_error"
    factor = ranking.steps[0].parameters["noise.factor"]
    assert factor.low < 1 < factor.high


def test_beside_unknown_noise_residuals_that_scatter_as_lines_do_end_the_search():
    unknown = experiment(noise=bp.noise.FromCoherence(dist.LogUniform(0.5, 4.0)))
    candidates = effects.library(unknown, ["gain_error", "time_delay"])
    ledger = improve(unknown, measured(GAIN, seed=5), candidates=candidates)
    assert ledger.verdict == ("gain_error",)
    assert not ledger.compared["effects"].str.contains("+", regex=False).any()


def test_a_model_without_any_unknown_is_searched_as_any_other():
    known = experiment(["s1"], LINES[::6]).fix(
        {name: value for name, value in small.TRUTH.items() if name != "sensor.s2.position"}
    )
    assert known.unknowns == []
    candidates = effects.library(known, ["time_delay"])
    assert improve(known, measured(), candidates=candidates).verdict == ()
    late = improve(known, measured(effects.time_delay(1e-4)), candidates=candidates)
    assert late.verdict == ("time_delay",)


@pytest.mark.long
def test_a_second_effect_of_one_kind_is_numbered():
    light = effects.point_mass(0.8, dist.Uniform(0.05, 0.15))
    known = experiment(effect=light)
    hidden = measured(MASS, effects.point_mass(0.8, 0.1, name="light"), seed=6)
    candidates = effects.library(known, ["point_mass"])
    ledger = improve(known, hidden, candidates=candidates)
    assert ledger.verdict == ("point_mass",)
    assert ledger.steps[-1].added == "point_mass_2"
    place = ledger.steps[-1].parameters["structure.effects.point_mass_2.at"]
    assert place.low < MASS.at < place.high
    assert "Missing: point_mass, 0.3" in ledger.sentence()


@pytest.mark.parametrize("verb", [explain, improve])
def test_what_cannot_be_fitted_is_refused_before_any_work(verb):
    shares = []
    gamma = effects.point_mass(0.3, dist.Gamma(2.0, 1.0))
    candidates = effects.library(small.experiment(), [], further=[gamma])
    with pytest.raises(InfeasibleError, match="has the distribution Gamma"):
        verb(small.experiment(), measured(), candidates=candidates, progress=shares.append)
    with pytest.raises(InputError, match="No candidate was given"):
        verb(small.experiment(), measured(), candidates=effects.library(small.experiment(), []))
    assert shares == []


def test_an_experiment_without_noise_is_refused():
    bar = small.experiment()
    quiet = bp.Experiment(
        bar.structure,
        sensors=list(bar.sensor.values()),
        actuators=list(bar.actuator.values()),
        frequency=LINES,
        observe=bar.observe,
        noise=None,
    )
    with pytest.raises(ValueError, match="noise=None, so residuals cannot be compared"):
        explain(quiet, measured(), candidates=effects.library(quiet, ["time_delay"]))


def test_parts_of_stages_are_equal_and_none_goes_beyond_its_stage():
    shares = []
    tick = ticks(shares.append, 0.02, (2, 0.2), (4, 0.9))
    for _ in range(8):
        tick()
    assert shares == pytest.approx([0.11, 0.2, 0.375, 0.55, 0.725, 0.9, 0.9, 0.9])
