"""Networks of at most three elements as rows of arrays, and a start that knows resonances.

A row is (first o second) o third, each o in parallel or in series; an element that is not there
changes nothing. All irreducible networks of at most three elements have this form.

The start is a measured quotient of polynomials. The dynamic stiffness of springs, dashpots and
masses is N(s) / D(s), s = i omega. Coefficients follow from least squares that are linear, weighted
with the last denominator (Sanathanan and Koerner, IEEE Trans. Autom. Control 8 (1963) 56,
doi:10.1109/TAC.1963.1105517), and the elements from the coefficients, which are sums of products.
"""

import itertools
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpyro.distributions import LogNormal, Uniform
from scipy.special import ndtr

from .._shared.dimensions import Parameter
from .catalogue import ELEMENTS, GROUPS
from .law import Law, Tree

ELEMENTS_OF_ROW = 3
"""Most elements of a network."""

NUMBERS = 2 * ELEMENTS_OF_ROW
"""Coordinates of a row: the size of each element, then the order or loss factor of each."""

DECADES, LOSS, DECADES_OF_LOSS = 2.0, 0.1, 1.0
"""Priors: deviation of the logarithm of a size in decades; median and deviation of a loss."""

LOGARITHM = DECADES * float(np.log(10.0))
"""Natural logarithm of a size along its coordinate."""

POWERS = {"k": 0, "c": 1, "m": 2, "h": 0, "p": 0}
"""Power of i omega in the dynamic stiffness of an element; that of a springpot is unknown."""

Points = Float[np.ndarray, "row coordinate"]
"""Standard normal coordinates of the numbers of each row."""

Which = Int[np.ndarray, "row"]
"""Number of the network of each row."""

Numbers = Sequence[Parameter]
Flags = Bool[np.ndarray, "row"]
Omega = Float[np.ndarray, "frequency"]
OfElements = Complex[np.ndarray, "row element frequency"]

Stiffness = Complex[np.ndarray, "row frequency"]
"""Dynamic stiffness of each row at each line."""

Slopes = Complex[np.ndarray, "row coordinate frequency"]
"""Its slopes along the coordinates."""


class NetworkRows:
    """Networks of at most three elements as arrays, with priors about one size.

    The size [N/m] is the median stiffness of an element at the middle [rad/s] of the band.
    """

    def __init__(self, trees: Sequence[Tree], size: float, middle: float):
        self.trees = list(trees)
        self.size, self.middle = size, middle
        forms = [form_of(tree) for tree in trees]
        self._series = np.array([[sign == "-" for sign in signs] for signs, _ in forms])
        letters = np.array([row for _, row in forms]).reshape(-1, ELEMENTS_OF_ROW)
        self._present, self._pot, self._lossy = letters != "", letters == "p", letters == "h"
        self._power = np.array([[float(POWERS.get(e, 0)) for e in row] for row in letters])

    def at_lines(self, which: Which, points: Points, omega: Omega) -> tuple[Stiffness, Slopes]:
        """Dynamic stiffness of rows at lines [rad/s], and its slopes along their coordinates."""
        elastic, elements = self._elements(which, points, omega)
        series, present = self._series[which], self._present[which]
        first, second, third = elements.swapaxes(0, 1)
        pair, of_first, of_second = _with_slopes(first, second, series[:, 0], present[:, 1])
        whole, of_pair, of_third = _with_slopes(pair, third, series[:, 1], present[:, 2])
        of_each = np.stack([of_pair * of_first, of_pair * of_second, of_third], axis=1)
        along = self._along_other(which, points, elastic, omega)
        return whole, np.concatenate([of_each * (LOGARITHM * elements), of_each * along], axis=1)

    def stiffness(self, which: Which, points: Points, omega: Omega) -> Stiffness:
        """Dynamic stiffness of rows alone, see `at_lines`."""
        _, elements = self._elements(which, points, omega)
        series, present = self._series[which], self._present[which]
        first, second, third = elements.swapaxes(0, 1)
        pair = _joined(first, second, series[:, 0], present[:, 1])
        return _joined(pair, third, series[:, 1], present[:, 2])

    def _elements(
        self, which: Which, points: Points, omega: Omega
    ) -> tuple[OfElements, OfElements]:
        """Dynamic stiffness of each element, without its loss and with it."""
        size, other = points[:, :ELEMENTS_OF_ROW], points[:, ELEMENTS_OF_ROW:]
        pot = self._pot[which]
        order = np.where(pot, ndtr(other), self._power[which])
        # Real powers of the lines, and one complex number for each element: no power of a complex
        # number at each line. Those of whole order are few, and computed once.
        ratio = omega / self.middle
        rise = (ratio ** np.arange(3.0)[:, None])[self._power[which].astype(int)]
        rise[pot] = ratio ** order[pot][:, None]
        scale = self.size * np.exp(LOGARITHM * size + 0.5j * np.pi * order)
        loss = np.where(self._lossy[which], 1 + 1j * _loss(other), 1.0)
        return scale[..., None] * rise, (scale * loss)[..., None] * rise

    def _along_other(
        self, which: Which, points: Points, elastic: OfElements, omega: Omega
    ) -> OfElements:
        """Slopes of the elements along their other number: an order, or a loss factor."""
        other = points[:, ELEMENTS_OF_ROW:]
        density = np.exp(-0.5 * other**2) / np.sqrt(2 * np.pi)
        of_loss = self._lossy[which] * (1j * DECADES_OF_LOSS * np.log(10.0)) * _loss(other)
        along = elastic * of_loss[..., None]
        row, place = np.nonzero(self._pot[which])
        logarithm = np.log(1j * omega / self.middle)
        along[row, place] = elastic[row, place] * logarithm * density[row, place][:, None]
        return along

    def law(self, number: int, point: Float[np.ndarray, "coordinate"]) -> Law:
        """Law of a network at coordinates, its numbers plain."""
        sizes = self.size * 10 ** (DECADES * point[:ELEMENTS_OF_ROW])
        others = point[ELEMENTS_OF_ROW:]
        loss = LOSS * 10 ** (DECADES_OF_LOSS * others)
        return self._law(number, *(each.tolist() for each in (sizes, ndtr(others), loss)))

    def prior(self, number: int) -> Law:
        """Law of a network whose numbers are distributions."""
        step = LOGARITHM
        sizes = [LogNormal(float(np.log(self.size)), step)] * ELEMENTS_OF_ROW
        loss = LogNormal(float(np.log(LOSS)), DECADES_OF_LOSS * float(np.log(10.0)))
        return self._law(number, sizes, [Uniform(0.0, 1.0)] * 3, [loss] * ELEMENTS_OF_ROW)

    def _law(self, number: int, sizes: Numbers, orders: Numbers, losses: Numbers) -> Law:
        signs, letters = form_of(self.trees[number])
        law: Law | None = None
        for sign, letter, *numbers in zip(
            ("|", *signs), letters, sizes, orders, losses, strict=True
        ):
            if letter:
                element = self._element(letter, *numbers)
                law = element if law is None else GROUPS[sign]((law, element))
        assert law is not None
        return law

    def _element(self, letter: str, size: Parameter, order: Parameter, loss: Parameter) -> Law:
        kind = ELEMENTS[letter][0]
        if letter == "p":
            return kind(size, order, self.middle / (2 * np.pi))
        if letter == "h":
            return kind(size, loss)
        return kind(_shared_out(size, self.middle ** POWERS[letter]))


