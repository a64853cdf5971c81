"""A function of trees is compiled once a structure, whatever the numbers in them."""

import jax
import jax.numpy as jnp
import jaxlib
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared import compiled as _compiled
from bayes_placement._shared.compiled import compiled, programs_kept
from tests.criticism import small

TRACED = []


def scaled(tree, factor):
    TRACED.append(jax.tree.structure(tree))
    return tree["mean"] * factor + tree["law"].high * tree["power"]


def tree(mean=0.5, high=2.0, power=2):
    return {"mean": mean, "law": dist.Uniform(0.0, high), "power": power}


@pytest.fixture(autouse=True)
def forgotten():
    compiled(scaled)(tree(), 1.0)
    TRACED.clear()


def test_the_same_structure_with_other_numbers_is_not_compiled_again():
    assert compiled(scaled)(tree(0.25, high=3.0), 2.0) == 0.5 + 6.0
    assert compiled(scaled)(tree(-1.0, high=0.5), 3.0) == -3.0 + 1.0
    # Python's, NumPy's or those that JAX makes of Python's.
    assert compiled(scaled)(tree(np.float64(-1.0), high=jnp.asarray(0.5)), 3.0) == -3.0 + 1.0
    assert not TRACED


def test_another_structure_or_integer_is_compiled_anew():
    assert compiled(scaled)(tree(power=3), 1.0) == 0.5 + 6.0
    assert compiled(scaled)({**tree(), "further": 1.0}, 1.0) == 0.5 + 4.0
    assert len(TRACED) == 2


def test_a_store_of_few_programs_lets_those_go_that_were_not_run_for_longest():
    few = programs_kept(2)
    for power in (31, 32, 31, 33, 31):
        assert compiled(scaled).bound(tree(power=power), programs=few)(1.0) == 0.5 + 2.0 * power
    assert len(TRACED) == 3
    compiled(scaled).bound(tree(power=32), programs=few)(1.0)
    assert len(TRACED) == 4


def half_of_numbers(number, flag):
    return number if flag is True else number / 2


def test_true_and_one_are_different_programs():
    assert compiled(half_of_numbers)(3.0, True) == 3.0
    assert compiled(half_of_numbers)(3.0, 1) == 1.5


def test_what_is_prepared_is_not_compiled_when_it_runs():
    bound = compiled(scaled).bound(tree(power=5))
    bound.prepare(1.0)
    assert len(TRACED) == 1
    assert bound(4.0) == 2.0 + 10.0
    assert compiled(scaled).bound(tree(1.0, power=5))(4.0) == 4.0 + 10.0
    assert len(TRACED) == 1


def test_it_may_be_part_of_another_compiled_function():
    slope = jax.jit(jax.grad(lambda mean: compiled(scaled)(tree(mean), 3.0)))
    assert slope(0.1) == 3.0


def steered(tree):
    TRACED.append(tree)
    return tree["mean"] * 2 if tree["mean"] > 0 else tree["law"].high


def test_floats_that_steer_a_function_are_fixed():
    assert compiled(steered)(tree(0.25)) == 0.5
    assert len(TRACED) == 2  # the first attempt ended where the float was compared
    assert compiled(steered)(tree(-0.25, high=3.0)) == 3.0
    assert len(TRACED) == 3
    assert compiled(steered)(tree(0.25)) == 0.5
    assert len(TRACED) == 3


def test_an_array_that_steers_a_function_is_an_error():
    with pytest.raises(jax.errors.TracerBoolConversionError):
        compiled(steered)(tree(np.array(0.25)))


def frf(experiment):
    TRACED.append(experiment)
    return experiment.frf()


def test_experiments_that_differ_in_numbers_share_one_function():
    first = small.experiment().fix(small.TRUTH) + bp.effects.point_mass(0.2, 0.1)
    second = small.experiment().fix(small.TRUTH) + bp.effects.point_mass(0.7, 0.3)
    compiled(frf)(first)
    assert len(TRACED) == 1
    np.testing.assert_allclose(compiled(frf)(second), jnp.asarray(second.frf()), rtol=1e-9)
    assert len(TRACED) == 1


# --------------------------------------------------------------------------- effort

EFFORT = "xla_backend_optimization_level"


@pytest.fixture
def handed(monkeypatch, optimised):
    """Options with which functions are compiled, in their order."""
    options, jit = [], jax.jit

    def spied(function, *, compiler_options=None):
        options.append(compiler_options)
        return jit(function, compiler_options=compiler_options)

    monkeypatch.setattr(jax, "jit", spied)
    return options


@pytest.mark.skipif(
    jax.default_backend() != "cpu" or not jaxlib.__version__.startswith("0.10."),
    reason="the options of this compiler are not known",
)
def test_the_effort_is_an_option_of_the_compiler(handed):
    for effort in (0, 3, None):
        bound = compiled(scaled).bound(tree(power=7), effort=effort)
        bound.prepare(1.0)
        assert bound(1.0) == 0.5 + 14.0
    assert [options.get(EFFORT) for options in handed] == [0, 3, None]


@pytest.mark.skipif(
    jax.default_backend() != "cpu" or not jaxlib.__version__.startswith("0.10."),
    reason="the options of this compiler are not known",
)
def test_long_arrays_are_computed_with_wide_vectors(handed):
    for is_long in (False, True):
        assert compiled(scaled).bound(tree(power=9), is_long=is_long)(1.0) == 0.5 + 18.0
    assert [options.get("xla_cpu_prefer_vector_width") for options in handed] == [None, 512]


def test_options_reach_the_compiler(monkeypatch):
    monkeypatch.setattr(_compiled, "_options", lambda effort, _: (("xla_no_such_option", effort),))
    bound = compiled(scaled).bound(tree(power=8), effort=1)
    for action in (bound.prepare, bound):
        with pytest.raises(jax.errors.JaxRuntimeError, match="xla_no_such_option"):
            action(1.0)


@pytest.mark.parametrize("version", ["0.9.2", "0.11.0", "1.0.10"])
def test_a_compiler_of_another_version_is_given_no_option(version, handed, monkeypatch):
    monkeypatch.setattr(jaxlib, "__version__", version)
    bound = compiled(scaled).bound(tree(power=int(version[2:].replace(".", ""))), effort=1)
    bound.prepare(1.0)
    assert handed == [None]
