"""Matrices as Abaqus writes them, checked against natural frequencies of other programs."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st

import bayes_placement as bp
from bayes_placement.io import abaqus
from tests.io.test_properties import (
    CHANGES,
    LONG,
    QUIET,
    SHORT,
    Reader,
    check_damage_is_told,
    of_matrices,
    symmetric_matrices,
    valid,
)
from tests.small_models import free_beam, lowest_frequencies, solid

STEEL_LENGTH, HEIGHT, MODULUS, DENSITY = 1.0, 0.02, 2.1e11, 7850.0

# beartype looks at random entries of lists, which Hypothesis takes for a mistake
pytestmark = pytest.mark.filterwarnings("ignore:Do not use the `random` module inside strategies")


HEAD = "** matrix of a job\n*MATRIX INPUT, NAME=K\n"


def write(path, matrix, dof, *, triangle="lower"):
    """Write entries as Abaqus does: node, dof, node, dof, value."""
    dense = scipy.sparse.csr_array(matrix).toarray()
    stored = {"lower": np.tril, "upper": np.triu, "full": np.asarray}[triangle](dense)
    rows, columns = np.nonzero(stored)
    lines = [
        f"{dof[i][0]},{dof[i][1]}, {dof[j][0]},{dof[j][1]}, {stored[i, j]:.16e}"
        for i, j in zip(rows, columns, strict=True)
    ]
    path.write_text(HEAD + "\n".join(lines) + "\n")


def write_both(folder, stiffness, mass, dof, **options):
    paths = folder / "job_STIF1.mtx", folder / "job_MASS1.mtx"
    for path, matrix in zip(paths, (stiffness, mass), strict=True):
        write(path, matrix, dof, **options)
    return paths


def dense_frequencies(stiffness, mass):
    """Natural frequencies [Hz] by LAPACK, of the matrices before they were written."""
    values = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    return np.sqrt(np.abs(values)) / (2 * np.pi)


@pytest.mark.parametrize("triangle", ["lower", "upper", "full"])
@pytest.mark.parametrize("shuffled", [False, True])
def test_a_block_of_scikit_fem_has_its_frequencies(tmp_path, triangle, shuffled):
    """Held at one end as Abaqus does it, by 1e36 on the diagonal."""
    block = solid((4, 1, 1), (0.4, 0.1, 0.1))
    stiffness, mass = (np.asarray(block[name].todense()) for name in ("stiffness", "mass"))
    dof, position = block["dof"], block["position"]
    is_held = position[dof[:, 0] - 1, 0] < 1e-9
    free = ~is_held
    expected = dense_frequencies(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)])[:6]
    stiffness[is_held, is_held] = 1e36
    order = np.random.default_rng(1).permutation(len(dof)) if shuffled else np.arange(len(dof))
    pick = np.ix_(order, order)
    paths = write_both(tmp_path, stiffness[pick], mass[pick], dof[order], triangle=triangle)
    system = abaqus.read_matrices(*paths)
    np.testing.assert_allclose(lowest_frequencies(system, 6), expected, rtol=1e-9)
    assert len(system.dof) == free.sum()


def test_a_cantilever_has_the_frequencies_of_the_closed_form(tmp_path):
    """Hermite elements of a clamped beam against the roots of cos x cosh x = -1."""
    count, length = 60, STEEL_LENGTH / 60
    bending = MODULUS * HEIGHT**4 / 12
    k = (
        bending
        / length**3
        * np.array(
            [
                [12, 6 * length, -12, 6 * length],
                [6 * length, 4 * length**2, -6 * length, 2 * length**2],
                [-12, -6 * length, 12, -6 * length],
                [6 * length, 2 * length**2, -6 * length, 4 * length**2],
            ]
        )
    )
    m = (
        DENSITY
        * HEIGHT**2
        * length
        / 420
        * np.array(
            [
                [156, 22 * length, 54, -13 * length],
                [22 * length, 4 * length**2, 13 * length, -3 * length**2],
                [54, 13 * length, 156, -22 * length],
                [-13 * length, -3 * length**2, -22 * length, 4 * length**2],
            ]
        )
    )
    size = 2 * count + 2
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for element in range(count):
        rows = np.ix_(*[np.arange(2 * element, 2 * element + 4)] * 2)
        stiffness[rows] += k
        mass[rows] += m
    dof = np.column_stack([np.repeat(np.arange(1, count + 2), 2), np.tile([2, 6], count + 1)])
    stiffness[[0, 1], [0, 1]] = 1e36
    roots = np.array([1.8751040687119611, 4.694091132974174, 7.854757438237613])
    expected = roots**2 * np.sqrt(bending / (DENSITY * HEIGHT**2)) / (2 * np.pi)
    system = bp.io.read_matrices(*write_both(tmp_path, stiffness, mass, dof))
    np.testing.assert_allclose(lowest_frequencies(system, 3), expected, rtol=1e-6)
    # the same model in mm, t and s
    turned = np.where(dof[:, 1] == 6, 1e3, 1.0)
    scale = np.outer(turned, turned) / 1e3
    in_mm = write_both(
        tmp_path, np.where(stiffness < 1e30, stiffness * scale, 1e36), mass * scale, dof
    )
    again = abaqus.read_matrices(*in_mm, length_unit=1e-3, mass_unit=1e3)
    np.testing.assert_allclose(again.stiffness.toarray(), system.stiffness.toarray(), rtol=1e-9)
    np.testing.assert_allclose(again.mass.toarray(), system.mass.toarray(), rtol=1e-9)


def test_a_model_is_made_of_them(tmp_path):
    beam = free_beam()
    paths = write_both(tmp_path, beam["stiffness"], beam["mass"], beam["dof"])
    system = abaqus.read_matrices(*paths)
    matrices = bp.finite_elements.Matrices(
        system.stiffness, system.mass, position=beam["position"], dof=system.dof
    )
    np.testing.assert_allclose(
        matrices.mass.toarray(), scipy.sparse.csr_array(beam["mass"]).toarray()
    )


ENTRY = "1,1, 1,1, 2.0\n2,1, 1,1, -1.0\n2,1, 2,1, 2.0\n"


@pytest.mark.parametrize(
    ("stiffness", "reason"),
    [
        (ENTRY + "2,1, 1,1, -1.0\n", "an entry occurs twice"),
        (ENTRY + "1,1, 2,1, -1.5\n", "its triangles differ"),
        (ENTRY.replace("-1.0", "nan"), "a value is not finite"),
        (ENTRY.replace("2,1, 2,1, 2.0", "2,1, 2,1, -2.0"), "a negative value on its diagonal"),
        (ENTRY.replace("2,1", "2,8"), "degree of freedom 8 of node 2; 1 to 6"),
        (ENTRY.replace("1,1, 1,1", "0,1, 0,1"), "degree of freedom 1 of node 0"),
        (ENTRY.replace("1,1, 1,1", "1.5,1, 1,1"), "no whole number"),
        (ENTRY + "1,1, 2.0\n", "five are needed|number of columns changed"),
        ("*MATRIX INPUT, NAME=K, TYPE=UNSYMMETRIC\n" + ENTRY, "says that it is unsymmetric"),
        ("*NODE\n" + ENTRY, r"line 1 is '\*NODE', no entry of a matrix"),
        ("** nothing\n", "it has no entry"),
    ],
)
def test_what_is_no_such_matrix_is_refused(tmp_path, stiffness, reason):
    (tmp_path / "K.mtx").write_text(stiffness)
    (tmp_path / "M.mtx").write_text(ENTRY)
    with pytest.raises(ValueError, match=rf"K\.mtx.*({reason})"):
        abaqus.read_matrices(tmp_path / "K.mtx", tmp_path / "M.mtx")


@pytest.mark.parametrize("unit", ["length_unit", "mass_unit"])
def test_units_that_are_none_are_refused(tmp_path, unit):
    for name in ("K.mtx", "M.mtx"):
        (tmp_path / name).write_text(ENTRY)
    with pytest.raises(ValueError, match=f"{unit}=-1.0 was given; a positive number"):
        abaqus.read_matrices(tmp_path / "K.mtx", tmp_path / "M.mtx", **{unit: -1.0})


@settings(max_examples=60, **QUIET)
@given(matrix=symmetric_matrices(), triangle=st.sampled_from(["lower", "upper", "full"]))
def test_matrices_come_back(tmp_path_factory, matrix, triangle):
    dof = [(node, 1) for node in range(1, len(matrix) + 1)]
    paths = write_both(tmp_path_factory.mktemp("K"), matrix, matrix, dof, triangle=triangle)
    system = abaqus.read_matrices(*paths)
    np.testing.assert_allclose(system.stiffness.toarray(), matrix, rtol=1e-15)


def damaged(tmp_path_factory, changes):
    folder = tmp_path_factory.mktemp("damaged")
    reader = Reader(
        "K.mtx", ENTRY.encode(), lambda path: abaqus.read_matrices(path, path), of_matrices
    )
    check_damage_is_told(folder, reader, valid(folder, reader), changes)


@settings(max_examples=SHORT, **QUIET)
@given(changes=CHANGES)
def test_damage_is_told(tmp_path_factory, changes):
    damaged(tmp_path_factory, changes)


@pytest.mark.long
@pytest.mark.longest
@settings(max_examples=LONG, **QUIET)
@given(changes=CHANGES)
def test_much_damage_is_told(tmp_path_factory, changes):
    damaged(tmp_path_factory, changes)
