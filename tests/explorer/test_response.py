"""Responses of the page: rows of their channels, and the numbers of criticism."""

import dataclasses

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.fitted import outputs_at
from bayes_placement.explorer.response import (
    ResponseOf,
    coherence_rows,
    items_of,
    measured_rows,
    pair_labels,
)
from bayes_placement.explorer.steps import as_drawn
from tests.criticism import small
from tests.wrong_calls import LINES, structure


def driven():
    """Two sensors at two force levels, where the response depends on the force."""
    return bp.Experiment(
        structure() + bp.effects.cubic_stiffness(0.4, dist.LogUniform(1e8, 1e12)),
        sensors=[bp.Sensor("s1", at=0.2), bp.Sensor("s2", at=0.7)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=LINES,
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(1e-5),
        force_levels=[0.1, 1.0],
    )


def test_rows_are_those_of_their_sensor_actuator_and_level():
    experiment = driven()
    measured = experiment.nominal_measurement()
    data = experiment.data(measured)
    response = ResponseOf(experiment, data)(as_drawn(experiment))
    labels = [(pair["sensor"], pair["level"]) for pair in pair_labels(experiment)]
    assert labels == [("s1+x", 0.1), ("s1+x", 1.0), ("s2+x", 0.1), ("s2+x", 1.0)]
    second = measured[1].frf[1, 0]  # of s2 at 1 N
    np.testing.assert_allclose(response.predicted[3], [second.real, second.imag], rtol=1e-6)
    np.testing.assert_allclose(measured_rows(experiment, data)[3], response.predicted[3], rtol=1e-6)
    assert response.chi2 == pytest.approx(0.0, abs=1e-6)


def test_errors_are_those_of_criticism_and_bands_are_parts_of_them():
    experiment, measurement = small.experiment(), small.measured(bp.effects.point_mass(0.3, 0.5))
    gone = measurement.frf.copy()
    gone[1] = np.nan  # s2 was not measured
    measurement = dataclasses.replace(measurement, frf=gone, coherence=None, variance=None)
    noisy = bp.noise.Gaussian(0.01)
    experiment = bp.Experiment(
        experiment.structure,
        sensors=[*experiment.sensor.values()],
        actuators=[*experiment.actuator.values()],
        frequency=small.LINES,
        observe=experiment.observe,
        noise=noisy,
    )
    values = as_drawn(experiment)
    response = ResponseOf(experiment, experiment.data(measurement))(values)
    known = outputs_at(experiment, measurement, values)
    squares = ((known.measured - known.predicted) ** 2 / known.variance)[known.present]
    assert response.chi2 == pytest.approx(squares.mean())
    assert response.chi2_of_pairs[0] == pytest.approx(squares.mean())
    assert np.isnan(response.chi2_of_pairs[1]) and np.isnan(response.error[1]).all()
    bands = response.chi2_of_bands()
    sizes = [part.size for part in np.array_split(small.LINES, bands.shape[1])]
    assert np.average(bands[0], weights=sizes) == pytest.approx(squares.mean())
    assert coherence_rows(experiment, measurement) is None


def test_places_are_those_of_the_values_and_coherence_is_by_pair():
    experiment = small.experiment() + bp.effects.point_mass(dist.Uniform(0.0, 1.0), 0.5)
    measurement = small.measured()
    values = {**as_drawn(experiment), "structure.effects.point_mass.at": 0.7}
    response = ResponseOf(experiment, experiment.data(measurement))(values)
    places = dict(zip(items_of(experiment), response.places[:, 0], strict=True))
    assert places["effect", "point_mass"] == 0.7 and places["actuator", "a1"] == 0.4
    assert coherence_rows(experiment, measurement).shape == (2, small.LINES.size)
