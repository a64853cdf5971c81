"""Bars and beams of unit length, by their two ends: bending modes and Green's functions.

Blevins, Formulas for Natural Frequency and Mode Shape, 1979.
Stakgold, Green's Functions and Boundary Value Problems, chapter 3 (modified Green's functions:
inertia relief of rigid-body modes).
"""

import functools
import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial import polynomial
from scipy.linalg import hilbert, null_space

# Terms of a shape: 1, x, cos bx, sin bx, exp(-bx), exp(-b(1-x)). Two decaying exponentials
# instead of cosh and sinh keep every number of order one, however high the mode.


def _sech(b: float) -> float:
    return 2 * np.exp(-b) / (1 + np.exp(-2 * b))


_EQUATIONS: dict[frozenset[str], Callable[[float], float]] = {
    frozenset({"fixed"}): lambda b: np.cos(b) - _sech(b),
    frozenset({"free"}): lambda b: np.cos(b) - _sech(b),
    frozenset({"fixed", "free"}): lambda b: np.cos(b) + _sech(b),
    frozenset({"pinned"}): np.sin,
    frozenset({"guided"}): np.sin,
    frozenset({"pinned", "guided"}): np.cos,
    frozenset({"fixed", "pinned"}): lambda b: np.sin(b) - np.cos(b) * np.tanh(b),
    frozenset({"free", "pinned"}): lambda b: np.sin(b) - np.cos(b) * np.tanh(b),
    frozenset({"fixed", "guided"}): lambda b: np.sin(b) + np.cos(b) * np.tanh(b),
    frozenset({"free", "guided"}): lambda b: np.sin(b) + np.cos(b) * np.tanh(b),
}

_RIGID = {
    frozenset({"free"}): ((1.0, 0.0), (-0.5, 1.0)),
    frozenset({"guided"}): ((1.0, 0.0),),
    frozenset({"free", "guided"}): ((1.0, 0.0),),
}


def rigid_shapes(left: str, right: str) -> list[np.ndarray]:
    """Coefficients of the rigid-body modes, each of unit mean square."""
    lines = _RIGID.get(frozenset({left, right}), ())
    if {left, right} == {"free", "pinned"}:
        lines = ((0.0, 1.0),) if left == "pinned" else ((1.0, -1.0),)
    padded = [np.array([*line, 0.0, 0.0, 0.0, 0.0]) for line in lines]
    mean_square = np.array([[1, 1 / 2], [1 / 2, 1 / 3]])
    return [line / np.sqrt(line[:2] @ mean_square @ line[:2]) for line in padded]


def elastic_roots(left: str, right: str, count: int) -> np.ndarray:
    """First positive roots of the frequency equation of a uniform beam of unit length."""
    from scipy.optimize import brentq  # it takes long to import

    equation = _EQUATIONS[frozenset({left, right})]
    # Roots lie about pi apart, so a grid of an eighth of that cannot step over two of them.
    grid = 0.5 + np.arange(8 * (count + 2)) * np.pi / 8
    values = np.array([equation(b) for b in grid])
    change = np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))
    roots = [brentq(equation, grid[i], grid[i + 1], xtol=1e-14, rtol=1e-15) for i in change]
    return np.array(roots[:count])


def elastic_shape(left: str, right: str, root: float) -> np.ndarray:
    """Coefficients of the shape at a root, of unit mean square and positive near the left end."""
    rows = [_condition(0.0, order, root) for order in VANISHING[2][left]]
    rows += [_condition(1.0, order, root) for order in VANISHING[2][right]]
    null_vector = np.linalg.svd(np.array(rows))[2][-1]
    shape = _normalised(np.concatenate([[0.0, 0.0], null_vector]), root)
    return shape * np.sign(_condition(0.1 / root, 0, root) @ shape[2:])


def _condition(x: float, order: int, b: float) -> np.ndarray:
    """Scaled derivative of cos, sin and the two exponentials at a place."""
    phase = order * np.pi / 2
    sign = (-1.0) ** order
    return np.array(
        [np.cos(b * x + phase), np.sin(b * x + phase), sign * np.exp(-b * x), np.exp(-b * (1 - x))]
    )


def _normalised(shape: np.ndarray, b: float) -> np.ndarray:
    # For any two ends, 4 times the mean square of a solution of u'''' = b^4 u is, at x = 1, u^2 -
    # 2 u' u''' / b^4 + (u'' / b^2)^2: integrate by parts.
    deflection, slope, moment, shear = (_condition(1.0, order, b) @ shape[2:] for order in range(4))
    return shape * 2 / np.sqrt(deflection**2 - 2 * slope * shear + moment**2)


# Orders of the derivatives that vanish at each kind of end: of a bar (half the order of its
# differential equation is 1) and of a beam (2).
VANISHING: dict[int, dict[str, tuple[int, ...]]] = {
    1: {"fixed": (0,), "free": (1,)},
    2: {"fixed": (0, 1), "pinned": (0, 2), "free": (2, 3), "guided": (1, 3)},
}

Ends = tuple[str, str]


