"""What a run leaves for its report, against what the experiment itself says."""

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.criticism.findings._places import FEWEST_LINES, outline_of
from bayes_placement.criticism.findings.findings import Model, findings
from bayes_placement.modes.finite_elements.outline import outline as outline_drawn
from tests.criticism import small
from tests.effects import models_in_space
from tests.in_space import Linear

VALUES = dict(small.TRUTH)


def without_noise(experiment):
    """Return the experiment without an output error."""
    return eqx.tree_at(lambda tree: tree.noise, experiment, None)


def found(experiment, measurement, values, draws=None):
    model = Model("as given", experiment, values)
    return findings([model], draws or {}, measurement, {"command": "improve"})


@pytest.fixture(scope="module")
def measured():
    return small.measured(small.MASS)


@pytest.fixture(scope="module")
def tree(measured):
    experiment = small.experiment()
    random = np.random.default_rng(0)
    draws = {name: random.normal(value, 1e-3, 50) for name, value in VALUES.items()}
    return found(experiment, measured, VALUES, draws)


def test_outputs_are_those_of_the_experiment(tree, measured):
    experiment = small.experiment().fix(VALUES)
    frf = np.asarray(compiled(bp.Experiment.frf)(experiment))
    fit = tree["fit_0"].to_dataset()
    predicted = 10 ** fit["predicted"].values * np.exp(
        1j * np.radians(fit["predicted_phase"].values)
    )
    assert np.allclose(predicted, frf, rtol=1e-12)
    of_data = 10 ** fit["measured"].values * np.exp(1j * np.radians(fit["measured_phase"].values))
    assert np.allclose(of_data, measured.frf, rtol=1e-12)
    assert np.allclose(fit["error"], np.abs(frf - measured.frf), rtol=1e-9)
    assert not fit["model_error"].any()


def test_draws_are_kept_with_their_priors(tree):
    posterior, prior = tree["posterior"].to_dataset(), tree["prior"].to_dataset()
    assert set(posterior) == set(prior) == set(VALUES)
    assert posterior["sensor.s1.position"].attrs["units"] == "m"
    ratio = prior["structure.damping.ratio"].values
    assert 0.02 <= ratio.min() < 0.022
    assert 0.058 < ratio.max() <= 0.06


def test_places_are_recorded_and_inferred(tree):
    places = tree["places"].to_dataset()
    assert list(places["item"].values) == ["s1", "s2", "a1"]
    assert list(places["recorded"].sel(axis="x").values) == [0.24, 0.61, 0.40]
    drawn = tree["posterior"].to_dataset()["sensor.s2.position"].values[0]
    at = places["posterior"].sel(item="s2", axis="x").values
    assert set(np.round(at, 12)) == set(np.round(drawn, 12))
    prior = places["prior"].sel(item="s2", axis="x").values
    assert 0.59 <= prior.min() < 0.592
    assert not places["posterior"].sel(axis=["y", "z"]).any()


def test_the_model_error_is_in_proportion_where_gains_err(measured):
    sized = {"frequency": None, "damping": None, "shape": None, "stiffness_and_mass": None}
    error = bp.model_error.Embedded(gain=0.05, **sized)
    experiment = small.experiment().with_model_error(error)
    exact = {
        unknown.name: np.zeros(unknown.distribution.shape())
        for unknown in experiment.unknowns
        if unknown.name not in VALUES
    }
    elements = {
        f"{name}[{number}]": 0.0 for name, value in exact.items() for number in range(value.size)
    }
    fit = found(experiment, measured, VALUES | elements)["fit_0"].to_dataset()
    ratio = fit["model_error"].values / 10 ** fit["predicted"].values
    assert np.allclose(ratio, ratio[..., :1], rtol=1e-9)  # the same at all lines
    # A root mean square of 48 draws, of the gains of a sensor and of an actuator.
    assert np.allclose(ratio, 0.05 * np.sqrt(2), rtol=5 / np.sqrt(2 * 48))


def test_angles_turn_a_direction_by_what_they_say():
    tilt = 0.1
    experiment = bp.Experiment(
        bp.Structure(Linear(), damping=bp.damping.Modal(0.02)),
        sensors=[
            bp.Sensor(
                "s1",
                at=(0.2, 0.3, 0.1),
                directions=(3,),
                angles=(dist.Uniform(-0.2, 0.2), 0.0, 0.0),
            )
        ],
        actuators=[bp.Actuator("a1", at=(0.6, 0.1, 0.5), directions=(1,))],
        frequency=[30.0, 50.0],
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(0.1),
    )
    (name,) = (unknown.name for unknown in experiment.unknowns)
    measurement = experiment.nominal_measurement()
    tree = found(experiment, measurement, {name: tilt}, {name: np.full(20, tilt)})
    places = tree["places"].to_dataset().sel(item="s1")
    assert np.allclose(places["tilt"], np.degrees(tilt))
    assert list(places["direction_recorded"].values) == [0.0, 0.0, 1.0]
    turned = [0.0, -np.sin(tilt), np.cos(tilt)]  # about x, z leans towards -y
    assert np.allclose(places["direction"], turned, atol=1e-12)
    assert np.allclose(places["posterior"], [0.2, 0.3, 0.1])
    other = tree["places"].to_dataset().sel(item="a1")
    assert np.isnan(other["tilt"]).all()


def test_an_effect_at_a_known_place_is_there_without_any_unknown():
    experiment = small.experiment().fix(small.TRUTH) + bp.effects.point_mass(0.7, 0.1)
    measurement = experiment.nominal_measurement()
    tree = found(without_noise(experiment), measurement, {})
    at = tree["places"].to_dataset()["posterior"].sel(item="point_mass", axis="x")
    assert np.allclose(at, 0.7)
    assert "fit_0" not in tree.children


def test_lines_of_a_frame_are_divided_so_that_they_bend():
    scene = models_in_space.frame()
    outline = outline_of(scene.experiment())
    points, lines = outline["point"].values, outline["line"].values
    assert FEWEST_LINES / 2 < len(lines) <= FEWEST_LINES
    ends = points[lines]
    assert len(np.unique(lines)) == len(points)
    total = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    drawn, _ = outline_drawn(scene.modes)
    of_mesh = drawn.reshape(-1, 3, 3)[:, :2]
    assert np.isclose(total, np.linalg.norm(of_mesh[:, 1] - of_mesh[:, 0], axis=1).sum())
