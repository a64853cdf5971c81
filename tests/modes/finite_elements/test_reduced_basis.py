"""Reduced bases compared with full solutions, also for repeated modes and free structures."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array

from bayes_placement.modes.finite_elements.matrices import Matrices, _reduced_basis
from bayes_placement.modes.finite_elements.matrices._reduced_basis import Affine, RitzSpan
from tests.small_models import Plate, solid

SIDE = 0.3


@pytest.fixture(scope="module")
def square():
    plate = Plate((8, 8), (SIDE, SIDE))
    parts = {
        "corner": plate.part(lambda x, y: (x < SIDE / 2) & (y < SIDE / 2)),
        "strip": plate.part(lambda x, y: (x > SIDE / 2) & (y > 0)),
    }
    return Matrices(**plate.model(), regions=parts)


@pytest.fixture(scope="module")
def affine(square):
    box = {"corner": (0.5, 1.5), "strip": (0.7, 1.3), "density": (0.9, 1.1)}
    return Affine(square.regions, {"density": square.mass}, box)


@pytest.fixture(scope="module")
def limit(square):
    """Between repeated modes: (1, 3) and (3, 1) are the fifth and the sixth."""
    return 1.01 * square.modes(count=6).natural_frequency[-1]


@pytest.fixture(scope="module")
def basis(square, affine, limit):
    return square.reduced_basis(affine, up_to=limit)


def full(model, affine, factors):
    """Natural frequencies [Hz] by a dense solution."""
    stiffness = model.stiffness + sum((factors[k] - 1) * v for k, v in affine.stiffness.items())
    mass = model.mass + sum((factors[k] - 1) * v for k, v in affine.mass.items())
    free = np.setdiff1d(np.arange(len(model.dof)), model.fixed)
    pair = [matrix.toarray()[np.ix_(free, free)] for matrix in (stiffness, mass)]
    return np.sqrt(np.maximum(eigh(*pair, eigvals_only=True), 0)) / (2 * np.pi)


def largest_error(model, affine, basis, factors, limit):
    expected = full(model, affine, factors)
    low = slice(basis.rigid_body_modes, max(np.count_nonzero(expected < limit), 1))
    return np.abs(basis.natural_frequency(factors)[low] / expected[low] - 1).max()


def test_natural_frequencies_stay_right_in_the_whole_box(square, affine, basis, limit):
    for factors in affine.random(12, seed=99):
        assert largest_error(square, affine, basis, factors, limit) < 1e-3


def test_nominal_modes_alone_would_not_do(square, affine, limit):
    factors = {"corner": 0.5, "strip": 1.3, "density": 0.9}
    only = RitzSpan.of(square.flexibility, affine.among(square._order))
    only = only.extended(square.modes(up_to=1.5 * limit).shape[square._order])
    expected = full(square, affine, factors)[:6]
    frequencies = np.sqrt(only.ritz(factors, np.inf).eigenvalues[:6]) / (2 * np.pi)
    assert np.abs(frequencies / expected - 1).max() > 2e-3


def test_the_basis_is_mass_orthonormal_and_its_stiffness_diagonal(square, affine, basis):
    shape = basis.basis
    assert (shape[square.fixed] == 0).all()
    size = basis.eigenvalues.size
    assert np.abs(shape.T @ (square.mass @ shape) - np.eye(size)).max() < 1e-10
    largest = basis.eigenvalues[-1]
    stiffness = shape.T @ (square.stiffness @ shape)
    assert np.abs(stiffness - np.diag(basis.eigenvalues)).max() < 1e-10 * largest
    for name, part in affine.stiffness.items():
        projected = shape.T @ (part @ shape)
        assert np.abs(basis.stiffness[name] - projected).max() < 1e-10 * largest
    assert basis.mass["density"] == pytest.approx(np.eye(size), abs=1e-10)


def test_nominal_modes_are_kept_exactly(square, basis, limit):
    nominal = square.modes(up_to=limit).natural_frequency
    assert np.sqrt(basis.eigenvalues[:6]) / (2 * np.pi) == pytest.approx(nominal, rel=1e-9)


def test_the_estimate_is_close_to_the_error_and_above_it(square, affine, limit):
    """Efficiency of the estimate at random points, for a basis that is not yet right."""
    here = affine.among(square._order)
    span = RitzSpan.of(square.flexibility, here)
    span = span.extended(square.modes(up_to=1.5 * limit).shape[square._order])
    ratios = []
    for factors in affine.random(6, seed=5):
        expected = full(square, affine, factors)
        pairs = span.ritz(factors, (2 * np.pi * limit) ** 2)
        known = np.sqrt(pairs.eigenvalues) / (2 * np.pi) / expected[: pairs.eigenvalues.size] - 1
        worst = np.argmax(known)
        ratios.append(pairs.error[worst] / (1 - 1.5**-2) / known[worst])
    assert min(ratios) > 0.9 and max(ratios) < 6.0


def test_factors_of_the_whole_scale_natural_frequencies(square):
    """A thickness: bending stiffness by its cube, mass by itself, each a factor of its own."""
    box = {"bending": (0.7, 1.4), "mass": (0.9, 1.1)}
    affine = Affine({"bending": square.stiffness}, {"mass": square.mass}, box)
    nominal = square.modes(count=4).natural_frequency
    basis = square.reduced_basis(affine, up_to=nominal[-1] * 1.01)
    thickness = 1.05
    frequencies = basis.natural_frequency({"bending": thickness**3, "mass": thickness})
    assert frequencies[:4] == pytest.approx(thickness * nominal, rel=1e-10)
    assert basis.report.vectors == basis.report.nominal_modes


def test_rigid_body_modes_stay_rigid():
    model = Matrices(**solid((6, 2, 2), (1.0, 0.2, 0.15)))
    part = Matrices(**solid((3, 2, 2), (0.5, 0.2, 0.15)))
    place = {tuple(np.round(p, 6)): n for n, p in enumerate(model.position)}
    rows = np.empty(len(part.dof), dtype=int)
    for row, (node, direction) in enumerate(part.dof):
        here = place[tuple(np.round(part.position[node - 1], 6))] + 1
        rows[row] = np.flatnonzero((model.dof == (here, direction)).all(axis=1))[0]
    spread = np.zeros((len(model.dof), rows.size))
    spread[rows, np.arange(rows.size)] = 1.0
    affine = Affine(
        {"root": csr_array(spread @ part.stiffness @ spread.T)},
        {"root": csr_array(spread @ part.mass @ spread.T)},
        {"root": (0.5, 2.0)},
    )
    basis = model.reduced_basis(affine, up_to=3000.0)
    assert basis.rigid_body_modes == 6 and (basis.eigenvalues[:6] == 0).all()
    for value in (0.55, 1.0, 1.9):
        assert (basis.natural_frequency({"root": value})[:6] == 0).all()
        assert largest_error(model, affine, basis, {"root": value}, 3000.0) < 1e-3


def test_the_report_is_a_sentence(basis, limit):
    sentence = str(basis.report)
    assert f"natural frequencies up to {limit:g} Hz are accurate to" in sentence
    assert "corner = " in sentence and "full solutions" in sentence
    assert basis.report.measured.error <= basis.report.tolerance
    assert basis.report.estimated.error <= basis.report.tolerance
    assert basis.report.vectors == basis.eigenvalues.size
    assert basis.report.full_solutions == 8  # the estimate was right at once


def test_modes_that_the_estimate_overlooked_are_added(square, affine, limit, monkeypatch):
    """A blind estimate: full solutions at fresh points find the errors, and reduce them."""
    ritz = RitzSpan.ritz

    def blind(self, factors, up_to):
        pairs = ritz(self, factors, up_to)
        return pairs._replace(error=0 * pairs.error)

    monkeypatch.setattr(RitzSpan, "ritz", blind)
    basis = square.reduced_basis(affine, up_to=limit)
    assert basis.report.full_solutions > 8 and basis.report.measured.error < 1e-3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(box={"corner": (0.5, 1.5)}), r"\['density', 'strip'\] has not both"),
        (dict(stiffness={}, mass={}, box={}), "at least one name"),
        (dict(stiffness={"strip": np.eye(3), "corner": np.eye(3)}), "strip has 3 rows"),
    ],
)
def test_parts_that_do_not_fit_are_refused(square, affine, limit, changes, message):
    with pytest.raises(ValueError, match=message):
        square.reduced_basis(affine._replace(**changes), up_to=limit)


@pytest.mark.parametrize("box", [(0.0, 1.0), (1.2, 0.8), (0.5, np.inf)])
def test_a_box_without_room_is_refused(square, affine, limit, box):
    with pytest.raises(ValueError, match="a least and a greater positive factor"):
        square.reduced_basis(affine._replace(box=affine.box | {"strip": box}), up_to=limit)


def test_a_tolerance_that_is_not_reached_is_said(square, affine, limit, monkeypatch):
    monkeypatch.setattr(_reduced_basis, "ROUNDS", 1)
    with pytest.raises(ValueError, match=r"still off by .* Narrow its box"):
        square.reduced_basis(affine, up_to=limit)


def test_a_margin_below_one_is_refused(square, affine, limit):
    with pytest.raises(ValueError, match=r"margin=0\.9 was given"):
        square.reduced_basis(affine, up_to=limit, margin=0.9)
