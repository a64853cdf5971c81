"""Networks of at most three elements as rows of arrays: many laws evaluated at once.

A row is (first o second) o third, each o in parallel or in series; an element that is not there
changes nothing. All irreducible networks of at most three elements have this form.
"""

from collections.abc import Sequence

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
