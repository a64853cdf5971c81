"""Statics of uniform lines compared with long modal sums and exact receptances."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement import beams
from bayes_placement._shared.sites import substitute

LENGTH, AREA, MOMENT, STIFFNESS, DENSITY = 1.7, 2e-3, 3e-7, 7e10, 2700.0
BAR = {"length": LENGTH, "area": AREA, "youngs_modulus": STIFFNESS, "density": DENSITY}
BEAM = BAR | {"second_moment": MOMENT}
BENDING, AXIAL = STIFFNESS * MOMENT, STIFFNESS * AREA

FURTHER = [pytest.mark.long, pytest.mark.longest]
BAR_PAIRS = ["fixed-fixed", "fixed-free", "free-fixed", "free-free"]
CASES = [("bar", ends) for ends in BAR_PAIRS] + [
    # Each kind of end, zero to two rigid-body modes.
    ("beam", ends)
    for ends in ["fixed-free", "free-free", "pinned-fixed", "free-pinned", "guided-free"]
]
KEPT, LONG = 8, 24
LOSSY = 1 + 0.02j  # constant loss factor
PLACES = jnp.asarray(LENGTH * np.array([0.0, 0.1, 0.35, 0.55, 0.85, 1.0]))


@functools.cache
def line(kind, ends, modes=KEPT, **settings):
    quantities = BAR if kind == "bar" else BEAM
    return getattr(beams, kind)(modes, **quantities, **settings, ends=ends)


def table(function):
    every = jax.vmap(lambda x: jax.vmap(lambda y: function(x, y))(PLACES))
    return np.asarray(jax.jit(every)(PLACES))


def close(result, expected, tolerance=1e-10):
    np.testing.assert_allclose(result, expected, atol=tolerance * np.abs(expected).max(), rtol=0)


@pytest.mark.parametrize(("kind", "ends"), CASES)
def test_the_flexibility_is_the_sum_over_all_modes(kind, ends):
    member, long = line(kind, ends), line(kind, ends, LONG)
    phi = np.asarray(jax.vmap(lambda x: long.shapes(x)[0])(PLACES))[:, member.rigid_body_modes :]
    squared = np.asarray(long.angular_frequency())[member.rigid_body_modes :] ** 2
    flexibility = table(lambda x, y: member.static_flexibility(x, y)[0, 0])
    left = []
    for modes in (KEPT, LONG):
        elastic = slice(0, modes - member.rigid_body_modes)
        left.append(
            np.abs(flexibility - phi[:, elastic] / squared[elastic] @ phi[:, elastic].T).max()
        )
    # Modes beyond n add as the sum of 1/k^order from there.
    rate = 1 if kind == "bar" else 3
    assert 0.4 < left[1] / left[0] * (LONG / KEPT) ** rate < 2.5


@pytest.mark.parametrize("order", [1, 2, 3])
def test_one_frequency_stands_for_all_modes_left_out(order):
    member = line("bar" if order == 1 else "beam", "fixed-fixed")
    # Far up the wave numbers are pi apart; a jump at a generic place takes part as their power.
    wave = member.wave_numbers[-1] + np.pi * np.arange(1, 200000)
    share = wave ** (2 * order - 4 * member.half_order)
    over_squares = (member.wave_numbers[-1] / wave) ** (2 * member.half_order)
    over_squares /= np.asarray(member.angular_frequency())[-1] ** 2
    expected = np.sum(share * over_squares) / np.sum(share)
    np.testing.assert_allclose(member.mean_flexibility_beyond(order), expected, rtol=1e-4)


# Receptances: what the residual is for.


def bar_exact(x, y, wave):
    """Receptance of a bar fixed at both ends, at complex wave numbers."""
    low, high = np.minimum(x, y), np.maximum(x, y)
    return np.sin(wave * low) * np.sin(wave * (LENGTH - high)) / (wave * np.sin(wave * LENGTH))


def beam_exact(x, y, wave):
    """Receptance of a beam pinned at both ends, at complex wave numbers."""
    low, high = np.minimum(x, y), np.maximum(x, y)
    swing = np.sin(wave * low) * np.sin(wave * (LENGTH - high)) / np.sin(wave * LENGTH)
    bend = np.sinh(wave * low) * np.sinh(wave * (LENGTH - high)) / np.sinh(wave * LENGTH)
    return (swing - bend) / (2 * wave**3)


@functools.cache
def layouts(kind, modes):
    """Exact and modal receptances of six lay-outs in the band of nine modes, and residuals."""
    member = line(kind, "fixed-fixed" if kind == "bar" else "pinned-pinned", modes)
    power = 2 if kind == "bar" else 4
    wave = np.linspace(0.5, 9.5, 200) * np.pi / LENGTH
    squared = wave**power * (AXIAL if kind == "bar" else BENDING) / (DENSITY * AREA)
    places = jnp.asarray(np.random.default_rng(5).uniform(0, LENGTH, (6, 5)))  # the last a force
    phi = np.asarray(jax.vmap(jax.vmap(lambda x: member.shapes(x)[0]))(places))
    modal = 1 / (LOSSY * np.asarray(member.angular_frequency())[:, None] ** 2 - squared)
    exact = bar_exact if kind == "bar" else beam_exact
    stiffness = LOSSY * (AXIAL if kind == "bar" else BENDING)
    x = np.asarray(places)[..., None]
    expected = exact(x[:, :4], x[:, 4:], wave / LOSSY ** (1 / power)) / stiffness

    by_force = jax.vmap(
        lambda row: jax.vmap(lambda x: member.static_flexibility(x, row[4])[0, 0])(row[:4])
    )
    static = np.asarray(by_force(places))[..., None] / LOSSY
    residues = phi[:, :4] * phi[:, 4:]
    dynamic = modal - 1 / (LOSSY * np.asarray(member.angular_frequency())[:, None] ** 2)
    return expected, np.stack([residues @ modal, residues @ dynamic + static])


@pytest.mark.parametrize(
    ("kind", "modes", "plain", "corrected"),
    [
        ("bar", 40, 0.2, 0.003),
        ("beam", 20, 0.3, 0.001),
        pytest.param("bar", 20, 5.0, 0.3, marks=FURTHER),
        pytest.param("beam", 15, 1.0, 0.1, marks=FURTHER),
    ],
)
def test_a_few_modes_raise_no_false_alarm_with_the_statics(kind, modes, plain, corrected):
    expected, receptances = layouts(kind, modes)
    # Excess chi2 per datum at 1 % noise of each datum: the median lay-out.
    chi2 = np.mean(np.abs((receptances / expected - 1) / 0.01) ** 2, axis=(2, 3))
    excess = np.median(chi2, axis=1)
    assert excess[0] > plain
    assert excess[1] < corrected


# Derivatives, compilation, unknowns.


@pytest.mark.parametrize(("kind", "ends"), [("bar", "free-free"), ("beam", "fixed-pinned")])
def test_derivatives_in_position_are_those_of_finite_differences(kind, ends):
    member, step = line(kind, ends), 1e-5
    x, y = jnp.array([0.61, 1.13]), jnp.array([1.13, 0.61])
    scale = LENGTH ** (1 if kind == "bar" else 3)
    for order in range(2):
        read = [
            jax.jit(jax.vmap(lambda x, y, k=k: member.green(x, y, (k, 1)) / scale))
            for k in (order, order + 1)
        ]
        difference = (read[0](x + step, y) - read[0](x - step, y)) / (2 * step)
        np.testing.assert_allclose(read[1](x, y), difference, atol=1e-6)


@pytest.mark.parametrize(("kind", "ends"), [("bar", "free-free"), ("beam", "fixed-pinned")])
def test_gradients_in_positions_are_the_derivatives(kind, ends):
    member = line(kind, ends)

    def derivative_pairs(x, y):
        value = jax.grad(lambda x, y: member.green(x, y), argnums=(0, 1))(x, y)
        return value, (member.green(x, y, (1, 0)), member.green(x, y, (0, 1)))

    x, y = jnp.array([0.61, 0.61, 1.13]), jnp.array([1.13, 0.61, 0.61])
    value, derivatives = jax.jit(jax.vmap(derivative_pairs))(x, y)
    np.testing.assert_allclose(value, derivatives, rtol=1e-12)


@pytest.mark.parametrize("kind", ["bar", "beam"])
def test_quantities_may_be_traced_and_unknown(kind):
    quantities = BAR if kind == "bar" else BEAM
    distributions = {
        name: dist.Uniform(0.5 * value, 2.0 * value) for name, value in quantities.items()
    }
    unknown = getattr(beams, kind)(4, **distributions, ends="fixed-fixed")

    def read(scale):
        member = substitute(unknown, {name: scale * value for name, value in quantities.items()})
        x, y = jnp.asarray(0.3), jnp.asarray(0.5)
        values = [member.static_flexibility(x, y)[0, 0], member.green(x, y, (1, 0), 2)]
        values += [member.mean_flexibility_beyond(1), member.angular_frequency()[0] ** 2]
        if kind == "beam":
            values += [member.slope_matrix()[0, 0], member.shear_matrix()[0, 0]]
        return jnp.stack(values)

    outputs = jax.jit(jax.vmap(read))(jnp.array([1.0, 1.1]))
    known = jax.jit(lambda: read(1.0))()
    np.testing.assert_allclose(outputs[0], known, rtol=1e-12)
    assert np.all(outputs[1] != outputs[0])


@pytest.mark.parametrize("kind", ["bar", "beam"])
def test_without_static_correction_no_flexibility_is_known(kind):
    plain = line(kind, "fixed-fixed", static_correction=False)
    assert plain.static_flexibility(jnp.asarray(0.3), jnp.asarray(0.4)) is None
