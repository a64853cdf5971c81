"""A bar or beam of another dimension, against closed forms and against one that is made so."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import Structure, beams, damping, effects, finite_elements
from bayes_placement._shared.errors import InputError
from bayes_placement.experiment.frf import receptance
from bayes_placement.modes.points import Points
from tests.effects.models_in_space import plate
from tests.simulator import space_frames

BAR = {"length": 0.8, "area": 2e-4, "youngs_modulus": 7e10, "density": 2700.0}
MOMENT = {"second_moment": 6e-10}
RADIUS = {"radius_of_gyration": 3e-6**0.5}
LINES = {
    "bar": (beams.bar, BAR),
    "beam": (beams.beam, BAR | MOMENT),
    "radius": (beams.beam, BAR | RADIUS),
}
OMEGA = jnp.array([70.0, 410.0, 1900.0])
SIDES = [Points(jnp.array([x]), np.ones((1, 1))) for x in (0.31, 0.67)]
ERROR = 0.07


def structure(kind, *additions, **changes):
    make, sizes = LINES[kind]
    line = Structure(make(12, **sizes | changes, ends="fixed-free"), damping=damping.Modal(0.02))
    for effect in additions:
        line = line + effect
    return line


def frf(base):
    return np.asarray(jax.jit(lambda: receptance(base, *SIDES, OMEGA))())


def natural(base):
    return np.asarray(jax.jit(lambda: base.proper_modes().angular_frequency())())


def wrong(dimension, error=ERROR):
    return effects.dimension_error(error, dimension=dimension)


POWERS = [
    ("bar", "length", -1),
    ("beam", "length", -2),
    ("radius", "length", -2),
    ("beam", "thickness", 1),
    ("radius", "thickness", 1),
    ("bar", "section", 0),
    ("beam", "section", 0),
    ("radius", "section", 0),
]
EACH_ONCE = [("bar", "length"), ("beam", "thickness"), ("radius", "section")]
FURTHER = [pytest.mark.long, pytest.mark.longest]


@pytest.mark.parametrize(("kind", "dimension", "power"), POWERS)
@pytest.mark.parametrize("error", [ERROR, -0.11])
def test_natural_frequencies_grow_as_a_power_of_the_dimension(kind, dimension, power, error):
    expected = natural(structure(kind)) * (1 + error) ** power
    changed = natural(structure(kind, wrong(dimension, error)))
    np.testing.assert_allclose(changed, expected, rtol=1e-12)


@pytest.mark.parametrize("kind", LINES)
def test_a_larger_section_divides_the_receptance(kind):
    changed = frf(structure(kind, wrong("section")))
    np.testing.assert_allclose(changed, frf(structure(kind)) / (1 + ERROR), rtol=1e-10)


def made(kind, dimension):
    """Sizes of a line that is made with the other dimension."""
    factor = 1 + ERROR
    if dimension == "length":
        return {"length": BAR["length"] * factor}
    if kind == "beam":
        return {
            "area": BAR["area"] * factor,
            "second_moment": MOMENT["second_moment"] * factor**3,
        }
    return {
        "area": BAR["area"] * factor,
        "radius_of_gyration": RADIUS["radius_of_gyration"] * factor,
    }


@pytest.mark.parametrize(("kind", "dimension"), [row[:2] for row in POWERS[:5]])
def test_it_is_the_line_that_is_made_so(kind, dimension):
    changed, other = structure(kind, wrong(dimension)), structure(kind, **made(kind, dimension))
    np.testing.assert_allclose(frf(changed), frf(other), rtol=1e-10)
    np.testing.assert_allclose(changed.proper_modes().bounds(), other.modes.bounds())


@pytest.mark.parametrize(
    "additions",
    [
        [effects.axial_preload(40.0), effects.shear_and_rotary_inertia(3.1)],
        [effects.compliant_support(1e-4), effects.local_stiffness_loss(0.4, 0.02, 0.5)],
        [effects.point_mass(0.5, 0.1), effects.rotational_spring(0.8, 50.0)],
    ],
)
def test_other_effects_act_on_the_true_line(additions):
    changed = structure("beam", *additions, wrong("length"))
    other = structure("beam", *additions, **made("beam", "length"))
    np.testing.assert_allclose(frf(changed), frf(other), rtol=1e-8)


def test_structures_without_the_dimension_are_refused():
    with pytest.raises(InputError, match=r"one of length, section is needed, since UniformBar"):
        structure("bar", wrong("thickness"))
    with pytest.raises(InputError, match=r"dimension='width' was given; one of length, section, t"):
        structure("beam", wrong("width"))
    model = Structure(plate().modes, damping=damping.Modal(0.02))  # its edges may become soft
    with pytest.raises(
        InputError, match=r"without soft supports and members, is needed.*density or youngs_modulus"
    ):
        model + wrong("scale")
    with pytest.raises(InputError, match=r"one of scale is needed, since NodalModes has no other"):
        scaled_frame(1.0)[0] + wrong("length")


@functools.cache
def scaled_frame(scale):
    """A bent frame, `scale` times as large, clamped at one foot, and points at its nodes."""
    bar = space_frames.RoundBar(0.008 * scale)
    position, elements = space_frames.line(np.zeros(3), (0.0, 0.2, 0.5), 6)
    position[4:] += (0.1, 0.0, 0.0) * np.arange(1, 4)[:, None]
    model = space_frames.matrices(scale * position, elements, bar)
    matrices = finite_elements.Matrices(**model, fixed=np.arange(6))
    reading = finite_elements.interpolation.frame(matrices, elements)
    modes = finite_elements.modes(matrices, reading, up_to=3000.0 / scale)
    at = jnp.asarray(scale * position[[2, 4, 6]])
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return Structure(modes, damping=damping.Modal(0.02)), Points(at, directions)


@pytest.mark.parametrize("error", [ERROR, -0.11])
def test_a_scaled_model_is_that_of_scaled_coordinates(error):
    (drawn, places), (larger, moved) = scaled_frame(1.0), scaled_frame(1 + error)
    ours, expected = (
        np.asarray(jax.jit(lambda base=base, at=at: receptance(base, at, at, OMEGA))())
        for base, at in ((drawn + wrong("scale", error), places), (larger, moved))
    )
    np.testing.assert_allclose(ours, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_attachments_act_on_the_scaled_model():
    (drawn, places), (larger, moved) = scaled_frame(1.0), scaled_frame(1 + ERROR)
    ours = drawn + wrong("scale") + effects.point_mass(tuple(places.position[2].tolist()), 0.1)
    made = larger + effects.point_mass(tuple(moved.position[2].tolist()), 0.1)
    both = [
        np.asarray(jax.jit(lambda base=base, at=at: receptance(base, at, at, OMEGA))())
        for base, at in ((ours, places), (made, moved))
    ]
    np.testing.assert_allclose(*both, rtol=1e-6, atol=1e-9 * np.abs(both[1]).max())


def sized(base, sizes):
    """The structure with sizes that are inputs of a program."""
    return eqx.tree_at(
        lambda tree: [getattr(tree.modes, name) for name in sizes], base, [*sizes.values()]
    )


@pytest.mark.parametrize(
    ("kind", "dimension"),
    [pytest.param(*row[:2], marks=[] if row[:2] in EACH_ONCE else FURTHER) for row in POWERS],
)
def test_no_error_is_the_identity_bit_for_bit(kind, dimension):
    # Known to be zero, the sizes are the same numbers.
    plain = frf(structure(kind))
    np.testing.assert_array_equal(frf(structure(kind, wrong(dimension, 0.0))), plain)
    # As an input, it makes them inputs, by which a compiler divides in another way than by
    # constants: bit for bit is what has them as inputs without it.
    sizes = LINES[kind][1]

    def read(base, sizes):
        return receptance(sized(base, sizes), *SIDES, OMEGA)

    def with_error(error, sizes):
        return read(structure(kind, wrong(dimension, error)), sizes)

    seen = np.asarray(jax.jit(with_error)(0.0, sizes))
    np.testing.assert_array_equal(seen, jax.jit(lambda sizes: read(structure(kind), sizes))(sizes))
    np.testing.assert_allclose(seen, plain, rtol=1e-11)


def test_an_error_in_percent_is_refused():
    bar = beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    with pytest.raises(InputError, match=r"error=5 was given; .* not percent: 0\.05"):
        Structure(bar, damping=damping.Modal(0.01)) + effects.dimension_error(5.0)
