"""Networks of elements against nodes that are solved, closed forms and passivity."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist

from bayes_placement._shared.errors import InputError
from bayes_placement._shared.sites import unknowns
from bayes_placement.effects import Dashpot, LossySpring, Mass, Spring, Springpot, Tabulated
from bayes_placement.laws import Law
from bayes_placement.laws.catalogue import leaves
from bayes_placement.laws.elements import typed

OMEGA = jnp.asarray(2 * np.pi * np.array([3.0, 17.0, 44.0, 160.0]))
SPRING, DASHPOT, MASS = Spring(2e4), Dashpot(40.0), Mass(0.3)
LOSSY, RUBBER = LossySpring(3e4, 0.2), Springpot(1e4, 0.4, 30.0)
LINES = np.geomspace(2.0, 200.0, 12)
TABLE = Tabulated(LINES, RUBBER.dynamic_stiffness(jnp.asarray(2 * np.pi * LINES)))

NETWORKS = {
    "spring": SPRING,
    "mass": MASS,
    "Kelvin and Voigt": SPRING | DASHPOT,
    "Maxwell": SPRING - DASHPOT,
    "standard linear solid": Spring(5e3) | SPRING - DASHPOT,
    "absorber": (SPRING | DASHPOT) - MASS,
    "absorber beside a mass": Mass(0.1) | (SPRING | DASHPOT) - MASS,
    "two masses in a chain": LOSSY - (MASS | (Spring(3e3) | Dashpot(2.0)) - Mass(0.2)),
    "rubber": RUBBER,
    "mass on rubber, scaled": 0.4 * (RUBBER - MASS),
    "table": TABLE,
    "table beside a mass on a table": 0.5 * TABLE | (TABLE - MASS),
}
TYPED = [name for name, law in NETWORKS.items() if "t" not in leaves(law.tree())]
table = pytest.mark.parametrize("name", NETWORKS)


def stiffness(law, omega=OMEGA):
    return np.asarray(law.dynamic_stiffness(omega))


def of_nodes(law, omega):
    """Dynamic stiffness of the port from the matrix of all nodes, at one line."""
    matrix = np.zeros((1, 1), complex)

    def node():
        nonlocal matrix
        matrix = np.pad(matrix, (0, 1))
        return len(matrix) - 1

    def connect(law, start, end, factor=1.0):
        """Put a law between two nodes; None is the ground, against which a mass moves."""
        tree = law.tree()
        if isinstance(tree, str):
            value = factor * stiffness(law, jnp.array([omega]))[0]
            ends = np.zeros(len(matrix))
            ends[start] = 1.0
            if end is not None and tree != "m":
                ends[end] = -1.0
            matrix[...] += value * np.outer(ends, ends)
        elif isinstance(tree, list) and type(law).__name__ == "Scaled":
            connect(law.law, start, end, factor * law.strength)
        elif tree[0] == "|":
            for part in law.parts:
                connect(part, start, end, factor)
        else:
            at = [start, *(node() for _ in law.parts[1:]), end]
            for part, one, other in zip(law.parts, at[:-1], at[1:], strict=True):
                connect(part, one, other, factor)

    connect(law, 0, None)
    return 1 / np.linalg.inv(matrix)[0, 0]


@table
def test_a_network_is_that_of_its_nodes(name):
    exact = [of_nodes(NETWORKS[name], float(omega)) for omega in OMEGA]
    np.testing.assert_allclose(stiffness(NETWORKS[name]), exact, rtol=1e-12)


@table
def test_negative_frequencies_are_conjugate(name):
    behind = stiffness(NETWORKS[name], -OMEGA)
    np.testing.assert_allclose(behind, np.conj(stiffness(NETWORKS[name])), rtol=1e-13)


@table
def test_no_network_gives_energy(name):
    assert np.all(stiffness(NETWORKS[name]).imag >= 0)


@table
def test_no_strength_is_no_force_with_a_slope(name):
    def force(strength):
        return jnp.abs((strength * NETWORKS[name]).fraction(OMEGA)[0]).sum()

    assert force(0.0) == 0.0
    value, slope = jax.jvp(lambda s: (s * NETWORKS[name]).fraction(OMEGA)[0] + 0j, (0.0,), (1.0,))
    assert np.all(value == 0)
    assert np.all(np.isfinite(slope))


@pytest.mark.parametrize("name", TYPED)
def test_what_is_printed_can_be_typed(name):
    again = eval(repr(NETWORKS[name]))  # the elements are imported here
    np.testing.assert_array_equal(stiffness(again), stiffness(NETWORKS[name]))
    assert again.tree() == NETWORKS[name].tree()
    assert repr(typed(repr(NETWORKS[name]))) == repr(NETWORKS[name])


def test_priors_can_be_typed():
    law = Spring(dist.LogNormal(9.0, 4.6)) - Springpot(
        dist.LogUniform(1.0, 1e3), dist.Uniform(0.0, 1.0), 50.0
    )
    assert repr(typed(repr(law))) == repr(law)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "Spring",
        "Spring(",
        "Spring()",
        "Spring(-1) - 3",
        "2.0 * 3.0",
        "Inerter(1.0)",
        "Spring(Cauchy(0, 1))",
        "Spring(stiffness=1.0)",
        "__import__('os').getcwd()",
        "Spring([].append(1))",
        "(" * 200 + "Mass(1)" + ")" * 200,
    ],
)
def test_a_text_that_is_no_law_is_refused_and_not_run(text):
    with pytest.raises(InputError, match=r"was given as a law; elements \(Spring, .*: \"Spring"):
        typed(text)


def test_closed_forms_of_mechanical_models():
    w = np.asarray(OMEGA)
    k, c, m = 2e4, 40.0, 0.3
    np.testing.assert_array_equal(stiffness(SPRING | DASHPOT), k + 1j * w * c)
    maxwell = 1j * w * c / (1 + 1j * w * c / k)
    np.testing.assert_allclose(stiffness(SPRING - DASHPOT), maxwell, rtol=1e-14)
    foot = k + 1j * w * c
    absorber = -(w**2) * m * foot / (foot - w**2 * m)
    np.testing.assert_allclose(stiffness((SPRING | DASHPOT) - MASS), absorber, rtol=1e-12)
    rubber = 1e4 * (w / (2 * np.pi * 30.0)) ** 0.4 * np.exp(0.2j * np.pi)
    np.testing.assert_allclose(stiffness(RUBBER), rubber, rtol=1e-14)


def test_order_and_grouping_are_of_no_consequence():
    one = SPRING | (DASHPOT | MASS)
    other = (MASS | SPRING) | DASHPOT
    assert one.tree() == ["|", "k", "c", "m"]
    np.testing.assert_allclose(stiffness(one), stiffness(other), rtol=1e-14)
    np.testing.assert_allclose(stiffness(SPRING - MASS), stiffness(MASS - SPRING), rtol=1e-14)


@pytest.mark.parametrize("order", [0.0, 0.5, 1.0])
def test_a_springpot_has_limits_and_slopes(order):
    at_rest = Springpot(2.0, order).dynamic_stiffness(jnp.zeros(1))[0]
    np.testing.assert_allclose(at_rest, 2.0 if order == 0 else 0.0, atol=1e-140)
    slope = jax.grad(lambda n: jnp.abs(Springpot(2.0, n).dynamic_stiffness(OMEGA)).sum())(order)
    step = 1e-6
    ends = [np.abs(stiffness(Springpot(2.0, order + side * step))).sum() for side in (-1, 1)]
    np.testing.assert_allclose(slope, (ends[1] - ends[0]) / (2 * step), rtol=1e-6)


def test_unknown_numbers_are_named_by_their_place_in_the_network():
    law = Spring(dist.LogUniform(1.0, 2.0)) - Dashpot(dist.Uniform(0.0, 1.0))
    assert [unknown.name for unknown in unknowns(law)] == [
        "parts.1.stiffness",
        "parts.2.viscosity",
    ]
    assert [unknown.unit for unknown in unknowns(law)] == ["N/m", "N s/m"]
    assert repr(law) == "Spring(LogUniform(1, 2)) - Dashpot(Uniform(0, 1))"


def test_a_resonance_of_what_hangs_there_holds_the_port():
    numerator, denominator = (Spring(4.0) - Mass(1.0)).fraction(jnp.array([2.0]))
    assert denominator == 0.0
    assert numerator != 0.0


@pytest.mark.parametrize("make", [lambda: SPRING | 3.0, lambda: SPRING - "mass"])
def test_only_laws_make_a_network(make):
    with pytest.raises(InputError, match="two laws or more are needed"):
        make()


def test_every_law_is_final_or_abstract():
    kinds = [type(law) for law in NETWORKS.values()]
    assert all(issubclass(kind, Law) and not kind.__subclasses__() for kind in kinds)


def test_a_table_has_its_values_and_means_between_them():
    at = stiffness(TABLE, jnp.asarray(2 * np.pi * LINES))
    np.testing.assert_allclose(at, TABLE.stiffness, rtol=1e-12)
    middle = np.sqrt(LINES[:-1] * LINES[1:])
    omega = jnp.asarray(2 * np.pi * middle)
    between = stiffness(TABLE, omega)
    np.testing.assert_allclose(between, (at[:-1] + at[1:]) / 2, rtol=1e-12)
    np.testing.assert_allclose(between, stiffness(RUBBER, omega), rtol=5e-3)


def test_a_table_times_a_strength():
    stronger = Tabulated(LINES, TABLE.stiffness, strength=3.0)
    np.testing.assert_allclose(stiffness(stronger), 3 * stiffness(TABLE), rtol=1e-14)
    perhaps = dist.LogUniform(0.5, 2.0) * TABLE
    assert repr(perhaps) == "LogUniform(0.5, 2) * Tabulated(12 lines, 2 to 200 Hz)"
    assert [unknown.unit for unknown in unknowns(perhaps)] == ["1"]


def test_a_table_is_read_off_the_axis_at_the_same_frequency():
    np.testing.assert_array_equal(stiffness(TABLE, OMEGA - 2.0j), stiffness(TABLE))


def test_a_table_is_held_beyond_its_ends_in_compiled_functions_alone():
    far = jnp.asarray([2 * np.pi * 500.0])
    np.testing.assert_allclose(jax.jit(TABLE.dynamic_stiffness)(far)[0], TABLE.stiffness[-1])
    with pytest.raises(InputError, match="a table from 500 to 500 Hz is needed"):
        TABLE.dynamic_stiffness(far)


@pytest.mark.parametrize(
    ("lines", "values"),
    [([1.0], [1.0]), ([1.0, 2.0], [1.0]), ([2.0, 1.0], [1.0, 1.0]), ([1.0, 2.0], [1.0, np.nan])],
)
def test_a_table_that_tells_nothing_is_refused(lines, values):
    with pytest.raises(InputError, match="two lines or more are needed"):
        Tabulated(lines, values)
