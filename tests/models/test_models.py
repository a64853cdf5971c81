"""Results that the studies in models/ must reach."""

import warnings

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.inference.infer import InferenceWarning
from models import bar, free_free_beam


@pytest.fixture(scope="module")
def bar_result():
    return bp.infer(bar.experiment, bar.measurement, key=0)


@pytest.mark.long
def test_the_bar_study_covers_its_truth(bar_result):
    for name, truth in bar.truth.items():
        draws = bar_result["posterior"][name].values
        low, high = np.quantile(draws, [0.005, 0.995])
        assert low <= truth <= high, name


@pytest.mark.long
def test_the_bar_study_identifies_the_damping_at_uncertain_positions(bar_result):
    estimates = bar_result["estimates"].to_dataset()
    assert estimates.sel(unknown="structure.damping.ratio.1")["cv"] < 0.1
    assert estimates.sel(unknown="structure.damping.ratio.2")["cv"] < 0.02
    assert estimates["kl_parameters"] > 4


@pytest.mark.long
def test_sensor_and_actuator_of_the_bar_can_be_exchanged(bar_result):
    sensor, actuator = (
        bar_result["posterior"][n] for n in ("sensor.s1.position", "actuator.a1.position")
    )
    share = float((sensor < actuator).mean())
    assert 0.4 < share < 0.6
    assert float(np.abs(sensor - actuator).quantile(0.05)) > 0.01  # two separate placements


@pytest.fixture(scope="module")
def beam_result(request):
    shared = request.getfixturevalue("shared_data")
    measurement = bp.io.uff.read(
        shared / "measured/free_free_beam/measured.uff", require_positions=False
    )
    # Laplace's method may warn that its standard deviations are approximate here.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InferenceWarning)
        return bp.infer(free_free_beam.experiment, measurement, engine=free_free_beam.engine, key=0)


@pytest.mark.long
@pytest.mark.longest
def test_six_resonances_of_the_measured_beam(beam_result):
    stiffness = beam_result["posterior"]["structure.modes.youngs_modulus"].values
    beam = free_free_beam.beam.modes
    elastic = np.array(beam.wave_numbers)[beam.rigid_body_modes :][:6]
    resonances = elastic**2 * np.median(np.sqrt(stiffness)) / (2 * np.pi)
    np.testing.assert_allclose(resonances, free_free_beam.RESONANCES, rtol=0.003)


@pytest.mark.long
@pytest.mark.longest
def test_positions_on_the_measured_beam(beam_result):
    draws = beam_result["posterior"].to_dataset()
    response = draws["sensor.1.position"]
    mirrored = response < 0.5
    for name, place in [
        ("sensor.1.position", 0.974),
        ("actuator.1.position", 0.025),
        ("actuator.2.position", 0.077),
        ("actuator.3.position", 0.127),
    ]:
        unmirrored = abs(mirrored - draws[name])
        assert np.all(np.abs(unmirrored.quantile([0.005, 0.995]) - place) < 0.01), name


@pytest.mark.long
@pytest.mark.longest
def test_the_recorded_driving_point_of_the_measured_beam_is_wrong(beam_result):
    # The file records function 1 as read and driven at one point; the posterior has the two at
    # opposite ends of the beam.
    draws = beam_result["posterior"].to_dataset()
    distance = abs(draws["sensor.1.position"] - draws["actuator.1.position"])
    assert float(distance.min()) > 0.9


@pytest.mark.long
@pytest.mark.longest
def test_shapes_of_the_measured_beam_differ_by_some_percent(
    beam_result,
):
    size = beam_result["posterior"]["model_error.shape.size"].values
    low, high = np.quantile(size, [0.005, 0.995])
    assert 0.02 < low < high < 0.2
    # Six natural frequencies of a uniform beam alone err by up to 0.3 %.
    assert 5e-4 < np.median(beam_result["posterior"]["model_error.frequency.size"].values) < 0.01
