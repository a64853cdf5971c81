"""Modal parameters as data: poles, pairs, the scale of shapes, and what is inferred from them."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro.infer.util import log_density
from scipy.stats import multivariate_normal

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InfeasibleError, InputError
from tests.experiment.modal_bars import MODULUS, experiment, measured, poles, unknown_modulus

PLACES = [0.12, 0.3, 0.41, 0.77]
PREDICT = compiled(bp.Experiment.predict)


@pytest.fixture(scope="module")
def damped():
    """Modal parameters without errors of a bar with a mass and a dashpot, and the experiment."""
    structure = {"mass_at": 0.35, "mass": 0.6, "dashpot_at": 0.6, "dashpot": 300.0}
    measurement = measured(PLACES, 5, ratio=0.02, **structure)
    loaded = experiment(measurement, PLACES, ratio=0.02)
    loaded += bp.effects.point_mass(0.35, 0.6)
    return loaded + bp.effects.ground_dashpot(0.6, 300.0), measurement


def test_poles_and_shapes_are_those_of_finite_elements(damped):
    loaded, measurement = damped
    predicted = np.asarray(PREDICT(loaded))[:, 0]
    # 200 elements in the place of 100 change frequencies by 5e-5: half of the error of 100.
    np.testing.assert_allclose(predicted[0], measurement.natural_frequency, rtol=1.2e-4)
    np.testing.assert_allclose(predicted[1], measurement.damping_ratio, rtol=1e-3)
    assert np.ptp(measurement.damping_ratio) > 0.01
    np.testing.assert_allclose(predicted[2:], measurement.shape, atol=5e-3)


def test_a_mode_at_another_frequency_has_the_damping_ratio_of_the_law():
    measurement = measured(PLACES, 5, ratio=0.02)
    off = bp.model_error.Embedded(
        frequency=0.05, damping=None, shape=None, gain=None, stiffness_and_mass=None
    )
    model = experiment(measurement, PLACES, ratio=0.02).with_model_error(off)
    (errors,) = (unknown.name for unknown in model.unknowns)
    predicted = np.asarray(PREDICT(model.fix({errors: np.array([1.0, -1.0, 2.0, 0.5, -2.0])})))
    factor = np.exp(0.05 * np.array([1.0, -1.0, 2.0, 0.5, -2.0]))
    np.testing.assert_allclose(predicted[0, 0], factor * measurement.natural_frequency, rtol=1e-3)
    np.testing.assert_allclose(predicted[1, 0], 0.02, rtol=1e-6)


@pytest.mark.long
@pytest.mark.longest
def test_gradients_of_poles_are_those_of_finite_differences(damped):
    loaded, _ = damped

    loaded = loaded.without("point_mass") + bp.effects.point_mass(0.35, dist.Uniform(0.0, 1.0))
    (name,) = (unknown.name for unknown in loaded.unknowns)
    slope = jax.jit(jax.jacfwd(lambda mass: loaded.fix({name: mass}).predict()))(0.6)
    value = jax.jit(lambda mass: loaded.fix({name: mass}).predict())
    np.testing.assert_allclose(
        slope, (value(0.6 + 1e-5) - value(0.6 - 1e-5)) / 2e-5, rtol=1e-4, atol=1e-4
    )


def test_modes_are_paired_by_shape_where_some_were_missed():
    everything = measured(PLACES, 6, ratio=0.01)
    some = everything.modes([1, 2, 5])
    stiffer = experiment(some, PLACES, modulus=1.3 * MODULUS)
    predicted = np.asarray(PREDICT(stiffer))[0, 0]
    np.testing.assert_allclose(predicted / np.sqrt(1.3), some.natural_frequency, rtol=1e-5)


def test_numbers_tell_which_modes_were_measured():
    natural = poles(4)[0]
    some = bp.ModalParameters(natural[[1, 3]], 1e-3 * natural[[1, 3]], number=[2, 4])
    predicted = np.asarray(PREDICT(experiment(some, [], modulus=2 * MODULUS)))
    np.testing.assert_allclose(predicted[0, 0], np.sqrt(2) * natural[[1, 3]], rtol=1e-5)


def test_residuals_are_those_of_a_least_squares_fit_of_the_scale():
    """With correlated errors; the sum of squares is that of generalised least squares."""
    rng = np.random.default_rng(2)
    exact = measured(PLACES, 2, ratio=0.01, shape=0.1)
    factor = rng.standard_normal((2, 6, 6)) * 0.5 + 2 * np.eye(6)
    deviation = exact.deviation.T
    covariance = (factor @ factor.transpose(0, 2, 1)) * deviation[:, :, None] * deviation[:, None]
    shape = -7.0 * exact.shape + rng.standard_normal((4, 2))
    correlated = bp.ModalParameters(
        exact.natural_frequency + 0.1,
        damping_ratio=exact.damping_ratio + 1e-4,
        shape=shape,
        sensors=exact.sensors,
        covariance=covariance,
    )
    fitted = experiment(correlated, PLACES)
    data = fitted.data(correlated)
    error = np.where(data.measured, np.asarray(data.z) - PREDICT(fitted), 0.0)[:, 0]
    squares = np.sum((error / correlated.deviation) ** 2, axis=0)
    for mode in range(2):
        offset = np.r_[0.1, 1e-4, shape[:, mode]]
        direction = np.r_[0, 0, exact.shape[:, mode]]
        weight = np.linalg.inv(covariance[mode])
        least = offset @ weight @ offset
        least -= (direction @ weight @ offset) ** 2 / (direction @ weight @ direction)
        np.testing.assert_allclose(squares[mode], least, rtol=1e-3)
    assert np.asarray(data.measured).sum() == 2 * 5


def test_repeats_give_the_gaussian_density_of_their_covariance():
    """Frequencies of a bar in proportion to the root of its modulus, closed form."""
    natural = poles(3)[0]
    drawn = np.random.default_rng(4).standard_normal((12, 4)) @ np.c_[np.eye(4)[:, 1:], np.ones(4)]
    repeats = natural * (1 + 1e-3 * drawn[:, :3] + 1e-3 * drawn[:, 3:])
    ratio = 0.01 + 1e-4 * np.random.default_rng(5).standard_normal((12, 3))
    modes = bp.ModalParameters.from_repeats(repeats, ratio, number=[1, 2, 3])
    covariance = np.cov(repeats, rowvar=False) / 12
    stated = np.outer(modes.deviation[0], modes.deviation[0]) * modes.correlation
    np.testing.assert_allclose(stated, covariance, rtol=1e-12)
    one = bp.ModalParameters.from_repeats(repeats, of_one=True, number=[1, 2, 3])
    np.testing.assert_allclose(one.deviation[0], np.sqrt(12) * modes.deviation[0])
    declared = experiment(modes, [], ratio=dist.Uniform(0.0, 0.02), modulus=unknown_modulus())
    names = ("structure.modes.youngs_modulus", "structure.damping.ratio")
    stiffened = (1.0, 1.004)

    @jax.jit
    def density(*values):
        return log_density(declared.model, (modes,), {}, dict(zip(names, values, strict=True)))[0]

    densities = [density(MODULUS * factor, 0.01) for factor in stiffened]
    exact = [
        multivariate_normal(modes.natural_frequency, covariance).logpdf(natural * np.sqrt(factor))
        for factor in stiffened
    ]
    np.testing.assert_allclose(np.diff(densities), np.diff(exact), rtol=2e-3)
    chosen = experiment(modes.modes([0, 2]), [])
    np.testing.assert_allclose(chosen.observe.correlation[0, 1], modes.correlation[0, 2])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"natural_frequency": [160.0, 330.0]}, "finite numbers of shape"),
        ({"natural_frequency": np.ones((3, 2))}, "3 repeats of 2 modes were given; 4 or more"),
        (
            {"natural_frequency": np.ones((6, 2)), "damping_ratio": np.ones((6, 1))},
            "damping_ratio=.* was given, of shape",
        ),
    ],
)
def test_repeats_that_do_not_tell_errors_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        bp.ModalParameters.from_repeats(**arguments)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"correlation": [[1.0, 1.0], [1.0, 1.0]]}, "positive definite matrix"),
        (
            {
                "correlation": [[1.0, 0.5], [0.5, 1.0]],
                "covariance": np.array([[1.0, 0.01], [0.01, 1.0]]) * np.ones((2, 1, 1)),
                "damping_ratio": [0.01, 0.01],
            },
            "Leave out correlation=",
        ),
    ],
)
def test_correlations_that_are_none_are_refused(changes, words):
    deviation = None if "covariance" in changes else [1.0, 1.0]
    with pytest.raises(InputError, match=words):
        bp.ModalParameters([160.0, 330.0], deviation, **changes)


@pytest.mark.long
def test_modulus_from_natural_frequencies_alone_is_that_of_the_linear_model():
    """f is in proportion to the root of the modulus, with small errors; two engines."""
    natural = poles(4)[0]
    drawn = natural * (1 + 2e-3 * np.random.default_rng(0).standard_normal(4))
    alone = bp.ModalParameters(drawn, 2e-3 * natural, number=range(1, 5))
    setup = experiment(alone, [], modulus=unknown_modulus())
    posterior = bp.infer(setup, alone, engine="map")
    modulus = posterior["posterior"]["structure.modes.youngs_modulus"].values.ravel()
    deviation = 2 * MODULUS / np.sqrt(np.sum((natural / (2e-3 * natural)) ** 2))
    mean = MODULUS * (1 + 2 * np.mean(drawn / natural - 1))
    assert abs(modulus.mean() - mean) < 5 * deviation / np.sqrt(modulus.size)
    np.testing.assert_allclose(modulus.std(), deviation, rtol=0.1)
    checked = bp.check(posterior)
    np.testing.assert_allclose(float(checked.overall["expected"]), 3 / 4, rtol=0.1)
    assert "mode 166.7 Hz" in str(checked)


@pytest.mark.long
@pytest.mark.longest
def test_a_sensor_is_placed_by_shapes_alone():
    rng = np.random.default_rng(3)
    true = [0.12, 0.3, 0.42, 0.77]
    measurement = measured(true, 4, noise=rng, ratio=0.01)
    setup = experiment(measurement, [0.15, 0.3, 0.4, 0.75], within=0.04, modes=8)
    posterior = bp.infer(setup, measurement, engine="map")["posterior"]
    for number, place in enumerate(true):
        drawn = posterior[f"sensor.s{number}.position"].values
        assert drawn.std() < 0.008
        assert abs(drawn.mean() - place) < 5 * drawn.std()


def test_simulations_have_the_errors_that_are_stated():
    measurement = measured(PLACES, 4, ratio=0.01)
    drawn = bp.simulate(experiment(measurement, PLACES), draws=400, key=1)["prior_predictive"]
    error = (drawn["measured"] - drawn["response"]).values[0, :, :, 0]
    np.testing.assert_allclose(error.std(axis=0), measurement.deviation, rtol=0.25)
    assert drawn["measured"].sensor.values[:3].tolist() == [
        "natural frequency",
        "damping ratio",
        "s0+x",
    ]


def test_effects_that_modes_do_not_show_are_refused_and_not_tried():
    measurement = measured(PLACES, 3, ratio=0.01)
    setup = experiment(measurement, PLACES)
    with pytest.raises(InputError, match="observes modes; FRFs are needed to see it"):
        _ = setup + bp.effects.time_delay(1e-5)
    kinds = bp.effects.library(setup).kinds
    assert {"point_mass", "gain_error", "swapped_sensors"} <= set(kinds)
    assert not {"time_delay", "actuator_mass", "residual_modes"} & set(kinds)


def test_what_needs_frfs_says_so():
    measurement = measured(PLACES, 3, ratio=0.01)
    setup = experiment(measurement, PLACES)
    with pytest.raises(InfeasibleError, match="FRFs are needed for it, with lines and actuators"):
        setup.frf()
    with pytest.raises(InputError, match=r"Other modal parameters were given than those of"):
        setup.data(measurement.modes([0, 1]))
    with pytest.raises(InputError, match="has 2 elastic modes; as many are needed"):
        structure = bp.Structure(
            bp.beams.bar(2, length=1.0, area=1e-3, youngs_modulus=1e9, density=9e3),
            damping=bp.damping.Modal(0.01),
        )
        bp.Experiment(
            structure,
            sensors=[bp.Sensor(f"s{n}", at=at) for n, at in enumerate(PLACES)],
            observe=bp.observe.ModalData(measurement),
            noise=bp.noise.FromVariance(),
        ).predict()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"actuators": [bp.Actuator("a1", at=0.3)]}, "actuators= was given with observe.ModalData"),
        ({"frequency": [100.0]}, "frequency= was given with observe.ModalData"),
        ({"noise": bp.noise.Gaussian(0.1)}, "noise.FromVariance of a known scale is needed"),
        ({"force_levels": [1.0]}, "force_levels= was given with observe.ModalData"),
    ],
)
def test_what_modes_do_not_need_is_refused(changes, words):
    natural = poles(2)[0]
    setup = experiment(bp.ModalParameters(natural, 1e-3 * natural, number=[1, 2]), [])
    arguments = {"sensors": [], "observe": setup.observe, "noise": setup.noise} | changes
    with pytest.raises(InputError, match=words):
        bp.Experiment(setup.structure, **arguments)


@pytest.mark.long
@pytest.mark.longest
def test_a_hidden_mass_is_named_and_the_check_fails_without_it():
    rng = np.random.default_rng(1)
    true = [0.1, 0.22, 0.41, 0.58, 0.83]
    measurement = measured(true, 6, noise=rng, ratio=0.01, mass_at=0.35, mass=0.6)
    recorded = np.array(true) + rng.uniform(-0.01, 0.01, 5)
    setup = experiment(
        measurement,
        recorded,
        modulus=unknown_modulus(),
        ratio=dist.Uniform(0.005, 0.02),
        within=0.015,
        modes=12,
    )
    candidates = bp.effects.library(setup, ["point_mass", "ground_spring", "gain_error"])
    ledger = bp.improve(setup, measurement, candidates=candidates)
    assert ledger.verdict == ("point_mass",)
    assert ledger.steps[0].chi2_per_datum > 20
    assert ledger.steps[-1].chi2_per_datum < 1.7
    added = ledger.steps[-1].parameters_of_added().values()
    values = {estimate.word: estimate for estimate in added}
    assert values["mass"].low < 0.6 < values["mass"].high
    assert values["at"].low < 0.35 < values["at"].high