def green(
    half_order: int,
    ends: Ends,
    x: Float[Array, ""],
    y: Float[Array, ""],
    distance: Float[Array, ""],
    orders: tuple[int, int] = (0, 0),
    power: int = 1,
) -> Float[Array, ""]:
    """Derivative of a Green's function in x and y, without its delta functions.

    Of half order 1 it is that of -u'' = f (bar), of 2 that of u'''' = f (beam), in unit length and
    stiffness. The distance is x - y, given separately so that rounding leaves it zero where both
    are the same; where a derivative jumps, at zero, it is the mean of both sides. Of power 1 it is
    the sum over elastic modes of psi psi / b^(2 half_order), of 2 that over the squares of the
    denominators: the Green's function applied twice.
    """
    smooth = polynomial.polyder(_smooth_part(half_order, ends, power), orders[0], axis=0)
    smooth = polynomial.polyder(smooth, orders[1], axis=1)
    rows, columns = smooth.shape
    return _powers(x, rows) @ smooth @ _powers(y, columns) + _kink(
        distance, half_order, orders, power
    )


def _powers(x: Float[Array, ""], count: int) -> Float[Array, "power"]:
    powers = [jnp.ones_like(x)]
    for _ in range(count - 1):
        powers.append(powers[-1] * x)
    return jnp.stack(powers)


def _kink(
    distance: Float[Array, ""], half_order: int, orders: tuple[int, int], power: int
) -> Array | float:
    """Derivative of (-1)^(half order) |x - y|^q / (2 q!), what a point force leaves unsmooth."""
    degree = 2 * half_order * power - 1 - sum(orders)
    if degree < 0:
        return 0.0
    sign = (-1) ** (half_order * power + orders[1])
    return sign / 2 * jnp.sign(distance) * distance**degree / math.factorial(degree)


@functools.cache
def _smooth_part(half_order: int, ends: Ends, power: int) -> np.ndarray:
    """Coefficients A_ij of x^i y^j of a Green's function less its kink, symmetric."""
    size = 2 * half_order * power + half_order
    rigid = _rigid(half_order, ends, size)
    # The identity less rigid motion is the power zero: a delta function, and this.
    one_sided = -rigid.T @ rigid
    for step in range(1, power + 1):
        one_sided = _solved(one_sided, half_order, ends, step, rigid)
    sign = (-1) ** (half_order * power)
    # (x - y)_+^q = (|x - y|^q + (x - y)^q) / 2 for odd q.
    smooth = one_sided + sign / 2 * _difference_power(2 * half_order * power - 1, size)
    return (smooth + smooth.T) / 2


def _solved(
    load: np.ndarray, half_order: int, ends: Ends, power: int, rigid: np.ndarray
) -> np.ndarray:
    """Solve for the polynomial part of the next power, with the end conditions and no rigid motion.

    All parts but the polynomial one are sign (x - y)_+^q / q!, which is zero at the left end.
    """
    size, order = len(load), 2 * half_order
    sign, degree = (-1) ** (half_order * power), order * power - 1
    polynomial_part = (-1) ** half_order * polynomial.polyint(load, order, axis=0)[:size]
    unmet = _conditions(half_order, ends, size) @ polynomial_part
    for row, (position, derivative) in enumerate(_end_conditions(half_order, ends)):
        unmet[row] += position * sign * _complement_power(degree - derivative, size)
    polynomial_part[:order] -= np.linalg.lstsq(_conditions(half_order, ends, order), unmet)[0]
    for shape in rigid:
        # The integral of shape(x) (x - y)_+^q / q! is the shape integrated q + 1 times from 1.
        kinked = sign * polynomial.polyint(shape, degree + 1, lbnd=1)[:size]
        projection = shape @ hilbert(size) @ polynomial_part + kinked
        polynomial_part -= np.outer(shape, projection)
    return polynomial_part


def _end_conditions(half_order: int, ends: Ends) -> list[tuple[int, int]]:
    """Position, 0 or 1, and order of each derivative that vanishes."""
    kinds = VANISHING[half_order]
    return [(position, order) for position, end in enumerate(ends) for order in kinds[end]]


def _conditions(half_order: int, ends: Ends, size: int) -> np.ndarray:
    """Matrix from the coefficients of a polynomial to its derivatives that vanish."""
    derivatives = [
        polynomial.polyval(position, polynomial.polyder(np.eye(size), order, axis=0))
        for position, order in _end_conditions(half_order, ends)
    ]
    return np.array(derivatives)


def _rigid(half_order: int, ends: Ends, size: int) -> np.ndarray:
    """Straight lines that meet every end condition, orthonormal in mass."""
    order = 2 * half_order
    free = null_space(_conditions(half_order, ends, order)).T
    orthonormal = np.linalg.solve(np.linalg.cholesky(free @ hilbert(order) @ free.T), free)
    return np.pad(orthonormal, ((0, 0), (0, size - order)))


def _complement_power(degree: int, size: int) -> np.ndarray:
    """Coefficients of (1 - y)^degree / degree!."""
    powers = polynomial.polypow([1.0, -1.0], degree, None) / math.factorial(degree)
    return np.pad(powers, (0, size - degree - 1))


def _difference_power(degree: int, size: int) -> np.ndarray:
    """Coefficients of (x - y)^degree / degree!."""
    coefficients = np.zeros((size, size))
    for i in range(degree + 1):
        j = degree - i
        coefficients[i, j] = (-1) ** j / (math.factorial(i) * math.factorial(j))
    return coefficients
