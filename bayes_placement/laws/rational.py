"""Numbers of a network from a measured quotient of polynomials: a start that knows its resonances.

The dynamic stiffness of springs, dashpots and masses is N(s) / D(s), s = i omega. Coefficients
follow from least squares that are linear, weighted with the last denominator (Sanathanan and
Koerner, IEEE Trans. Autom. Control 8 (1963) 56, doi:10.1109/TAC.1963.1105517), and the elements
from the coefficients, which are sums of products of them.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from .law import Tree
from .rows import ELEMENTS_OF_ROW, POWERS, form_of

Polynomial = Mapping[int, tuple[tuple[int, ...], ...]]
"""Of each power of s, products of elements [product, element] whose sum is its coefficient."""

WEIGHTINGS, NEWTON = 4, 12
"""Rounds of weighting, and steps from coefficients to elements."""

Lines = Complex[np.ndarray, "place frequency"]
"""A complex number at each line of each place."""


class Rational(NamedTuple):
    """A network as a quotient of polynomials."""

    numerator: Polynomial
    denominator: Polynomial
    """Its polynomials in s."""
    elements: int
    """Number of its elements."""

    @property
    def products(self) -> list[tuple[tuple[int, ...], ...]]:
        """Products of elements of every coefficient, those of the numerator first."""
        return [*self.numerator.values(), *self.denominator.values()]

    def numbers(
        self,
        strength: Lines,
        receptance: Lines,
        weight: Float[np.ndarray, "place frequency"],
        s: Complex[np.ndarray, "frequency"],
        is_cut: bool,
    ) -> Float[np.ndarray, "place element"]:
        """Natural logarithms of the elements, sizes at abs(s) = 1; NaN where none are positive.

        The strength is the measured t at each line, N / (D + h N), of a cut D / (N + h D); its
        weight is one over its deviation. The receptance is that of the port, h, of a cut the
        dynamic stiffness against opening it; s is i omega over a frequency in the middle.
        """
        held = strength * receptance - 1
        of_numerator, of_denominator = (strength, held) if is_cut else (held, strength)
        columns = [of_numerator * s**power for power in self.numerator]
        columns += [of_denominator * s**power for power in self.denominator]
        design = np.stack(columns, axis=-1)
        weighted = weight[..., None] * design
        count = len(self.numerator)
        powers = np.array([*self.numerator, *self.denominator])
        for _ in range(WEIGHTINGS):
            coefficients = _null_vector(weighted)
            terms = coefficients[:, None] * s[:, None] ** powers
            above, below = terms[..., :count].sum(-1), terms[..., count:].sum(-1)
            moving = above + receptance * below if is_cut else below + receptance * above
            size = np.abs(moving) + 1e-9 * np.abs(moving).max(axis=1, keepdims=True) + 1e-300
            weighted = (weight / size)[..., None] * design
        return _elements(coefficients, self.products, self.elements)


def rational(tree: Tree) -> Rational | None:
    """Return a network of springs, dashpots and masses as a quotient; None of other elements."""
    signs, letters = form_of(tree)
    present = [letter for letter in letters if letter]
    if not set(present) <= {"k", "c", "m"}:
        return None
    whole: tuple[_Sums, _Sums] | None = None
    for place, (sign, letter) in enumerate(zip(("|", *signs), present, strict=False)):
        alone = tuple(int(place == other) for other in range(ELEMENTS_OF_ROW))
        part = {POWERS[letter]: Counter([alone])}, {0: Counter([(0,) * ELEMENTS_OF_ROW])}
        whole = part if whole is None else _joined(whole, part, sign)
    assert whole is not None
    least = min(min(polynomial) for polynomial in whole)
    above, below = (
        {power - least: tuple(sums.elements()) for power, sums in polynomial.items()}
        for polynomial in whole
    )
    return Rational(above, below, len(present))


_Sums = dict[int, Counter[tuple[int, ...]]]


def _joined(one: tuple[_Sums, _Sums], other: tuple[_Sums, _Sums], sign: str) -> tuple[_Sums, _Sums]:
    """Numerator and denominator of two parts, in parallel or in series."""
    crossed = _sum(_product(one[0], other[1]), _product(other[0], one[1]))
    if sign == "|":
        return crossed, _product(one[1], other[1])
    return _product(one[0], other[0]), crossed


def _sum(one: _Sums, other: _Sums) -> _Sums:
    total: _Sums = defaultdict(Counter)
    for polynomial in (one, other):
        for power, sums in polynomial.items():
            total[power] += sums
    return dict(total)


def _product(one: _Sums, other: _Sums) -> _Sums:
    total: _Sums = defaultdict(Counter)
    for power, sums in one.items():
        for further, others in other.items():
            for left in sums.elements():
                for right in others.elements():
                    total[power + further][tuple(map(sum, zip(left, right, strict=True)))] += 1
    return dict(total)


def _null_vector(weighted: np.ndarray) -> np.ndarray:
    """Real coefficients [place, coefficient] of the least sum of squares, of positive sum."""
    size = np.sqrt(np.sum(np.abs(weighted) ** 2, axis=1)) + 1e-300
    scaled = weighted / size[:, None]
    gram = np.real(np.einsum("pfi,pfj->pij", np.conj(scaled), scaled))
    least = np.linalg.eigh(np.nan_to_num(gram))[1][:, :, 0]
    return least * np.sign(np.sum(least, axis=1, keepdims=True) + 1e-300) / size


def _elements(
    coefficients: np.ndarray, products: list[tuple[tuple[int, ...], ...]], count: int
) -> np.ndarray:
    """Logarithms of the elements [place, element]; their products sum to c times coefficients."""
    with np.errstate(invalid="ignore", divide="ignore"):
        wanted = np.log(coefficients)  # NaN where none of this sign exist
    exponents = [np.array(each, float)[:, :count] for each in products]
    sizes = np.zeros((len(wanted), count + 1))  # the factor is the last one
    for _ in range(NEWTON):
        logs, slopes = zip(*(_log_sum(sizes[:, :count], each) for each in exponents), strict=True)
        left = wanted - np.stack(logs, axis=-1) - sizes[:, count:]
        along = np.stack(slopes, axis=1)
        along = np.concatenate([along, np.ones((*along.shape[:2], 1))], axis=2)
        normal = np.einsum("pci,pcj->pij", along, along) + 1e-9 * np.eye(count + 1)
        pull = np.einsum("pci,pc->pi", along, np.nan_to_num(left))
        sizes = sizes + np.clip(np.linalg.solve(normal, pull[..., None])[..., 0], -5.0, 5.0)
    is_known = np.isfinite(wanted).all(axis=1)
    return np.where(is_known[:, None], sizes[:, :count], np.nan)


def _log_sum(sizes: np.ndarray, exponents: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm of a sum of products, and its slopes along the logarithms of their factors."""
    logs = sizes @ exponents.T
    largest = logs.max(axis=1, keepdims=True)
    shares = np.exp(logs - largest)
    total = shares.sum(axis=1, keepdims=True)
    return (largest + np.log(total))[:, 0], (shares / total) @ exponents
