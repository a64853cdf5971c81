"""Matrices that SciPy wrote are read complete and symmetric; other files are refused."""

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import bayes_placement as bp
from bayes_placement.io import matrix_files

SIZE = 7
CHAIN = scipy.sparse.diags_array(
    [np.full(SIZE - 1, -1.0), np.arange(2.0, SIZE + 2), np.full(SIZE - 1, -1.0)],
    offsets=[-1, 0, 1],
)
LUMPED = scipy.sparse.diags_array(np.arange(1.0, SIZE + 1))


def saved(path, matrix, symmetry=None):
    if path.suffix == ".npz":
        scipy.sparse.save_npz(path, scipy.sparse.csr_array(matrix))
    else:
        scipy.io.mmwrite(path, scipy.sparse.coo_array(matrix), symmetry=symmetry)
    return path


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("ending", [".npz", ".mtx"])
@pytest.mark.parametrize("part", [lambda a: a, scipy.sparse.tril, scipy.sparse.triu])
def test_matrices_come_back_whole(tmp_path, ending, symmetry, part):
    if symmetry == "symmetric" and part is not scipy.sparse.tril:
        symmetry = "general"  # the format stores the lower triangle of symmetric matrices
    stiffness = saved(tmp_path / f"K{ending}", part(CHAIN), symmetry)
    mass = saved(tmp_path / f"M{ending}", LUMPED, symmetry)
    system = matrix_files.read(stiffness, mass, regions={"all": stiffness})
    for matrix_read, expected in zip(
        (system.stiffness, system.mass, system.regions["all"]), (CHAIN, LUMPED, CHAIN), strict=True
    ):
        assert isinstance(matrix_read, scipy.sparse.csc_array)
        np.testing.assert_array_equal(matrix_read.toarray(), expected.toarray())


def test_dense_and_integer_matrices(tmp_path):
    scipy.io.mmwrite(tmp_path / "K.mtx", np.array([[2, -1], [-1, 2]]))
    system = matrix_files.read(tmp_path / "K.mtx", tmp_path / "K.mtx").stiffness
    assert system.toarray().tolist() == [[2.0, -1.0], [-1.0, 2.0]] and system.dtype == float


@pytest.mark.parametrize("name", ["portal", "plate"])
def test_regions_add_up_to_the_stiffness(shared_data, name):
    folder = shared_data / "cases" / "models" / name
    if not folder.is_dir():
        pytest.skip(f"cases/models/{name} of the shared data is not on this machine")
    regions = {path.stem: path for path in sorted(folder.glob("K_region_*.npz"))}
    system = matrix_files.read(folder / "K.npz", folder / "M.npz", regions=regions)
    assert system.regions.keys() == regions.keys()
    difference = abs(sum(system.regions.values()) - system.stiffness).max()
    assert difference < 1e-12 * abs(system.stiffness).max()


SKEW = CHAIN + scipy.sparse.diags_array(np.full(SIZE - 1, 1e-3), offsets=1, shape=(SIZE, SIZE))
GAP = CHAIN.toarray()
GAP[2, 2] = np.nan
STRAY = np.diag(np.arange(1.0, SIZE + 1))  # a damaged index: the entry has left the diagonal
STRAY[0, 1], STRAY[1, 1] = STRAY[1, 1], 0.0


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (SKEW, r"K.npz holds a matrix that is not symmetric; a real, finite, square"),
        (CHAIN * 1j, r"holds a 7 x 7 matrix of complex128; .*Export it without damping"),
        (CHAIN.tocsr()[:3], r"holds a 3 x 7 matrix of float64"),
        (GAP, r"holds nan as values; finite numbers"),
        (CHAIN * 0.0, r"holds zeros only"),
        (STRAY, r"holds 2 in row 0, column 1, more than its diagonal of 1 and 0 allows; a real"),
    ],
)
def test_what_is_refused(tmp_path, matrix, message):
    mass = saved(tmp_path / "M.npz", LUMPED)
    with pytest.raises(ValueError, match=message):
        matrix_files.read(saved(tmp_path / "K.npz", matrix), mass)


def test_rounding_of_assembly_is_not_asymmetry(tmp_path):
    off = scipy.sparse.diags_array(np.full(SIZE - 1, 1e-9), offsets=1, shape=(SIZE, SIZE))
    path = saved(tmp_path / "K.npz", CHAIN + off)
    assert matrix_files.read(path, path).stiffness.shape == (SIZE, SIZE)


def test_sizes_agree(tmp_path):
    stiffness = saved(tmp_path / "K.npz", CHAIN)
    mass = saved(tmp_path / "M.npz", LUMPED.tocsr()[:5, :5])
    with pytest.raises(ValueError, match=r"M.npz \(mass\) has the size 5 x 5, but .*7 x 7; one"):
        matrix_files.read(stiffness, mass)
    with pytest.raises(ValueError, match=r"M.npz \(region left\) has the size 5 x 5"):
        matrix_files.read(stiffness, stiffness, regions={"left": mass})


