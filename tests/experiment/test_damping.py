"""Damping laws: the ratio of each mode, and properties of all three laws."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement import Structure, beams, damping
from bayes_placement._shared.sites import unknowns
from bayes_placement.experiment import frf
from bayes_placement.modes.points import Points

NATURAL = jnp.array([0.0, 300.0, 700.0, 1500.0])
OMEGA = jnp.array([-400.0, 0.0, 250.0, 900.0, 2000.0])


@pytest.mark.parametrize(
    ("ratio", "rigid", "expected"),
    [
        ([0.01, 0.02, 0.03, 0.04], 0, [0.01, 0.02, 0.03, 0.04]),
        ([0.01, 0.02], 0, [0.01, 0.02, 0.02, 0.02]),
        ([0.01, 0.02], 2, [0.01, 0.01, 0.01, 0.02]),
        ([0.01, 0.02, 0.03, 0.04, 0.05], 0, [0.01, 0.02, 0.03, 0.04]),
        ([0.01, 0.02], 1, [0.01, 0.01, 0.02, 0.02]),
        (0.07, 1, [0.07] * 4),
        (np.array([0.01, 0.03]), 0, [0.01, 0.03, 0.03, 0.03]),
        (jnp.array([0.01, 0.03]), 1, [0.01, 0.01, 0.03, 0.03]),
    ],
)
def test_the_last_ratio_holds_for_all_further_elastic_modes(ratio, rigid, expected):
    np.testing.assert_array_equal(damping.Modal(ratio).ratios(4, rigid), expected)


def test_modal_loss_is_viscous():
    loss = damping.Modal([0.01, 0.02]).loss(NATURAL, OMEGA, 1)
    ratio = np.array([0.01, 0.01, 0.02, 0.02])
    expected = 2j * ratio[:, None] * np.asarray(NATURAL)[:, None] * np.asarray(OMEGA)
    np.testing.assert_allclose(loss, expected, rtol=1e-14)


def test_a_rigid_body_mode_is_not_damped_by_ratio_or_loss_factor():
    for law in (damping.Modal([0.3]), damping.Structural(0.3)):
        np.testing.assert_array_equal(law.loss(NATURAL, OMEGA, 1)[0], 0.0)


def test_rayleigh_is_modal_with_its_equivalent_ratios():
    mass, stiffness = 3.0, 2e-5
    elastic = NATURAL[1:]
    equivalent = mass / (2 * elastic) + stiffness * elastic / 2
    np.testing.assert_allclose(
        damping.Rayleigh(mass, stiffness).loss(elastic, OMEGA, 0),
        damping.Modal(equivalent).loss(elastic, OMEGA, 0),
        rtol=1e-14,
    )


def test_structural_loss_does_not_depend_on_frequency_but_for_its_sign():
    loss = np.asarray(damping.Structural(0.05).loss(NATURAL, OMEGA, 1))
    expected = 0.05j * np.asarray(NATURAL)[:, None] ** 2 * np.array([-1.0, 0.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(loss, expected, rtol=1e-14)


def test_structural_equals_modal_at_resonance_with_half_the_loss_factor():
    elastic = NATURAL[1:]
    structural = damping.Structural(0.06).loss(elastic, elastic, 0)
    modal = damping.Modal(0.03).loss(elastic, elastic, 0)
    np.testing.assert_allclose(jnp.diagonal(structural), jnp.diagonal(modal), rtol=1e-14)


def test_the_loss_has_gradients_in_each_ratio():
    def loss(ratios):
        return jnp.imag(damping.Modal(ratios).loss(NATURAL[1:], OMEGA[2:3], 0))[:, 0]

    gradient = jax.jit(jax.jacfwd(loss))(jnp.array([0.01, 0.02]))
    expected = 2 * NATURAL[1:] * OMEGA[2]
    np.testing.assert_allclose(gradient[:, 0], expected * np.array([1, 0, 0]), rtol=1e-14)
    np.testing.assert_allclose(gradient[:, 1], expected * np.array([0, 1, 1]), rtol=1e-14)


def test_ratios_are_named_by_mode_counted_from_one():
    modal = damping.Modal([dist.Uniform(0.02, 0.06), 0.04, dist.LogNormal(-3.0, 0.5)])
    assert [(unknown.name, unknown.unit) for unknown in unknowns(modal)] == [
        ("ratio.1", "1"),
        ("ratio.3", "1"),
    ]


def test_units_of_rayleigh():
    rayleigh = damping.Rayleigh(dist.HalfNormal(1.0), dist.HalfNormal(1e-5))
    assert [(unknown.name, unknown.unit) for unknown in unknowns(rayleigh)] == [
        ("mass", "1/s"),
        ("stiffness", "s"),
    ]


@pytest.mark.parametrize("ratio", [[], ()])
def test_no_ratio_is_refused(ratio):
    with pytest.raises(ValueError, match=r"damping.Modal got no ratio.*damping.Modal\(\[0.04\]\)"):
        damping.Modal(ratio)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: damping.Modal(0.0), r"Modal: ratio of zero.*damping.Modal\(0.01\)"),
        (lambda: damping.Modal([0.02, 0.0]), r"Modal: ratio of zero"),
        (lambda: damping.Modal([0.02, -0.01]), r"Modal: ratio=-0.01 was given.*no number below"),
        (lambda: damping.Modal(np.array([0.02, -0.01])), r"Modal: ratio=-0.01"),
        (lambda: damping.Modal([dist.Uniform(-0.01, 0.05)]), r"Modal: ratio=Uniform was given"),
        (lambda: damping.Modal(dist.Normal(0.02, 0.001)), r"ratio=Normal .*dist.LogUniform"),
        (
            lambda: damping.Modal(dist.Normal(0.02, 0.001).expand([2]).to_event(1)),
            r"ratio=Independent was given",
        ),
        (lambda: damping.Rayleigh(-1.0, 1e-5), r"Rayleigh: mass=-1 was given"),
        (lambda: damping.Rayleigh(0.0, 0.0), r"mass and stiffness of zero.*Rayleigh\(0.0, 1e-5\)"),
        (lambda: damping.Structural(0), r"Structural: loss_factor of zero"),
        (lambda: damping.Structural(-0.02), r"Structural: loss_factor=-0.02 was given"),
    ],
)
def test_damping_of_zero_or_less_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    "ratio",
    [
        dist.Uniform(0.0, 0.05),
        dist.HalfNormal(0.1),
        dist.Beta(2.0, 30.0),
        dist.TruncatedNormal(0.02, 0.01, low=1e-4),
        dist.Delta(0.03),
        dist.LogNormal(-3.0, 0.5),
    ],
)
def test_distributions_above_zero_are_accepted(ratio):
    assert damping.Modal([ratio]).ratio == (ratio,)
    assert damping.Rayleigh(0.0, ratio).stiffness is ratio


@pytest.mark.parametrize("law", [damping.Rayleigh(3.0, 2e-5), damping.Structural(0.2)])
def test_damped_modes_left_out_are_in_the_static_part(law):
    """Few modes with their static part against many modes, driven and read away from nodes."""
    omega = 2 * np.pi * np.linspace(20.0, 300.0, 7)

    def driven(count):
        line = beams.beam(
            count,
            length=0.6,
            area=1.8e-4,
            second_moment=5.4e-10,
            youngs_modulus=7e10,
            density=2700.0,
        )
        points = Points(jnp.array([0.43]), jnp.array([[1.0]]))
        base = Structure(line, damping=law)
        return np.asarray(
            jax.jit(lambda: frf.receptance(base, points, points, jnp.asarray(omega)))()
        )

    corrected, converged = driven(8), driven(60)
    np.testing.assert_allclose(corrected, converged, atol=3e-5 * np.abs(converged).max())
