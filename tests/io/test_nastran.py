"""Files of Nastran and pyyeti, compared with Nastran's printout and rigid motions."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse

from bayes_placement.io import _reader_process, nastran
from bayes_placement.io._reader_process import ReaderResult

pyyeti = pytest.importorskip("pyyeti", reason='needs pip install "bayes_placement[nastran]"')
with np.printoptions():  # it changes how all arrays are printed, in the tests of other files too
    from bayes_placement.io import _library_process

    n2p = pytest.importorskip("pyyeti.nastran.n2p")
    op4 = pytest.importorskip("pyyeti.nastran.op4")

# pyyeti carries the files of its own tests, written by NX Nastran 9: a free structure of bars.
EXAMPLES = Path(pyyeti.__file__).parent / "tests"
NUMBER = r"\s+(-?\d\.\d+E[+-]\d+)"
PRINTED_MODE = re.compile(rf"^\s+(\d+)\s+\d+{NUMBER * 5}$", re.MULTILINE)


def example(*parts):
    path = EXAMPLES.joinpath(*parts)
    if not path.is_file():
        pytest.skip(f"this pyyeti does not carry {'/'.join(parts)}")
    return path


@pytest.fixture(scope="module")
def free():
    return nastran.read_modes(example("nas2cam_extseout", "full.op2"))


@pytest.fixture
def at_once(monkeypatch):
    """Read in this process: importing pyyeti takes another one three seconds for each file."""

    def run(script, path, library, **settings):
        with warnings.catch_warnings(action="ignore"):
            return ReaderResult(*_library_process.read(str(path), **settings), "")

    monkeypatch.setattr(_reader_process, "run", run)


def rigid_motions(position):
    """Motion [node, axis, 6] by unit translations and rotations about the origin."""
    shift = np.broadcast_to(np.eye(3), (len(position), 3, 3))
    turn = np.stack([np.cross(axis, position) for axis in np.eye(3)], axis=-1)
    lower = np.concatenate([np.zeros_like(shift), shift], axis=2)
    return np.concatenate([np.concatenate([shift, turn], axis=2), lower], axis=1)


def test_frequencies_and_masses_are_those_that_nastran_prints(free):
    """The modal masses are all 1 here; those of another table would have moved the shapes."""
    text = example("nas2cam_extseout", "full.out").read_text(errors="replace")
    printed = {}
    for number, _, _, cycles, mass, _ in PRINTED_MODE.findall(text):
        printed.setdefault(int(number), (float(cycles), float(mass)))
    cycles, mass = np.array([printed[number] for number in sorted(printed)]).T
    assert free.natural_frequency.size == 278 == cycles.size and (mass == 1).all()
    np.testing.assert_allclose(free.natural_frequency[6:], cycles[6:], rtol=1e-6)
    assert free.rigid_body_modes == 6 and free.shape.dtype == np.float32


def test_coordinates_are_those_of_the_bulk_data(free):
    cards = example("nas2cam_extseout", "full.dat").read_text().splitlines()
    grids = [card.split() for card in cards if card.startswith("GRID ")]
    expected = {int(card[1]): [float(number) for number in card[3:6]] for card in grids}
    for node, position in zip(free.node.tolist(), free.position.tolist(), strict=True):
        assert position == expected[node]


def test_rigid_body_modes_are_rigid_motions(free):
    """Shapes, directions and coordinates fit together: the six modes without strain are rigid."""
    motion = rigid_motions(free.position).reshape(-1, 6)
    share = np.linalg.lstsq(motion, free.shape[:, :6].astype(float), rcond=None)[0]
    assert np.abs(motion @ share - free.shape[:, :6]).max() < 1e-6 * np.abs(free.shape[:, :6]).max()
    # Mass-normalised: the rigid-body mass matrix has the same mass three times.
    mass = np.linalg.inv(share @ share.T)
    np.testing.assert_allclose(mass[:3, :3], mass[0, 0] * np.eye(3), atol=1e-4 * mass[0, 0])


def test_motion_is_turned_to_the_basic_system(at_once):
    """Node 70 has a displacement system of its own, and dependent directions that are zero."""
    model = nastran.read_modes(example("nas2cam_extseout", "assemble.op2"))
    shape = model.shape[:, :6].reshape(-1, 6, 6)
    motion = rigid_motions(model.position)
    others = model.node != 70
    share = np.linalg.lstsq(motion[others].reshape(-1, 6), shape[others].reshape(-1, 6))[0]
    moving = [1, 2, 3]  # y, z, rx in the basic system
    np.testing.assert_allclose(
        shape[~others][0, moving], (motion[~others][0] @ share)[moving], atol=1e-5
    )
    assert np.abs(shape[~others][0, moving]).max() > 1


def test_cylindrical_displacement_systems():
    """At 90 degrees from y about x, the radial motion is along z and the tangential along -y."""
    about_x = np.array([[1, 2, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
    uset = n2p.addgrid(
        None, [100, 200], "b", [0, about_x], [[5, 10, 15], [32, 90, 10]], [0, about_x]
    )
    position, turn = _library_process.grids(uset, np.array([200, 100]))
    np.testing.assert_allclose(position, [[10, 0, 32], [5, 10, 15]], atol=1e-12)
    motion = np.array([[[1.0], [2.0], [3.0]], [[1.0], [2.0], [3.0]]])
    turned = _library_process.rotated(motion, turn)[:, :, 0]
    np.testing.assert_allclose(turned, [[3.0, -2.0, 1.0], [1.0, 2.0, 3.0]], atol=1e-12)


def test_units(at_once, free):
    """Inches and their masses in SI: shapes by the root of the mass, slopes by the length too."""
    path = example("nas2cam_extseout", "full.op2")
    model = nastran.read_modes(path, length_unit=0.0254, mass_unit=175.127)
    np.testing.assert_allclose(model.position, free.position * 0.0254)
    ratio = model.shape[:6, 10] / free.shape[:6, 10]
    expected = np.repeat([1.0, 1 / 0.0254], 3) / np.sqrt(175.127)
    np.testing.assert_allclose(ratio, expected, rtol=1e-5)


def test_modal_masses_are_asked_for_where_the_file_has_none(at_once):
    path = example("nas2cam_extseout", "inboard.op2")
    with pytest.raises(ValueError, match=r"3 mode shapes came without modal masses"):
        nastran.read_modes(path)
    model = nastran.read_modes(path, modal_mass=1)
    np.testing.assert_allclose(model.natural_frequency, [6.129345, 6.130134, 23.631876], rtol=1e-6)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (("nas2cam_extseout", "cant_beam.op2"), r"negative eigenvalue \(mode 2, -0.000234 Hz\)"),
        (("nastran_op2_data", "rdop2gpwg_1.op2"), r"eigenvectors \['ougv1'\], nodes none; one"),
        (("nastran_op2_data", "rdop2opg_1.op2"), r"eigenvectors none, nodes none.*SOL 103"),
        (("nas2cam_extseout", "inboard_v2007.op2"), r"cannot be read as OUTPUT2 \(number of SEs"),
        (
            ("cla_test_data_2020", "residual.op2"),
            r"eigenvectors of 22 nodes .*without those of sup",
        ),
    ],
)
def test_files_without_one_solution(at_once, parts, message):
    with pytest.raises(ValueError, match=message):
        nastran.read_modes(example(*parts))


def other_eigenvalues(monkeypatch, change):
    """Read files with another table of eigenvalues."""
    read = nastran.run_library

    def changed(*asked, **settings):
        result = read(*asked, **settings)
        return result._replace(arrays=change(result.arrays))

    monkeypatch.setattr(nastran, "run_library", changed)


def test_shapes_and_masses_of_two_solutions(at_once, monkeypatch):
    other_eigenvalues(monkeypatch, lambda a: a | {"eigenvalues": a["eigenvalues"][:200]})
    with pytest.raises(ValueError, match=r"278 eigenvectors up to .* LAMA of 200 modes"):
        nastran.read_modes(example("nas2cam_extseout", "full.op2"))


@pytest.mark.parametrize("read", [nastran.read_modes, nastran.read_matrices])
def test_files_of_another_kind(tmp_path, monkeypatch, read):
    with pytest.raises(FileNotFoundError, match=r"There is no file .*; a file of Nastran"):
        read(tmp_path / "none.op2")
    (tmp_path / "text").write_bytes(b"GRID, 1,, 0., 0., 0.\n")
    with pytest.raises(ValueError, match=r"text cannot be read as OUTPUT[24] \(.*PARAM,POST"):
        read(tmp_path / "text")
    monkeypatch.setattr(_reader_process, "is_installed", lambda library: False)
    with pytest.raises(ImportError, match=r'pip install "bayes_placement\[nastran\]"'):
        read(tmp_path / "text")


def test_a_cut_file_is_told(tmp_path):
    content = example("nas2cam_extseout", "full.op2").read_bytes()
    (tmp_path / "cut.op2").write_bytes(content[: len(content) // 2])
    with pytest.raises(ValueError, match=r"cut.op2(: it holds eigenvectors| cannot be read as)"):
        nastran.read_modes(tmp_path / "cut.op2")


STIFFNESS = scipy.sparse.diags_array(
    [np.full(5, -1.5), np.arange(3.0, 9.0), np.full(5, -1.5)], offsets=[-1, 0, 1]
).tocsc()
MASS = scipy.sparse.diags_array(np.arange(1.0, 7.0)).tocsc()


def written(path, matrices, **how):
    dense = {name: matrix.toarray() for name, matrix in matrices.items()}
    op4.write(str(path), dense, **how)
    return path


@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("binary", [True, False])
def test_matrices_of_an_output4_file(at_once, tmp_path, binary, sparse):
    matrices = {"maa": MASS, "kaa": STIFFNESS, "k2": 0.5 * STIFFNESS, "phi": STIFFNESS[:, :2]}
    path = written(tmp_path / "m.op4", matrices, binary=binary, sparse=sparse)
    system = nastran.read_matrices(path, regions={"half": "K2"})
    np.testing.assert_allclose(system.stiffness.toarray(), STIFFNESS.toarray(), rtol=1e-14)
    np.testing.assert_allclose(system.mass.toarray(), MASS.toarray(), rtol=1e-14)
    np.testing.assert_allclose(system.regions["half"].toarray(), 0.5 * STIFFNESS.toarray())
    assert isinstance(system.mass, scipy.sparse.csc_array)


def test_matrices_that_nastran_wrote():
    path = example("nas2cam_extseout", "inboard.op4")
    expected = op4.read(str(path), ["kxx", "mxx"])
    system = nastran.read_matrices(path, stiffness="KXX", mass="MXX")
    np.testing.assert_array_equal(system.stiffness.toarray(), expected["kxx"])
    np.testing.assert_array_equal(system.mass.toarray(), expected["mxx"])


def test_matrices_by_names_that_the_file_does_not_have(at_once, tmp_path):
    path = written(tmp_path / "m.op4", {"mxx": MASS, "kxx": STIFFNESS})
    with pytest.raises(ValueError, match=r"holds the matrices MXX, KXX, KAA 0 times; it is needed"):
        nastran.read_matrices(path)
    op4.write(str(path), ["kaa", "kaa", "maa"], [np.eye(2), 2 * np.eye(2), np.eye(2)])
    with pytest.raises(ValueError, match=r"KAA 2 times"):
        nastran.read_matrices(path)
    path = written(tmp_path / "m.op4", {"maa": MASS, "kaa": STIFFNESS[:4, :4]})
    with pytest.raises(ValueError, match=r"m.op4, MAA \(mass\) has the size 6 x 6, but .*KAA"):
        nastran.read_matrices(path)


def test_modal_masses_stay_with_their_modes(at_once, monkeypatch):
    """Rigid-body modes stand in another order in the file than by the size of their residue."""
    read = {}

    def change(arrays):
        read.update(arrays)
        read["eigenvalues"][:, 5] = np.arange(278) + 1.0
        return read

    other_eigenvalues(monkeypatch, change)
    modes = nastran.read_modes(example("nas2cam_extseout", "full.op2"))
    table = read["eigenvalues"]
    order = np.argsort(np.abs(table[:, 4]), kind="stable")
    assert order[:6].tolist() != [0, 1, 2, 3, 4, 5]
    expected = read["shape"][:, :, order] / np.sqrt(table[order, 5])
    np.testing.assert_allclose(modes.shape, expected.reshape(modes.shape.shape), rtol=1e-5)
