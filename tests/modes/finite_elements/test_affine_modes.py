"""Parameters of matrices compared with full solutions, with gradients of repeated modes."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro.infer.util import log_density

import bayes_placement as bp
from bayes_placement import finite_elements
from bayes_placement._shared.sites import substitute, unknowns
from bayes_placement.experiment import frf
from bayes_placement.modes.finite_elements import _part_factors
from bayes_placement.modes.points import Points
from tests.modes.finite_elements.test_from_matrices import handed_over
from tests.simulator.element_models import weights
from tests.small_models import Plate

SIDE = 0.3
PRIOR = dist.Uniform(0.75, 1.3)
PLACES = jnp.asarray([[0.11, 0.07, 0.0], [0.19, 0.23, 0.0]])
ALONG_Z = Points(PLACES, np.ones((2, 1)))


@functools.cache
def square():
    """A square plate: its natural frequencies come in pairs."""
    plate = Plate((6, 6), (SIDE, SIDE))
    parts = {
        "corner": plate.part(lambda x, y: (x < SIDE / 2) & (y < SIDE / 2)),
        "strip": plate.part(lambda x, y: (x > SIDE / 2) & (y > SIDE / 4)),
    }
    matrices = bp.finite_elements.Matrices(**plate.model(), regions=parts)
    corners = np.array([[0, 1, 8, 7]]) + np.array([[7 * j + i] for j in range(6) for i in range(6)])
    order = np.lexsort(np.round(plate.position[:, :2], 9).T)
    return matrices, bp.finite_elements.interpolation.plate(matrices, order[corners])


@functools.cache
def natural():
    return square()[0].modes(count=8).natural_frequency


@functools.cache
def affine():
    """Moduli of two regions, and the density of the whole."""
    matrices, reading = square()
    return finite_elements.affine(
        matrices,
        reading,
        parameters={"corner": PRIOR, "strip": PRIOR, "density": dist.Uniform(0.9, 1.1)},
        mass={"density": matrices.mass},
        up_to=4 * natural()[3],
    )


def drawn(values):
    return substitute(affine(), {f"parameter.{name}": value for name, value in values.items()})


def changed(values):
    """Full matrices for some parameters."""
    matrices, _ = square()
    stiffness = matrices.stiffness
    for name, part in matrices.regions.items():
        stiffness = stiffness + (values[name] - 1) * part
    return bp.finite_elements.Matrices(
        stiffness,
        values["density"] * matrices.mass,
        matrices.position,
        matrices.dof,
        fixed=matrices.fixed,
    )


# Natural frequencies over the prior.


def draws(names, count, seed):
    random = np.random.default_rng(seed)
    return [
        dict(zip(names, random.uniform(0.75, 1.3, len(names)), strict=True)) for _ in range(count)
    ]


def frequencies(modes):
    return np.asarray(_frequencies(modes))


@eqx.filter_jit
def _frequencies(modes):
    return modes.solved().natural_frequency


@pytest.mark.long
def test_natural_frequencies_stay_right_on_a_square_plate():
    for values in draws(["corner", "strip"], 3, 1):
        values = values | {"density": 1.07}
        expected = changed(values).modes(up_to=4 * natural()[3]).natural_frequency
        frequency = frequencies(drawn(values))[: expected.size]
        assert expected.size > 10
        np.testing.assert_allclose(frequency, expected, rtol=1e-3)


@pytest.mark.parametrize(
    ("name", "top"), [("portal", 900.0), pytest.param("plate", 2500.0, marks=pytest.mark.long)]
)
def test_natural_frequencies_stay_right_on_models_handed_over(shared_data, name, top):
    matrices, reading, _ = handed_over(shared_data / "cases" / "models" / name)
    names = ["region 0", "region 5", "region 6"]
    modes = finite_elements.affine(
        matrices,
        reading.near(np.array([[0.1, 0.0, 0.0]]), 0.05),
        parameters=dict.fromkeys(names, PRIOR),
        up_to=top,
    )
    assert modes.frequency_error < 1e-3
    for values in draws(names, 2, 2):
        stiffness = matrices.stiffness + sum(
            (values[region] - 1) * matrices.regions[region] for region in names
        )
        full = bp.finite_elements.Matrices(
            stiffness,
            matrices.mass,
            matrices.position,
            matrices.dof,
            node=matrices.node,
            fixed=matrices.fixed,
        )
        expected = full.modes(up_to=top).natural_frequency
        named = {f"parameter.{region}": value for region, value in values.items()}
        frequency = frequencies(substitute(modes, named))[: expected.size]
        assert expected.size > 15
        np.testing.assert_allclose(frequency, expected, rtol=1e-3)


def test_a_thickness_scales_bending_by_its_cube_and_mass_by_itself():
    matrices, reading = square()
    modes = finite_elements.affine(
        matrices,
        reading,
        parameters={"thickness": dist.Uniform(0.9, 1.1)},
        stiffness={"bending": matrices.stiffness},
        mass={"area mass": matrices.mass},
        powers={"bending": {"thickness": 3}, "area mass": {"thickness": 1}},
        up_to=1.01 * natural()[3],
    )
    thicker = substitute(modes, {"parameter.thickness": 1.06})
    np.testing.assert_allclose(frequencies(thicker)[:4], 1.06 * natural()[:4], rtol=1e-9)
    static = jax.jit(lambda model: model.solved().static_flexibility(*PLACES[:2]))
    before = static(substitute(modes, {"parameter.thickness": 1.0}))
    np.testing.assert_allclose(static(thicker), before / 1.06**3, rtol=1e-9)


def test_a_factor_may_be_a_product_of_parameters():
    matrices, reading = square()
    modes = finite_elements.affine(
        matrices,
        reading,
        parameters={"modulus": dist.LogNormal(0.0, 0.05), "thickness": 1.05},
        stiffness={"bending": matrices.stiffness},
        powers={"bending": {"modulus": 1, "thickness": 3}},
        up_to=1.01 * natural()[3],
    )
    assert [unknown.name for unknown in unknowns(modes)] == ["parameter.modulus"]
    frequency = frequencies(substitute(modes, {"parameter.modulus": 1.1}))
    np.testing.assert_allclose(frequency[:4], natural()[:4] * np.sqrt(1.1 * 1.05**3), rtol=1e-9)


def test_modulus_and_density_of_the_whole_scale_beside_the_parts():
    matrices, reading = square()
    modes = finite_elements.affine(
        matrices,
        reading,
        parameters={"corner": PRIOR},
        up_to=1.01 * natural()[3],
        youngs_modulus=2.2e11,
        density=8000.0,
        nominal=(2.0e11, 7850.0),
    )
    softer = substitute(modes, {"parameter.corner": 0.8})
    plain = finite_elements.affine(
        matrices, reading, parameters={"corner": PRIOR}, up_to=1.01 * natural()[3]
    )
    expected = frequencies(substitute(plain, {"parameter.corner": 0.8}))
    scale = np.sqrt(1.1 / (8000 / 7850))
    np.testing.assert_allclose(frequencies(softer), scale * expected, rtol=1e-12)


# Receptances and their gradients.

LAWS = {
    "modal": bp.damping.Modal(0.01),
    "Rayleigh": bp.damping.Rayleigh(3.0, 2e-6),
    "structural": bp.damping.Structural(0.02),
}
NAMES = ["corner", "strip", "density"]
NOMINAL, ELSEWHERE = np.ones(3), np.array([0.8, 1.2, 1.05])
OMEGA = 2 * np.pi * np.array([60.0, 180.0, 310.0, 455.0, 610.0])
STEP = 1e-4


def responses(values):
    """Receptance for each damping law, with and without static flexibility."""
    modes = drawn(dict(zip(NAMES, values, strict=True)))
    bare = eqx.tree_at(lambda tree: tree.nodal.flexibility, modes, None)
    return {
        (law, statics): frf.receptance(
            bp.Structure(modes if statics else bare, damping=damping),
            ALONG_Z,
            ALONG_Z,
            jnp.asarray(OMEGA),
        )
        for law, damping in LAWS.items()
        for statics in (True, False)
    }


compiled = jax.jit(lambda values: (responses(values), jax.jacfwd(responses)(values)))
"""Receptances and their slopes in the parameters."""


def direct(stiffness, mass, read, law):
    """Receptance by a direct complex solution at each line."""
    damping = {
        "modal": lambda w: 1j * w * _modal(stiffness, mass),
        "Rayleigh": lambda w: 1j * w * (3.0 * mass + 2e-6 * stiffness),
        "structural": lambda w: 0.02j * stiffness,
    }[law]
    solutions = [
        read @ np.linalg.solve(stiffness - w**2 * mass + damping(w), read.T) for w in OMEGA
    ]
    return np.stack(solutions, axis=-1)


def _modal(stiffness, mass):
    """M Phi diag(2 zeta omega_n) Phi^T M = 2 zeta L (L^-1 K L^-T)^1/2 L^T, whatever the vectors."""
    factor = np.linalg.cholesky(mass)
    inner = np.linalg.solve(factor, np.linalg.solve(factor, stiffness).T)
    values, vectors = np.linalg.eigh((inner + inner.T) / 2)
    return 0.02 * factor @ (vectors * np.sqrt(values)) @ vectors.T @ factor.T


@functools.cache
def basis_at_places():
    """Shapes of the basis [place, mode], which does not depend on the parameters."""
    return np.asarray(jax.jit(jax.vmap(affine().nodal.shapes))(PLACES))[:, 0]


def reduced(values, law):
    modes = affine()
    stiffness, mass = np.diag(modes.nodal.eigenvalues), np.eye(modes.nodal.eigenvalues.size)
    for name, part in zip(modes.stiffness.names, modes.stiffness.matrices, strict=True):
        stiffness = stiffness + (values[NAMES.index(name)] - 1) * part
    mass = mass + (values[2] - 1) * modes.mass.matrices[0]
    return direct(stiffness, mass, basis_at_places(), law)


def full(values, law):
    matrices, reading = square()
    free = np.setdiff1d(np.arange(len(matrices.dof)), matrices.fixed)
    system = changed(dict(zip(NAMES, values, strict=True)))
    pair = [matrix.toarray()[np.ix_(free, free)] for matrix in (system.stiffness, system.mass)]
    return direct(*pair, weights(reading, PLACES, len(matrices.dof))[:, 0, free], law)


def slope(function, law, number, at=NOMINAL):
    step = STEP * np.eye(3)[number]
    return (function(at + step, law) - function(at - step, law)) / (2 * STEP)


def test_the_natural_frequencies_of_the_square_plate_are_repeated():
    squares = affine().nodal.eigenvalues
    assert np.count_nonzero(np.diff(squares) < 1e-9 * squares[1:]) >= 3


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("at", [NOMINAL, ELSEWHERE], ids=["nominal", "elsewhere"])
def test_receptances_and_gradients_are_those_of_direct_solutions_in_the_basis(law, at):
    receptances, slopes = (table[law, False] for table in compiled(at))
    expected = reduced(at, law)
    size = np.abs(expected).max()
    np.testing.assert_allclose(receptances / size, expected / size, atol=1e-9)
    for number in range(3):
        expected = slope(reduced, law, number, at)
        size = np.abs(expected).max()
        np.testing.assert_allclose(slopes[..., number] / size, expected / size, atol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    "at",
    [NOMINAL, pytest.param(ELSEWHERE, marks=pytest.mark.longest)],
    ids=["nominal", "elsewhere"],
)
def test_receptances_and_gradients_are_those_of_direct_solutions_of_all_matrices(law, at):
    receptances, slopes = (table[law, True] for table in compiled(at))
    expected = full(at, law)
    size = np.abs(expected).max(axis=-1, keepdims=True)
    np.testing.assert_allclose(receptances / size, expected / size, atol=2e-3)
    for number in range(3):
        expected = slope(full, law, number, at)
        size = np.abs(expected).max()
        np.testing.assert_allclose(slopes[..., number] / size, expected / size, atol=2e-3)


@pytest.mark.long
def test_reverse_mode_agrees_with_forward_mode():
    def size(values):
        return jnp.sum(jnp.log(jnp.abs(jnp.stack([*responses(values).values()]))))

    back = jax.jit(jax.grad(size))(NOMINAL)
    receptances, slopes = (np.stack([*table.values()]) for table in compiled(NOMINAL))
    ahead = np.sum(np.real(slopes / receptances[..., None]), axis=(0, 1, 2, 3))
    np.testing.assert_allclose(back, ahead, rtol=1e-9)
    assert (np.abs(back) > 0.1).all()


def test_eigenvectors_of_repeated_frequencies_have_no_plain_gradient():
    """What would be without `eigenpairs`."""
    squares = affine().nodal.eigenvalues.copy()
    twice = np.flatnonzero(np.diff(squares) < 1e-9 * squares[1:])
    squares[twice + 1] = squares[twice]

    def plain(factor):
        part = (factor - 1) * affine().stiffness.matrices[0]
        return jnp.linalg.eigh(jnp.diag(squares) + part)[1]

    assert np.isnan(jax.jit(jax.jacfwd(plain))(1.0)).any()


def test_the_static_flexibility_follows_the_parts():
    """To first order exactly: without it a soft region would seem stiff under its own sensors."""
    at = dict(corner=0.8, strip=1.2, density=1.0)
    static = jax.jit(lambda model: model.solved().static_flexibility(*PLACES[jnp.array([0, 0])]))
    matrices, reading = square()
    read = weights(reading, PLACES[:1], len(matrices.dof))[0]
    rows = np.arange(len(matrices.dof))
    expected = read @ changed(at).static_flexibility(rows) @ read.T
    flexibility = static(drawn(at))
    stiff = eqx.tree_at(lambda model: model.residual, drawn(at), None)
    assert abs(flexibility / expected - 1) < 2e-4
    assert abs(static(stiff) / expected - 1) > 5 * abs(flexibility / expected - 1)


# Inference.

TRUTH = dict(corner=0.85, strip=1.1, density=1.04)


@functools.cache
def experiment(unknown=True):
    modes = affine() if unknown else drawn(TRUTH)
    sensors = [
        bp.Sensor("s1", at=bp.positions.Box((0.11, 0.07, 0.0), within=(0.02, 0.02, 0.0))),
        bp.Sensor("s2", at=(0.25, 0.14, 0.0)),
    ]
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.01)),
        sensors=sensors,
        actuators=[bp.Actuator("a1", at=(0.19, 0.23, 0.0))],
        frequency=np.linspace(60.0, 600.0, 15),
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.2),
    )


def test_every_parameter_is_named_with_its_prior():
    table = str(experiment())
    assert "structure.modes.parameter.corner" in table and "parameter" in table


@pytest.mark.long
def test_leapfrog_steps_from_repeated_natural_frequencies_keep_their_energy():
    """As in NUTS; a wrong gradient gains or loses energy, and NaN is neither."""
    data = experiment().data(experiment(unknown=False).nominal_measurement())
    names = [unknown.name for unknown in experiment().unknowns]
    width = np.array([0.55, 0.55, 0.2, 0.04, 0.04])

    @jax.jit
    @jax.value_and_grad
    def potential(place):
        values = dict(zip(names, width * place, strict=True))
        return -log_density(experiment().model, (data,), {}, values)[0]

    place, speed, step = np.array([1.0, 1.0, 1.0, 0.11, 0.07]) / width, np.zeros(5), 0.002
    energies, slope = [], potential(place)[1]
    for _ in range(12):
        speed = speed - step / 2 * slope
        place = place + step * speed
        energy, slope = potential(place)
        speed = speed - step / 2 * slope
        energies.append((energy, speed @ speed / 2))
    energies = np.array(energies)
    assert np.ptp(energies[:, 0]) > 3
    assert np.ptp(energies.sum(axis=1)) < 0.01 * np.ptp(energies[:, 0])


def test_effects_are_added_to_affine_modes():
    structure = bp.Structure(drawn(dict(corner=1.0, strip=1.0, density=1.0)), damping=LAWS["modal"])
    weak = structure + bp.effects.region_stiffness_loss("corner", 0.2)
    lost = np.asarray(jax.jit(lambda: weak.proper_modes().natural_frequency)())
    expected = changed(dict(corner=0.8, strip=1.0, density=1.0)).modes(count=4).natural_frequency
    np.testing.assert_allclose(lost[:4], expected, rtol=1e-3)


# The report and errors.


def test_the_report_is_one_sentence_on_the_error():
    assert "natural frequencies up to" in affine().report and affine().report.endswith(".")
    assert 0 < affine().frequency_error < 1e-3
    assert f"{affine().frequency_error:.1e}" in affine().report


def test_a_distribution_without_quantiles_is_sampled():
    ranges = _part_factors.ranges({"a": dist.Gamma(100.0, 100.0)}, {"part": {"a": 2}}, {})
    low, high = ranges["part"]
    assert 0.4 < low < 0.55 and 1.6 < high < 2.2


def test_ranges_follow_quantiles_and_powers():
    powers = {"bending": {"modulus": 1, "thickness": 3}, "softness": {"modulus": -1}}
    distributions = {"modulus": dist.Uniform(0.8, 1.2), "thickness": 1.1}
    bounds = _part_factors.ranges(distributions, powers, {})
    np.testing.assert_allclose(bounds["bending"], np.array([0.8, 1.2]) * 1.1**3, rtol=2e-3)
    np.testing.assert_allclose(bounds["softness"], [1 / 1.2, 1 / 0.8], rtol=2e-3)
    stated_bounds = _part_factors.ranges(distributions, powers, {"thickness": (0.9, 1.2)})
    np.testing.assert_allclose(stated_bounds["bending"], [0.8 * 0.9**3, 1.2 * 1.2**3], rtol=2e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(parameters={"roof": PRIOR}), 'parameter "roof" scales nothing; the parts are none'),
        (
            dict(parameters={"beam.root": PRIOR}),
            r"parameter of the name 'beam\.root'.*\"beam_root\"",
        ),
        (dict(parameters={"": PRIOR}), "parameter of the name '' was given"),
        (
            dict(parameters={"corner": PRIOR, "roof": PRIOR}),
            r'parts are "corner".*stiffness=\{"roof"',
        ),
        (dict(powers={"roof": {"corner": 1}}), 'powers names "roof", but the parts'),
        (dict(powers={"corner": {"modulus": 1}}), 'part "corner" is scaled by "modulus", but'),
        (dict(powers={"corner": {}}), 'part "corner" is scaled by none'),
        (dict(parameters={"corner": dist.Normal(1.0, 0.5)}), r"ranges from -0\.85.* positive"),
        (dict(ranges={"corner": (0.0, 1.0)}), "ranges from 0 to 1"),
        (dict(stiffness={"corner": np.eye(3)}), "corner has 3 rows"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(changes, message):
    matrices, reading = square()
    arguments = dict(parameters={"corner": PRIOR}, up_to=natural()[3]) | changes
    with pytest.raises(ValueError, match=message):
        finite_elements.affine(matrices, reading, **arguments)
