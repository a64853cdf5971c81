"""Modes of beams compared with published wave numbers, closed forms and finite elements."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.linalg import eigh

from bayes_placement import beams

LENGTH, AREA, MOMENT, STIFFNESS, DENSITY = 1.7, 2e-3, 3e-7, 7e10, 2700.0
BAR = {"length": LENGTH, "area": AREA, "youngs_modulus": STIFFNESS, "density": DENSITY}
BEAM = BAR | {"second_moment": MOMENT}
SPEED = np.sqrt(STIFFNESS / DENSITY)
BENDING = np.sqrt(STIFFNESS * MOMENT / (DENSITY * AREA)) / LENGTH**2

PAIRS = ["-".join(p) for p in itertools.product(["fixed", "free", "pinned", "guided"], repeat=2)]
BAR_PAIRS = ["fixed-fixed", "fixed-free", "free-fixed", "free-free"]
MANY = 60
NODE, WEIGHT = np.polynomial.legendre.leggauss(300)  # exact beyond twice sixty half waves
VANISHING = {"fixed": (0, 1), "pinned": (0, 2), "free": (2, 3), "guided": (1, 3)}

# Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
BLEVINS = {
    "fixed-fixed": [4.73004074, 7.85320462, 10.9956079, 14.1371655, 17.2787597],
    "free-free": [0.0, 0.0, 4.73004074, 7.85320462, 10.9956079, 14.1371655, 17.2787597],
    "fixed-free": [1.87510407, 4.69409113, 7.85475744, 10.99554073, 14.13716839],
    "fixed-pinned": [3.92660231, 7.06858275, 10.21017612, 13.35176878, 16.49336143],
    "free-pinned": [0.0, 3.92660231, 7.06858275, 10.21017612, 13.35176878, 16.49336143],
    "fixed-guided": [2.36502037, 5.49780392, 8.63937983, 11.78097245, 14.92256510],
    "free-guided": [0.0, 2.36502037, 5.49780392, 8.63937983, 11.78097245, 14.92256510],
    "pinned-pinned": [1 * np.pi, 2 * np.pi, 3 * np.pi],
    "guided-guided": [0.0, 1 * np.pi, 2 * np.pi, 3 * np.pi],
    "pinned-guided": [0.5 * np.pi, 1.5 * np.pi, 2.5 * np.pi],
}


@functools.cache
def line(kind, ends):
    modes = (
        beams.bar(MANY, **BAR, ends=ends) if kind == "bar" else beams.beam(MANY, **BEAM, ends=ends)
    )
    return modes, jax.jit(jax.vmap(lambda position: modes.shapes(position)[0]))


def padded(position):
    return jnp.resize(jnp.asarray(position, dtype=float), 300)  # one shape, compiled once


CASES = [("beam", ends) for ends in PAIRS] + [("bar", ends) for ends in BAR_PAIRS]


@pytest.mark.parametrize("ends", BLEVINS)
def test_wave_numbers_are_those_of_blevins(ends):
    known = np.array(BLEVINS[ends])
    beam = beams.beam(known.size, **BEAM, ends=ends)
    np.testing.assert_allclose(beam.wave_numbers, known, rtol=2e-8, atol=1e-12)
    np.testing.assert_allclose(beam.angular_frequency(), known**2 * BENDING, rtol=4e-8)


@pytest.mark.parametrize(
    ("ends", "wave_numbers"),
    [
        ("fixed-fixed", [1.0, 2.0, 3.0]),
        ("fixed-free", [0.5, 1.5, 2.5]),
        ("free-fixed", [0.5, 1.5, 2.5]),
        ("free-free", [0.0, 1.0, 2.0]),
    ],
)
def test_a_bar_has_its_textbook_frequencies(ends, wave_numbers):
    frequencies = beams.bar(3, **BAR, ends=ends).angular_frequency()
    np.testing.assert_allclose(
        frequencies, np.pi * np.array(wave_numbers) * SPEED / LENGTH, rtol=1e-14
    )


def test_the_bar_of_the_paper_resonates_at_multiples_of_166_67_hz():
    bar = beams.bar(4, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    np.testing.assert_allclose(bar.natural_frequency, 500 / 3 * np.arange(1, 5), rtol=1e-12)
    # Mass-normalised, unlike the printed 2 sin(a pi x / L) / L (REFERENCE.md, correction 3).
    expected = np.sqrt(2 / 9.0) * np.sin(np.pi * 0.3 * np.arange(1, 5))
    np.testing.assert_allclose(bar.shapes(jnp.asarray(0.3))[0], expected, atol=1e-14)


@pytest.mark.parametrize(("kind", "ends"), CASES)
def test_sixty_modes_are_orthonormal_in_mass(kind, ends):
    _, shapes = line(kind, ends)
    phi = np.asarray(shapes(jnp.asarray((NODE + 1) / 2 * LENGTH)))
    mass = phi.T @ (WEIGHT[:, None] / 2 * LENGTH * DENSITY * AREA * phi)
    np.testing.assert_allclose(mass, np.eye(MANY), atol=1e-9)


@pytest.mark.parametrize(("kind", "ends"), CASES)
def test_frequencies_rise_and_none_is_missed(kind, ends):
    modes, _ = line(kind, ends)
    k = np.array(modes.wave_numbers)
    assert k.size == MANY
    np.testing.assert_allclose(np.diff(k[-40:]), np.pi, atol=1e-9)
    assert modes.rigid_body_modes == np.sum(k == 0)
    # The n-th elastic shape of a beam of any two ends lies within one half wave of n pi.
    elastic = k[k > 0]
    assert np.all(np.abs(elastic / np.pi - np.arange(1, elastic.size + 1)) <= 0.51)


# Each kind of end on each side, with two neighbours each; mirrored and finite element shapes below
# tie the other pairs to these.
@pytest.mark.parametrize(
    "ends",
    ["fixed-free", "free-pinned", "pinned-guided", "guided-fixed", "fixed-fixed", "free-guided"],
)
def test_end_conditions_hold(ends):
    beam = beams.beam(6, **BEAM, ends=ends)

    def derivatives(position):
        function, values = lambda x: beam.shapes(x)[0], []
        for _ in range(4):
            values.append(function(position))
            function = jax.jacfwd(function)
        by_hand = [beam.shapes(position, order)[0] for order in range(4)]
        return jnp.stack(values), jnp.stack(by_hand)

    at_ends, by_hand = jax.jit(jax.vmap(derivatives))(jnp.array([0.0, LENGTH]))
    scale = np.maximum(np.array(beam.wave_numbers), 1.0) / LENGTH
    size = scale ** np.arange(4)[:, None] / np.sqrt(DENSITY * AREA * LENGTH)
    np.testing.assert_allclose(by_hand / size, at_ends / size, atol=1e-12)
    for end, values in zip(ends.split("-"), np.asarray(at_ends) / size, strict=True):
        zero = list(VANISHING[end])
        others = [order for order in range(4) if order not in zero]
        np.testing.assert_allclose(values[zero], 0.0, atol=1e-10)
        # A rigid-body mode of a beam may have no other derivative than itself.
        assert np.all(np.abs(values[others])[:, beam.rigid_body_modes :] > 0.1)


@pytest.mark.parametrize(("kind", "ends"), CASES)
def test_mirrored_ends_have_mirrored_shapes(kind, ends):
    position = np.linspace(0.0, LENGTH, 300)
    ahead = np.asarray(line(kind, ends)[1](position))
    behind = np.asarray(line(kind, "-".join(reversed(ends.split("-"))))[1](LENGTH - position))
    signs = np.sign(np.sum(ahead * behind, axis=0))
    np.testing.assert_allclose(behind * signs, ahead, atol=1e-9)


@pytest.mark.parametrize("ends", PAIRS)
def test_elastic_shapes_start_positive(ends):
    # A sign that flips from one mode to the next would be harmless, one from run to run not.
    modes, shapes = line("beam", ends)
    elastic = np.array(modes.wave_numbers)[modes.rigid_body_modes :]
    near = np.asarray(shapes(padded(0.1 / elastic * LENGTH)))
    start = modes.rigid_body_modes
    assert np.all(np.diagonal(near[: elastic.size, start:]) > 0)


def test_sixty_modes_do_not_overflow_at_either_end():
    for ends in ("fixed-free", "free-free", "guided-fixed"):
        at_ends = line("beam", ends)[1](padded([0.0, LENGTH]))
        assert np.all(np.isfinite(at_ends))
    # Closed form: the end of a free beam moves twice as much as its mean square, in every mode.
    tip = np.asarray(line("beam", "fixed-free")[1](padded([LENGTH])))[0]
    np.testing.assert_allclose(np.abs(tip), 2 / np.sqrt(DENSITY * AREA * LENGTH), rtol=1e-10)


@pytest.mark.parametrize(
    ("ends", "known"),
    [
        ("pinned-pinned", lambda x, n: np.sqrt(2) * np.sin(n * np.pi * x)),
        ("guided-pinned", lambda x, n: np.sqrt(2) * np.cos((n - 0.5) * np.pi * x)),
    ],
)
def test_shapes_without_exponentials_are_sines_and_cosines(ends, known):
    x, n = np.linspace(0, 1, 300)[:, None], np.arange(1, MANY + 1)
    shapes = line("beam", ends)[1](x[:, 0] * LENGTH)
    np.testing.assert_allclose(shapes * np.sqrt(DENSITY * AREA * LENGTH), known(x, n), atol=1e-10)


@pytest.mark.parametrize(
    ("kind", "ends", "count"),
    [
        ("beam", "free-free", 2),
        ("beam", "free-pinned", 1),
        ("beam", "pinned-free", 1),
        ("beam", "guided-guided", 1),
        ("beam", "free-guided", 1),
        ("beam", "fixed-free", 0),
        ("bar", "free-free", 1),
        ("bar", "fixed-free", 0),
    ],
)
def test_rigid_body_modes_are_straight_and_of_zero_frequency(kind, ends, count):
    modes, shapes = line(kind, ends)
    position = np.linspace(0.0, LENGTH, 300)
    rigid = np.asarray(shapes(position))[:, :count]
    assert modes.rigid_body_modes == count
    np.testing.assert_array_equal(np.asarray(modes.angular_frequency())[:count], 0.0)
    np.testing.assert_allclose(np.diff(rigid, n=2, axis=0), 0.0, atol=1e-14)
    if "pinned" in ends.split("-"):
        at_pin = rigid[0 if ends.startswith("pinned") else -1]
        np.testing.assert_allclose(at_pin, 0.0, atol=1e-14)


def hermite_beam(ends, elements=60):
    """Natural frequencies of cubic Hermite elements, knowing nothing of the closed forms."""
    h = LENGTH / elements
    stiff = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
    heavy = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4.0]])
    turn = np.outer([1, h, 1, h], [1, h, 1, h])
    size = 2 * (elements + 1)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for first in range(0, size - 2, 2):
        window = slice(first, first + 4)
        stiffness[window, window] += STIFFNESS * MOMENT / h**3 * stiff * turn
        mass[window, window] += DENSITY * AREA * h / 420 * heavy * turn
    fixed_dofs = {"fixed": (0, 1), "pinned": (0,), "guided": (1,), "free": ()}
    left, right = ends.split("-")
    gone = [*fixed_dofs[left], *(size - 2 + dof for dof in fixed_dofs[right])]
    keep = np.setdiff1d(np.arange(size), gone)
    squared, vectors = eigh(stiffness[np.ix_(keep, keep)], mass[np.ix_(keep, keep)])
    shapes = np.zeros((size, squared.size))
    shapes[keep] = vectors
    return squared, shapes[::2]  # deflections at the nodes


@pytest.mark.parametrize("ends", PAIRS)
def test_finite_elements_agree(ends):
    beam, shapes = line("beam", ends)
    squared, deflections = hermite_beam(ends)
    expected = np.asarray(beam.angular_frequency())[:6] ** 2
    np.testing.assert_allclose(squared[:6], expected, rtol=2e-5, atol=1e-5 * squared[5])
    nodes = np.linspace(0.0, LENGTH, 61)
    elastic = slice(beam.rigid_body_modes, 6)  # a pair of rigid modes may come in any mixture
    exact = np.asarray(shapes(padded(nodes)))[:61, elastic]
    element = deflections[:, elastic] * np.sign(np.sum(deflections[:, elastic] * exact, axis=0))
    np.testing.assert_allclose(exact, element, atol=1e-4)


@pytest.mark.parametrize(("kind", "ends"), [("bar", "free-fixed"), ("beam", "fixed-pinned")])
def test_shapes_are_smooth_in_position(kind, ends):
    modes, shapes = line(kind, ends)
    slope = jax.jit(jax.vmap(jax.jacfwd(lambda position: modes.shapes(position)[0])))
    position, step = np.linspace(0.05, LENGTH - 0.05, 300), 1e-6
    differences = (shapes(position + step) - shapes(position - step)) / (2 * step)
    scale = np.maximum(np.array(modes.wave_numbers), 1.0) / LENGTH
    np.testing.assert_allclose(slope(position) / scale, differences / scale, atol=1e-7)
    for order in range(3):
        read = [jax.jit(jax.vmap(lambda x, k=k: modes.shapes(x, k)[0])) for k in range(order, 4)]
        differences = (read[0](position + step) - read[0](position - step)) / (2 * step)
        derivatives, expected = (
            read[1](position) / scale ** (order + 1),
            differences / scale ** (order + 1),
        )
        np.testing.assert_allclose(derivatives, expected, atol=1e-6)


def test_products_of_slopes_are_those_of_sines():
    beam = beams.beam(6, **BEAM, ends="pinned-pinned")
    wave = np.pi / LENGTH * np.arange(1, 7)
    mass = DENSITY * AREA
    np.testing.assert_allclose(beam.slope_matrix(), np.diag(wave**2) / mass, atol=1e-9)
    np.testing.assert_allclose(beam.shear_matrix(), np.diag(wave**6) / mass, rtol=1e-12, atol=1e-6)


@pytest.mark.parametrize("ends", ["fixed-free", "free-guided"])
def test_products_of_slopes_are_those_of_another_quadrature(ends):
    beam, _ = line("beam", ends)
    places = jnp.asarray((NODE + 1) / 2 * LENGTH)
    for order, matrix in ((1, beam.slope_matrix()), (3, beam.shear_matrix())):
        values = np.asarray(jax.vmap(lambda x, k=order: beam.shapes(x, k)[0])(places))
        expected = values.T @ (WEIGHT[:, None] / 2 * LENGTH * values)
        np.testing.assert_allclose(matrix, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(("make", "power"), [(beams.bar, -1), (beams.beam, -2)])
def test_frequencies_have_gradients_in_length_and_material(make, power):
    quantities = BAR if make is beams.bar else BEAM
    modes = make(4, **quantities)

    def frequency(length, youngs_modulus, density):
        changes = {"length": length, "youngs_modulus": youngs_modulus, "density": density}
        return make(4, **(quantities | changes)).natural_frequency

    values = (LENGTH, STIFFNESS, DENSITY)
    gradients = jax.jit(jax.jacfwd(frequency, argnums=(0, 1, 2)))(*values)
    for gradient, value, exponent in zip(gradients, values, (power, 0.5, -0.5), strict=True):
        np.testing.assert_allclose(gradient, exponent * modes.natural_frequency / value, rtol=1e-12)


def test_shapes_have_gradients_in_length():
    def shape(length):
        return beams.beam(4, **(BEAM | {"length": length})).shapes(jnp.asarray(0.6))[0]

    compiled, step = jax.jit(shape), 1e-6
    gradient = jax.jit(jax.jacfwd(shape))(LENGTH)
    differences = (compiled(LENGTH + step) - compiled(LENGTH - step)) / (2 * step)
    np.testing.assert_allclose(gradient, differences, rtol=1e-6)


def test_clamped_is_fixed_and_a_pinned_bar_end_is_fixed():
    assert beams.beam(3, **BEAM, ends="Clamped-free") == beams.beam(3, **BEAM, ends="fixed-free")
    assert beams.bar(3, **BAR, ends="pinned-free") == beams.bar(3, **BAR, ends="fixed-free")


def test_a_structure_reaches_as_far_as_its_least_length():
    unknown = beams.bar(2, **(BAR | {"length": dist.Uniform(1.5, 1.9)}))
    assert unknown.bounds() == (0.0, 1.5)
    assert beams.beam(2, **BEAM).bounds() == (0.0, LENGTH)


def test_a_radius_of_gyration_serves_as_well_as_a_second_moment():
    section = BAR | {"radius_of_gyration": np.sqrt(MOMENT / AREA)}
    by_radius, by_moment = beams.beam(4, **section), beams.beam(4, **BEAM)
    expected = by_moment.angular_frequency()
    np.testing.assert_allclose(by_radius.angular_frequency(), expected, rtol=1e-14)
    # With the radius given, an unknown area is an unknown mass: frequencies stay.
    heavier = beams.beam(4, **(section | {"area": 2 * AREA}))
    np.testing.assert_allclose(heavier.angular_frequency(), expected, rtol=1e-14)
    here = jnp.asarray(0.6)
    np.testing.assert_allclose(heavier.shapes(here) * np.sqrt(2), by_moment.shapes(here))


def test_a_structure_moves_in_the_direction_that_it_is_given():
    assert (beams.bar(2, **BAR).axes, beams.beam(2, **BEAM).axes) == ((1,), (3,))
    assert beams.beam(2, **BEAM, direction=2).axes == (2,)
    assert beams.bar(2, **BAR, direction=3).axes == (3,)


def test_a_beam_needs_one_bending_stiffness():
    with pytest.raises(ValueError, match=r"no bending stiffness; it needs exactly one of"):
        beams.beam(3, **BAR)
    with pytest.raises(ValueError, match=r"given second_moment and radius_of_gyration; it needs"):
        beams.beam(3, **BEAM, radius_of_gyration=0.01)


def test_a_rigid_beam_may_have_fewer_modes_than_rigid_body_modes():
    assert beams.beam(1, **BEAM, ends="free-free").rigid_body_modes == 1


@pytest.mark.parametrize(
    ("make", "quantities"), [(beams.bar, BAR), (beams.beam, BEAM)], ids=["bar", "beam"]
)
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ends": "fixed-glued"}, r"ends='fixed-glued' is not understood.*ends='fixed-free'"),
        ({"ends": "fixed"}, r"ends='fixed' is not understood"),
        ({"modes": 0}, r"modes=0 was given; at least one mode is needed: modes=15"),
        ({"direction": 4}, r"direction=4 was given; the motion is recorded along 1, 2 or 3"),
        ({"direction": -3}, r"direction=-3 was given"),
        ({"length": -1.0}, r"length=-1.0 was given; it must be positive"),
        ({"length": 1e-300}, r"length=1e-300 was given; a number from 1e-40 to 1e\+30 in SI"),
        ({"area": 0.0}, r"area=0.0 was given; it must be positive"),
        (
            {"youngs_modulus": float("nan")},
            r"youngs_modulus=nan was given; one finite number or",
        ),
    ],
)
def test_what_cannot_be_a_beam_is_refused(make, quantities, changes, message):
    arguments = {"modes": 3, **quantities, **changes}
    with pytest.raises(ValueError, match=message):
        make(arguments.pop("modes"), **arguments)


def test_a_bar_has_no_guided_end():
    with pytest.raises(ValueError, match=r"guided end, but a bar moves along its axis only"):
        beams.bar(3, **BAR, ends="guided-free")


@pytest.mark.parametrize("attribute", ["natural_frequency", "stiffness", "angular_frequency"])
def test_what_depends_on_a_prior_is_refused_with_its_name(attribute):
    line = beams.beam(
        3,
        length=1.0,
        area=1e-4,
        second_moment=1e-9,
        youngs_modulus=dist.Uniform(6e10, 8e10),
        density=2700.0,
    )
    sentence = rf"{attribute}.* of UniformBeam was .* a distribution stands for youngs_modulus"
    with pytest.raises(ValueError, match=sentence):
        getattr(line, attribute)()
