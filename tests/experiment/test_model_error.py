"""Model error: the identity at zero, the law of each error, and what is refused."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import pytest
from numpyro.infer.util import log_density

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.sites import Role
from bayes_placement.experiment.variants import with_more_sensors
from tests.criticism.small import LINES, TRUTH, experiment, measured
from tests.simulator.fine_elements import Line
from tests.simulator.hidden_structures import Instrument, accelerance

SIZES = {
    "model_error.frequency.size": 0.01,
    "model_error.damping.size": 0.2,
    "model_error.shape.size": 0.05,
    "model_error.gain.size": 0.02,
}


@pytest.fixture(scope="module")
def erroneous():
    modal = bp.model_error.Embedded(stiffness_and_mass=None)
    return experiment().fix(TRUTH).with_model_error(modal).fix(SIZES)


def errors(erroneous, seed=None):
    """Standard errors of all modes and channels: zero, or drawn."""
    random = np.random.default_rng(seed)
    return {
        unknown.name: random.standard_normal(unknown.distribution.shape()) * (seed is not None)
        for unknown in erroneous.unknowns
    }


def frf(concrete):
    return np.asarray(compiled(bp.Experiment.frf)(concrete))


def test_errors_of_zero_are_the_exact_model(erroneous):
    exact = frf(experiment().fix(TRUTH))
    np.testing.assert_allclose(frf(erroneous.fix(errors(erroneous))), exact, rtol=1e-13)


def modal(natural, ratio, omega):
    """Receptance of modes of unit shape [mode, line]."""
    squares = natural[:, None] ** 2 - omega**2
    return 1 / (squares + 2j * ratio[:, None] * natural[:, None] * omega)


def test_the_response_is_the_modal_sum_of_the_erroneous_modes(erroneous):
    """In plain NumPy; modes beyond those that are kept stay as they are."""
    values = errors(erroneous, seed=3)
    concrete = erroneous.fix(values)
    modes, count = concrete.structure.proper_modes(), concrete.model_error.modes
    omega = 2 * np.pi * np.asarray(concrete.frequency)
    natural = np.array(modes.angular_frequency())
    ratio = np.full(natural.size, TRUTH["structure.damping.ratio"])

    def side(name, with_errors):
        rows = []
        for key, item in concrete.instruments.side(name).items():
            row = np.array(item.shapes(modes))[0]
            standard = values[f"model_error.shape.standard.{name}.{key}"][0]
            row[:count] += with_errors * 0.05 * concrete.model_error.rms_shape * standard
            rows.append(row)
        return np.array(rows)

    def gains(name):
        return np.array(
            [
                1 + 0.02 * values[f"model_error.gain.standard.{name}.{key}"][0]
                for key in concrete.instruments.side(name)
            ]
        )

    exact_factors = [side("sensor", False), side("actuator", False), modal(natural, ratio, omega)]
    exact = frf(experiment().fix(TRUTH)) / -(omega**2)
    left_out = exact - np.einsum("sr,ar,rf->saf", *exact_factors)
    natural[:count] *= np.exp(0.01 * values["model_error.frequency.standard"])
    damping = np.exp(0.2 * values["model_error.damping.standard"])
    ratio[: damping.size] *= damping
    shifted = [side("sensor", True), side("actuator", True), modal(natural, ratio, omega)]
    factors = np.multiply.outer(gains("sensor"), gains("actuator"))[..., None]
    expected = factors * (np.einsum("sr,ar,rf->saf", *shifted) + left_out)
    np.testing.assert_allclose(frf(concrete) / -(omega**2), expected, rtol=1e-9)


def test_the_unit_of_shapes_is_their_root_mean_square(erroneous):
    assert erroneous.model_error.rms_shape == pytest.approx(9.0**-0.5, rel=0.05)  # a bar of 9 kg


def test_modes_above_the_band_are_exact(erroneous):
    natural = np.asarray(erroneous.structure.modes.natural_frequency)
    count = erroneous.model_error.modes
    assert natural[count - 1] < 1.3 * 700.0 <= natural[count]
    damped = erroneous.model_error.damping.standard.shape()[0]
    assert damped == np.sum(natural < 3.0 * 700.0) > count


def test_pieces_show_what_differs_along_the_highest_mode():
    # Between its nodes and its crests the energy is the same in all pieces: they must be shorter.
    values = {"length": 1.0, "area": 1e-3, "youngs_modulus": 1e9, "density": 9e3}
    bar = bp.beams.bar(24, **values, ends="fixed-fixed")
    setup = bp.Experiment(
        bp.Structure(bar, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=0.4)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )
    errors = setup.with_model_error(bp.model_error.Embedded()).model_error
    highest = errors.modes - 1
    shares = errors.stiffness_and_mass.shares.stiffness[:, highest, highest]
    assert np.sum(shares) == pytest.approx(1.0) and np.ptp(shares) > 0.5 * np.mean(shares)


def test_every_leaf_is_an_unknown_of_the_model_with_its_density():
    with_errors = experiment().with_model_error(bp.model_error.Embedded())
    rows = [unknown for unknown in with_errors.unknowns if unknown.role is Role.MODEL_ERROR]
    kinds = {"frequency", "damping", "shape", "gain", "stiffness_and_mass"}
    assert {unknown.owner.kind for unknown in rows} == kinds
    table = str(with_errors)
    assert all(f"model_error.{kind}.size" in table for kind in kinds)
    standard = sum(int(np.prod(row.distribution.shape())) for row in rows) - len(kinds)
    assert table.count("standard") == 1 and f"{standard} Normal(0, 1)" in table
    values = {
        unknown.name: numpyro.distributions.biject_to(unknown.distribution.support)(
            jnp.full(unknown.distribution.shape(), 0.3)
        )
        for unknown in with_errors.unknowns
    }
    exact = {name: value for name, value in values.items() if not name.startswith("model_error")}

    data = measured()

    @jax.jit
    def densities(values, exact):
        erroneous, _ = log_density(with_errors.model, (data,), {}, values)
        return erroneous, log_density(experiment().model, (data,), {}, exact)[0]

    density, without = densities(values, exact)
    assert np.isfinite(density) and density != pytest.approx(float(without))


def test_a_size_of_none_leaves_no_unknowns():
    absent = dict.fromkeys(("damping", "shape", "gain", "stiffness_and_mass"))
    only = bp.model_error.Embedded(**absent)
    with_errors = experiment().with_model_error(only)
    kinds = {u.owner.kind for u in with_errors.unknowns if u.role is Role.MODEL_ERROR}
    assert kinds == {"frequency"}
    exact = [unknown.name for unknown in with_errors.with_model_error(None).unknowns]
    assert exact == [unknown.name for unknown in experiment().unknowns]


@pytest.mark.parametrize("size", [0.0, -0.1, np.inf])
def test_a_size_that_is_not_positive_is_refused(size):
    with pytest.raises(ValueError, match=r"positive|one finite number or a distribution"):
        bp.model_error.Embedded(frequency=size)


def test_uneven_stiffness_is_that_of_finite_elements():
    """A bar of pieces of other stiffness; 24 kept modes span its modes to some 1e-4."""
    size, count = 0.04, 12
    standard = np.random.default_rng(4).standard_normal(count)
    others = dict.fromkeys(("frequency", "damping", "shape", "gain"))
    modes = bp.beams.bar(24, length=1.0, area=1e-3, youngs_modulus=1.02e9, density=9000.0)
    even = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.035)),
        sensors=[bp.Sensor("s1", at=0.237), bp.Sensor("s2", at=0.618)],
        actuators=[bp.Actuator("a1", at=0.411)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=None,
        model_error=bp.model_error.Embedded(**others, stiffness_and_mass=size, pieces=count),
    )
    of_pieces = {"stiffness": standard, "mass": np.zeros(count)}
    uneven = even.fix(
        {f"model_error.stiffness_and_mass.standard.{k}": v for k, v in of_pieces.items()}
    )
    bar = Line("bar", "fixed-fixed", 1.0, 1e-3, 1.02e9, 9000.0, 0.035)
    places = {
        item.name: float(item.position) for item in [*even.sensor.values(), *even.actuator.values()]
    }
    s1, s2, a1 = (Instrument(name, at, 0.0, 1, at) for name, at in places.items())
    expected, without = (
        accelerance(replace(bar, pieces=tuple(factors)), [s1, s2], [a1], LINES)
        for factors in (np.exp(size * standard), np.ones(count))
    )
    error = np.abs(frf(uneven) - expected)
    assert np.sum(error**2) < 1e-3 * np.sum(np.abs(expected - without) ** 2)


def test_a_piece_is_needed():
    with pytest.raises(ValueError, match="pieces=0"):
        bp.model_error.Embedded(pieces=0)


def test_a_transducer_that_the_errors_do_not_know_is_named(erroneous):
    extended = with_more_sensors(
        experiment().fix(TRUTH).with_model_error(bp.model_error.Embedded()), 1
    )
    concrete = extended.fix(extended.nominal_values())
    with pytest.raises(ValueError, match="with_model_error"):
        concrete.frf()


def test_what_is_attached_feels_the_errors_of_the_shapes_at_its_place(erroneous):
    """A mass at a sensor that reads the erroneous shapes: by the formula of one attachment."""
    mass = 0.4
    loaded = erroneous + bp.effects.point_mass(TRUTH["sensor.s1.position"], mass)
    values = errors(loaded, seed=5)
    port = "model_error.ports.point_mass"
    values[port] = values["model_error.shape.standard.sensor.s1"]
    gains = {name: 0 * value for name, value in values.items() if ".gain." in name}
    without = frf(erroneous.fix({k: v for k, v in (values | gains).items() if k != port}))
    omega = 2 * np.pi * np.asarray(loaded.frequency)
    reads, drives = frf_between(erroneous, values | gains, port)
    share = -(omega**2) * mass / (1 - omega**2 * mass * reads)
    expected = without[0, 0] / -(omega**2) - reads * share * drives
    np.testing.assert_allclose(
        frf(loaded.fix(values | gains))[0, 0] / -(omega**2), expected, rtol=1e-9
    )


def frf_between(erroneous, values, port):
    """Receptance [m/N] of the first sensor with itself, and with the actuator."""
    known = {name: value for name, value in values.items() if name != port}
    concrete = erroneous.fix(known)
    twin = bp.Experiment(
        concrete.structure,
        sensors=[concrete.sensor["s1"]],
        actuators=[bp.Actuator("a1", at=TRUTH["sensor.s1.position"])],
        frequency=concrete.frequency,
        observe=concrete.observe,
        noise=None,
        model_error=bp.model_error.Embedded(
            **{n.split(".")[1]: v for n, v in SIZES.items()}, stiffness_and_mass=None
        ),
    )
    side = "model_error.shape.standard"
    known_values = {
        u.name: known.get(u.name, 0.0 * np.zeros(u.distribution.shape())) for u in twin.unknowns
    }
    known_values[f"{side}.actuator.a1"] = known[f"{side}.sensor.s1"]
    omega = 2 * np.pi * np.asarray(concrete.frequency)
    itself = frf(twin.fix(known_values))[0, 0] / -(omega**2)
    return itself, frf(concrete)[0, 0] / -(omega**2)


def test_in_the_run_of_each_actuator_the_modes_have_frequencies_of_their_own():
    """Each column is that of a structure whose natural frequencies differ by what its run adds."""
    erroneous = bp.Experiment(
        experiment().fix(TRUTH).structure,
        sensors=[bp.Sensor("s1", at=0.237)],
        actuators=[bp.Actuator("a1", at=0.411), bp.Actuator("a2", at=0.61)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=None,
        model_error=bp.model_error.Embedded(
            frequency=0.01, damping=None, shape=0.05, gain=None, stiffness_and_mass=None, runs=0.003
        ),
    )
    random = np.random.default_rng(5)
    values = {
        unknown.name: random.standard_normal(unknown.distribution.shape())
        for unknown in erroneous.unknowns
    }
    response = frf(erroneous.fix(values))
    for column, name in enumerate(erroneous.actuator):
        own_run = (
            values["model_error.frequency.standard"]
            + 0.3 * values[f"model_error.runs.standard.{name}"]
        )
        no_run = {key: np.zeros_like(value) for key, value in values.items() if ".runs." in key}
        alone = erroneous.fix(values | no_run | {"model_error.frequency.standard": own_run})
        np.testing.assert_allclose(response[:, column], frf(alone)[:, column], rtol=1e-9)
