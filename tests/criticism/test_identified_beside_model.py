"""Modes of FRFs alone beside those of a model, in sentences."""

import re

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.fitted_modes import identified_beside_model
from tests.experiment import modal_bars
from tests.experiment.test_identification import DRIVEN, LINES, PLACES, measured


def experiment(places):
    bar = bp.beams.bar(
        20,
        length=1.0,
        area=modal_bars.AREA,
        youngs_modulus=dist.Uniform(0.9e9, 1.2e9),
        density=modal_bars.DENSITY,
    )
    return bp.Experiment(
        bp.Structure(bar, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor(f"s{number}", at=at) for number, at in enumerate(places)],
        actuators=[bp.Actuator(f"a{number}", at=at) for number, at in enumerate(DRIVEN)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromVariance(),
    )


@pytest.mark.long
def test_a_model_that_is_too_stiff_is_seen_mode_by_mode():
    values = {"structure.modes.youngs_modulus": 1.04e9}
    sentences = identified_beside_model(experiment(PLACES), measured(seed=0), values)
    assert [sentence.split(":")[0] for sentence in sentences] == ["Mode 1", "Mode 2", "Mode 3"]
    for number, sentence in enumerate(sentences, start=1):
        found = re.search(
            r"have ([\d.]+) ± .* of ([\d.]+), the model ([\d.]+) .*and 0.02\.", sentence
        )
        frequency, damping, of_model = map(float, found.groups())
        np.testing.assert_allclose(frequency, 500 / 3 * number, rtol=1e-4)
        np.testing.assert_allclose(damping, 0.01, rtol=0.02)
        np.testing.assert_allclose(of_model / frequency, np.sqrt(1.04), rtol=1e-4)


def test_where_nothing_tells_which_mode_it_is_nothing_is_said():
    values = {"structure.modes.youngs_modulus": 1e9}
    whole = measured(seed=0)
    one = whole.channels(["s0"], whole.actuators)
    assert identified_beside_model(experiment(PLACES[:1]), one, values) == []
    assert identified_beside_model(experiment(PLACES), [whole, whole], values) == []
