"""Slopes of complex residuals that are mostly zero, beside the same in full."""

import numpy as np
import pytest

from bayes_placement.criticism.reach._slopes import Slopes, Sparsity

POINTS, UNKNOWNS, CHANNELS, LINES = 3, 6, 4, 5


def made(complex_parts):
    """Two unknowns that change all, and one for each channel; and the slopes along each."""
    random = np.random.default_rng(0)
    changes = np.zeros((UNKNOWNS, CHANNELS, LINES, complex_parts), dtype=bool)
    changes[:2] = True
    changes[2:] = np.eye(CHANNELS, dtype=bool)[..., None, None]
    parts = random.standard_normal((complex_parts, POINTS, 3, CHANNELS, LINES))
    along = parts[0] + (1j * parts[1] if complex_parts == 2 else 0.0)
    group = np.array([0, 1, 2, 2, 2, 2])
    return Slopes(along, Sparsity(group, changes)), along[:, group] * changes.any(axis=-1)


@pytest.mark.parametrize("complex_parts", [1, 2])
def test_products_are_those_in_full(complex_parts):
    slopes, full = made(complex_parts)
    other = full[:, 0] + 0.3 * full[:, 1]
    pulls, squares = slopes.products(other)
    np.testing.assert_allclose(pulls, np.einsum("pucf,pcf->pu", full.conj(), other).real)
    expected = np.einsum("pucf,pvcf->puv", full, full.conj()).real
    np.testing.assert_allclose(squares, expected, atol=1e-12)
    crossed = np.einsum("pucf,pcf->puf", full, other.conj())
    np.testing.assert_allclose(slopes.crossed(other), crossed, atol=1e-12)
    fewer = slopes.at_lines(np.array([1, 3]), 2.0).products(other[..., [1, 3]])[0]
    lines = full[..., [1, 3]].conj()
    np.testing.assert_allclose(fewer, 2 * np.einsum("pucf,pcf->pu", lines, other[..., [1, 3]]).real)


def test_parts_of_one_number_may_be_of_two_unknowns():
    """As those of an earlier state with other lines: the real part of one sensor, the other's."""
    changes = np.eye(2, dtype=bool)[:, None, None]
    slopes = Slopes(np.array([[[[3.0 + 4.0j]]]]), Sparsity(np.array([0, 0]), changes))
    pulls, squares = slopes.products(np.array([[[1.0 + 1.0j]]]))
    np.testing.assert_array_equal(pulls, [[3.0, 4.0]])
    np.testing.assert_array_equal(squares, [[[9.0, 0.0], [0.0, 16.0]]])
