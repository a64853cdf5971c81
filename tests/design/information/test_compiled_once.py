"""Maps of one form: other numbers and another key compile nothing, and change no estimate."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design.running import chunks as chunking
from models import bar
from tests.design import small_maps

COMPILING = "/jax/core/compile/backend_compile_duration"
PLACES = [0.3, 0.45, 0.7]
KEY = jax.random.key(7)  # whose own compilation is not counted


@pytest.fixture
def compilations():
    """Grows by one whenever something is compiled, or read from the cache of what was."""
    durations = []

    def listen(event, duration, **_):
        if event == COMPILING:
            durations.append(duration)

    jax.monitoring.register_event_duration_secs_listener(listen)
    yield durations
    jax.monitoring.unregister_event_duration_listener(listen)


def with_ratio(low, noise=None):
    """The bar with one unknown ratio: all modes are known."""
    return bar.placed(0.3, 0.55, noise, structure=bar.bar(dist.Uniform(low, 0.06), 0.05))


def with_masses(low, noise=None):
    """The bar with two unknown masses, whose names are in no alphabetical order."""
    structure = bar.bar(0.04, 0.05)
    for name, at in (("late", 0.4), ("early", 0.75)):
        structure = structure + bp.effects.point_mass(at=at, mass=dist.Uniform(low, 1.0), name=name)
    return bar.placed(0.3, 0.55, noise, structure=structure)


def separation(low):
    random = np.random.default_rng(0)
    plain, heavy = with_ratio(low, NOISE), with_ratio(low, NOISE)
    heavy = heavy + bp.effects.point_mass(at=0.4, mass=dist.Uniform(low, 1.0))
    draws = {
        "structure.damping.ratio.1": random.uniform(low, 0.06, 64),
        "actuator.a1.position": random.uniform(0.53, 0.57, 64),
    }
    more = draws | {"structure.effects.point_mass.mass": random.uniform(0.1, 1.0, 64)}
    return information.Separation(
        (
            information.Alternative("plain", 0.4 + low, plain, draws),
            information.Alternative("heavy", 0.5, heavy, more),
        ),
        draws=8,
        data_draws=8,
    )


NOISE = bp.noise.Gaussian(0.02)
ESTIMATES = {
    "KDE where modes are known": (
        with_ratio,
        lambda low: information.KernelGain(draws=32, placement_draws=16),
    ),
    "KDE": (with_masses, lambda low: information.KernelGain(draws=32, placement_draws=16)),
    "Exact": (
        lambda low: with_masses(low, bp.noise.Gaussian(low)),
        lambda low: information.Exact(draws=32, nodes=4),
    ),
    "ExpectedGain": (
        lambda low: with_masses(low, bp.noise.Gaussian(10 * low)),
        lambda low: information.ExpectedGain(draws=8, placement_draws=4, data_draws=8),
    ),
    "Separation": (lambda low: with_ratio(low, bp.noise.Gaussian(low)), separation),
}


def long(*names, further=()):
    return [pytest.param(name, marks=[pytest.mark.long, *further]) for name in names]


@pytest.mark.parametrize("name", ["KDE", *long("Exact", "ExpectedGain", "Separation")])
def test_other_numbers_and_another_key_compile_nothing(name, compilations):
    experiment, estimator = ESTIMATES[name]

    def learnt(low, key):
        places = {"s1": np.add(PLACES, low)}
        dataset = bp.information_map(experiment(low), places, estimator=estimator(low), key=key)
        return dataset["information_gain"].values

    first = learnt(0.02, 0)
    assert compilations
    compilations.clear()
    np.testing.assert_array_equal(learnt(0.02, 0), first)
    for low, key in ((0.02, 1), (0.025, 0), (0.03, KEY)):
        assert np.all(learnt(low, key) != first)
    assert not compilations


@pytest.mark.parametrize(
    "name",
    long("KDE", "Separation")
    + long("KDE where modes are known", "Exact", "ExpectedGain", further=[pytest.mark.longest]),
)
def test_inputs_of_what_is_compiled_keep_their_order(name):
    """The estimate of one cell beside the same where all numbers are constants."""
    experiment, estimator = (of(0.02) for of in ESTIMATES[name])
    plan = estimator.plan(experiment, 5, ("s1",))
    gain = jax.jit(lambda: plan(experiment, experiment.nominal_values()))()
    place = bp.positions.Segment(0.3, within=0.04)
    learnt = bp.information_map(experiment, {"s1": [place]}, estimator=estimator, key=5)
    assert float(learnt["information_gain"][0]) == pytest.approx(float(gain.estimate), rel=1e-5)
    assert float(gain.estimate) > 0.01


def test_a_worker_compiles_once_for_tasks_of_one_form(compilations):
    for chunk in small_maps.chunks()[:2]:
        chunking.compute_packed(chunk.packed())
    places = {name: at + 0.01 for name, at in small_maps.PLACES.items()}
    other = small_maps.chunks(seed=1, places=places)[0].packed()
    compilations.clear()
    chunking.compute_packed(other)
    assert not compilations