def test_files_of_another_kind(tmp_path):
    stiffness = saved(tmp_path / "K.npz", CHAIN)
    with pytest.raises(FileNotFoundError, match=r"There is no file .*none.mtx; a sparse matrix"):
        matrix_files.read(stiffness, tmp_path / "none.mtx")
    np.savez(tmp_path / "arrays.npz", modes=np.eye(2))
    with pytest.raises(ValueError, match=r"arrays.npz cannot be read as a sparse matrix"):
        matrix_files.read(stiffness, tmp_path / "arrays.npz")
    (tmp_path / "text.mtx").write_text("1 2 3\n")
    with pytest.raises(ValueError, match=r"text.mtx cannot be read .*scipy.io.mmwrite"):
        matrix_files.read(stiffness, tmp_path / "text.mtx")


def test_a_turned_bar_in_a_file_of_five_digits_is_read(tmp_path):
    # One bar alone has no energy across its axis: rounding makes that a little negative.
    axis = np.array([np.cos(0.5), np.sin(0.5)])
    end = np.array([[float(f"{entry:.4e}") for entry in row] for row in np.outer(axis, axis)])
    assert np.linalg.eigvalsh(end)[0] < 0
    bar = np.block([[end, -end], [-end, end]])
    file = saved(tmp_path / "K.mtx", bar)
    stiffness = matrix_files.read(file, file).stiffness
    np.testing.assert_array_equal(stiffness.toarray(), bar)


@pytest.mark.parametrize("names", [("K", "M"), ("K0", "M0"), ("stiffness", "mass"), ("Kgg", "Mgg")])
@pytest.mark.parametrize("form", [np.asarray, scipy.sparse.csc_matrix])
@pytest.mark.parametrize("packed", [False, True])
def test_both_matrices_of_a_matlab_file(tmp_path, names, form, packed):
    matrices = {names[0]: form(CHAIN.toarray()), names[1]: form(LUMPED.toarray())}
    others = {"measDOFs": np.array([1, 3]), "note": "chain", "T": np.eye(3)}
    scipy.io.savemat(tmp_path / "system.mat", matrices | others, do_compression=packed)
    system = bp.io.read_matrices(tmp_path / "system.mat")
    np.testing.assert_array_equal(system.stiffness.toarray(), CHAIN.toarray())
    np.testing.assert_array_equal(system.mass.toarray(), LUMPED.toarray())


def test_matrices_of_matlab_that_names_leave_open_are_asked_for(tmp_path):
    both = {"K0": CHAIN.toarray(), "K1": CHAIN.toarray(), "M": LUMPED.toarray()}
    scipy.io.savemat(tmp_path / "two.mat", both)
    with pytest.raises(ValueError, match=r"two\.mat: .*K0, K1 may be the stiffness by name"):
        matrix_files.read(tmp_path / "two.mat")
    for name in ("K", "M"):
        scipy.io.savemat(tmp_path / f"{name}.mat", {"A": both[f"{name}0" if name == "K" else "M"]})
    system = matrix_files.read(tmp_path / "K.mat", tmp_path / "M.mat")
    np.testing.assert_array_equal(system.mass.toarray(), LUMPED.toarray())
    file = saved(tmp_path / "K.npz", CHAIN)
    with pytest.raises(ValueError, match=r"K\.npz was given alone, and is no file of MATLAB"):
        matrix_files.read(file)


@pytest.mark.parametrize("place", [-1, 0, 1])
def test_an_index_of_a_sparse_matrix_of_matlab_that_is_outside_is_refused(tmp_path, place):
    scipy.io.savemat(tmp_path / "K.mat", {"K": scipy.sparse.csc_matrix(CHAIN.toarray())})
    content = bytearray((tmp_path / "K.mat").read_bytes())
    rows = scipy.sparse.csc_matrix(CHAIN.toarray()).indices.astype("<i4").tobytes()
    start = bytes(content).index(rows)
    content[start : start + 4] = np.array([-1 if place < 0 else 999], "<i4").tobytes()
    if place == 0:  # where columns begin
        begins = scipy.sparse.csc_matrix(CHAIN.toarray()).indptr.astype("<i4").tobytes()
        content = bytearray((tmp_path / "K.mat").read_bytes())
        start = bytes(content).index(begins)
        content[start + 4 : start + 8] = np.array([999], "<i4").tobytes()
    (tmp_path / "K.mat").write_bytes(bytes(content))
    with pytest.raises(ValueError, match=r"K\.mat: .*(stands outside|follow each other)"):
        matrix_files.read(tmp_path / "K.mat", tmp_path / "K.mat")