def coordinates_of_numbers(tree: Tree) -> list[int]:
    """Coordinates of a row in the order of the numbers of its law."""
    _, letters = form_of(tree)
    columns = []
    for place, letter in enumerate(letters):
        columns += [place] if letter else []
        columns += [ELEMENTS_OF_ROW + place] if letter in ("p", "h") else []
    return columns


def _shared_out(size: Parameter, by: float) -> Parameter:
    """A size, or its distribution, over a number."""
    return (
        LogNormal(size.loc - np.log(by), size.scale) if isinstance(size, LogNormal) else size / by
    )


def _loss(other: Float[np.ndarray, "row element"]) -> Float[np.ndarray, "row element"]:
    """Loss factors at coordinates."""
    return LOSS * np.exp(DECADES_OF_LOSS * np.log(10.0) * other)


def _joined(one: Stiffness, other: Stiffness, series: Flags, present: Flags) -> Stiffness:
    """Dynamic stiffness of two parts; of one if alone."""
    whole = np.array(one)
    parallel, chain = present & ~series, present & series
    whole[parallel] += other[parallel]
    whole[chain] *= _share(other[chain], one[chain])
    return whole


def _with_slopes(
    one: Stiffness, other: Stiffness, series: Flags, present: Flags
) -> tuple[Stiffness, Stiffness, Stiffness]:
    """The same, and its slopes along the dynamic stiffness of each part."""
    of_one, of_other = np.ones_like(one), np.zeros_like(one)
    of_other[present] = 1.0
    chain = present & series
    of_one[chain] = _share(other[chain], one[chain]) ** 2
    of_other[chain] = _share(one[chain], other[chain]) ** 2
    return _joined(one, other, series, present), of_one, of_other


def _share(one: Stiffness, other: Stiffness) -> Stiffness:
    """Share of one part in the sum of two in series; of a resonance without damping finite."""
    total = one + other
    return one / np.where(total == 0, 1.0, total)


def form_of(tree: Tree) -> tuple[tuple[str, str], list[str]]:
    """Both signs and three letters of a network; empty letters where it has fewer elements."""
    if isinstance(tree, str):
        return ("|", "|"), [tree, "", ""]
    sign, *parts = tree
    groups = [part for part in parts if not isinstance(part, str)]
    letters = [part for part in parts if isinstance(part, str)]
    if groups:
        return (groups[0][0], sign), [*groups[0][1:], *letters]
    return (sign, sign), [*letters, ""][:ELEMENTS_OF_ROW]


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
        whole = part if whole is None else _joined_polynomials(whole, part, sign)
    assert whole is not None
    least = min(min(polynomial) for polynomial in whole)
    above, below = (
        {power - least: tuple(sums.elements()) for power, sums in polynomial.items()}
        for polynomial in whole
    )
    return Rational(above, below, len(present))


_Sums = dict[int, Counter[tuple[int, ...]]]


def _joined_polynomials(
    one: tuple[_Sums, _Sums], other: tuple[_Sums, _Sums], sign: str
) -> tuple[_Sums, _Sums]:
    """Numerator and denominator of two parts, in parallel or in series."""
    crossed = _products((one[0], other[1]), (other[0], one[1]))
    if sign == "|":
        return crossed, _products((one[1], other[1]))
    return _products((one[0], other[0])), crossed


def _products(*pairs: tuple[_Sums, _Sums]) -> _Sums:
    """Sum of products of two polynomials each."""
    total: _Sums = defaultdict(Counter)
    for one, other in pairs:
        for (power, sums), (further, others) in itertools.product(one.items(), other.items()):
            for left, right in itertools.product(sums.elements(), others.elements()):
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
