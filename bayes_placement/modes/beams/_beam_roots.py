"""Wave numbers and shape coefficients of a beam of unit length, by its two ends.

Blevins, Formulas for Natural Frequency and Mode Shape, 1979.
"""

from collections.abc import Callable

import numpy as np

from ._beam_statics import VANISHING

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
    return shape * np.sign(terms(np.array([0.1 / root]), root) @ shape)


def _condition(x: float, order: int, b: float) -> np.ndarray:
    """Scaled derivative of cos, sin and the two exponentials at an end."""
    phase = order * np.pi / 2
    sign = (-1.0) ** order
    return np.array(
        [np.cos(b * x + phase), np.sin(b * x + phase), sign * np.exp(-b * x), np.exp(-b * (1 - x))]
    )


def terms(x: np.ndarray, b: float) -> np.ndarray:
    """Six terms of a shape at positions x in [0, 1]."""
    constant = np.ones_like(x)
    waves = [np.cos(b * x), np.sin(b * x), np.exp(-b * x), np.exp(-b * (1 - x))]
    return np.stack([constant, x, *waves], axis=-1)


def _normalised(shape: np.ndarray, b: float) -> np.ndarray:
    # For any two ends, 4 times the mean square of a solution of u'''' = b^4 u is, at x = 1, u^2 -
    # 2 u' u''' / b^4 + (u'' / b^2)^2: integrate by parts.
    deflection, slope, moment, shear = (_condition(1.0, order, b) @ shape[2:] for order in range(4))
    return shape * 2 / np.sqrt(deflection**2 - 2 * slope * shear + moment**2)
