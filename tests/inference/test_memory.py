"""Memory is known before anything is computed, and batches keep it small."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InfeasibleError
from bayes_placement.inference import batches, cross_check
from bayes_placement.inference.infer import InferenceWarning, memory_needed
from models import bar


def test_arrays_count_from_where_they_are_computed_to_their_last_use():
    def chain(x):
        first = x + jnp.zeros((100, 1000))  # 0.8 MB each; two at a time
        second = first * 2
        return jnp.sum(second * 3)

    size = 8 * 100 * 1000
    assert 2 * size <= batches.working_bytes(compiled(chain).bound(), jnp.zeros(1000)) < 2.1 * size


def test_bodies_of_loops_count_once():
    def loop(x):
        return jax.lax.fori_loop(0, 1000, lambda _, y: jnp.sum(jnp.ones((1000, 1000))) + y, x)

    assert 8e6 <= batches.working_bytes(compiled(loop).bound(), jnp.zeros(())) < 2.5e7


def kernel_matrix(x):
    points = jnp.linspace(0.0, 1.0, 700)
    return jnp.sum(jnp.linalg.inv(jnp.exp(-((points[:, None] - points * x) ** 2)) + jnp.eye(700)))


def test_what_is_known_beforehand_bounds_what_the_compiler_needs():
    built = jax.jit(kernel_matrix).lower(jnp.ones(())).compile().memory_analysis()
    known = batches.working_bytes(compiled(kernel_matrix).bound(), jnp.ones(()))
    assert built.temp_size_in_bytes <= 1.2 * known
    assert known < 20 * built.temp_size_in_bytes


def test_batches_are_as_large_as_memory_allows(monkeypatch):
    size = batches.working_bytes(compiled(kernel_matrix).bound(), jnp.ones(()))
    for count, expected in ((3.5, 3), (0.5, 1), (1000, 50)):
        monkeypatch.setattr(batches, "MOST_BYTES", int(count * size))
        assert (
            batches.affordable_batch(compiled(kernel_matrix).bound(), jnp.ones(()), 50) == expected
        )


@pytest.mark.parametrize("batch", [3, 7, 100])
def test_batches_change_no_values(batch):
    x = jnp.linspace(0.0, 1.0, 7)
    values = jax.jit(lambda x: batches.mapped(jnp.sin, x, batch))(x)
    np.testing.assert_allclose(values, np.sin(x), rtol=1e-15)


@pytest.mark.long
@pytest.mark.longest
def test_engines_keep_to_the_memory(monkeypatch):
    engine = bp.engines.SMC(particles=80, populations=2, moves=3)
    results = []
    for most in (1 << 29, 200_000):
        monkeypatch.setattr(batches, "MOST_BYTES", most)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InferenceWarning)  # few particles do not mix
            results.append(bp.infer(bar.experiment, bar.measurement, engine=engine))
    first, second = (result["posterior"]["structure.damping.ratio.1"] for result in results)
    np.testing.assert_allclose(first, second, rtol=1e-6)


def three_by_three():
    """Experiment that quadrature over placements cannot treat."""
    names = ("1", "2", "3")
    return bp.Experiment(
        bar.experiment.structure,
        sensors=[bp.Sensor(f"s{n}", at=bp.positions.Segment(0.3, within=0.04)) for n in names],
        actuators=[bp.Actuator(f"a{n}", at=bp.positions.Segment(0.4, within=0.04)) for n in names],
        frequency=bar.experiment.frequency,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=bp.noise.Gaussian(0.05),
    )


def test_methods_that_cannot_be_done_are_left_out_in_a_sentence():
    experiment = three_by_three()
    methods = cross_check.standard_methods(experiment)
    able, left_out = cross_check.feasible(methods, experiment, experiment.nominal_measurement())
    assert [method.name for method in able] == ["latent smc", "latent nuts", "kde importance"]
    (sentence,) = left_out
    assert sentence.startswith("quadrature grid is left out: ")
    assert "responses for each h" in sentence


def test_a_method_that_needs_more_memory_than_there_is_is_left_out(monkeypatch):
    monkeypatch.setattr(cross_check, "available_bytes", lambda: 5_000)
    methods = cross_check.standard_methods(bar.experiment)
    able, left_out = cross_check.feasible(methods, bar.experiment, bar.measurement)
    assert not able
    assert all("of memory, of which 4.7e-06 GiB are free" in sentence for sentence in left_out)


def test_a_grid_over_too_many_unknowns_is_refused_before_anything_is_computed():
    with pytest.raises(InfeasibleError, match="nodes; at most"):
        memory_needed(three_by_three(), three_by_three().nominal_measurement(), engine="grid")
