"""Files of Ansys that its package brings, and what is refused; they need ansys-mapdl-reader."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
from scipy.sparse.linalg import eigsh

from bayes_placement._shared.errors import MissingExtraError
from bayes_placement.io import _reader_process, ansys
from tests.small_models import lowest_frequencies

needs_ansys = pytest.mark.skipif(
    not _reader_process.is_installed("ansys.mapdl.reader"),
    reason='needs ansys-mapdl-reader: pip install "bayes_placement[ansys]"',
)

DOCUMENTED = [1283.200, 1283.200, 5781.975, 6919.399]
"""Natural frequencies [Hz] of the example in the documentation of ansys-mapdl-reader, "Reading
Full Files": a beam of 40 hexahedra that is held at one end."""


def example(name):
    folder = Path(importlib.util.find_spec("ansys.mapdl.reader").origin).parent / "examples"
    return folder / name


@pytest.fixture(scope="module")
def system():
    return ansys.read_matrices(example("file.full"))


@needs_ansys
def test_the_example_of_the_package_has_its_documented_frequencies(system):
    frequencies = lowest_frequencies(system, 4)
    np.testing.assert_allclose(frequencies, DOCUMENTED, rtol=1e-6)
    assert system.dof.shape == (900, 2)
    assert sorted(set(system.dof[:, 1].tolist())) == [1, 2, 3]


@needs_ansys
def test_units_scale_the_matrices(system):
    scaled = ansys.read_matrices(example("file.full"), length_unit=1e-3, mass_unit=1e3)
    np.testing.assert_allclose(scaled.mass.sum(), 1e3 * system.mass.sum())
    np.testing.assert_allclose(
        lowest_frequencies(scaled, 2), lowest_frequencies(system, 2), rtol=1e-9
    )


@needs_ansys
def test_results_of_another_analysis_are_refused():
    """The two examples of the package have different supports."""
    with pytest.raises(ValueError, match=r"file\.rst: its shapes are not orthonormal in the mass"):
        ansys.read_modes(example("file.rst"), example("file.full"))


@needs_ansys
@pytest.mark.parametrize("size", [100, 600_000])
def test_a_file_that_ends_too_early_is_refused(tmp_path, size):
    (tmp_path / "cut.full").write_bytes(example("file.full").read_bytes()[:size])
    with pytest.raises(ValueError, match=r"cut\.full"):
        ansys.read_matrices(tmp_path / "cut.full")


@needs_ansys
def test_matrices_and_results_are_not_confused():
    with pytest.raises(ValueError, match=r"file\.rst: it holds results and no matrices"):
        ansys.read_matrices(example("file.rst"))
    with pytest.raises(ValueError, match=r"file\.full: it holds matrices and no results"):
        ansys.read_modes(example("file.full"), example("file.full"))


# ------------------------------------------------- without the library: what its process answers

SPRINGS = """
import numpy as np
def read(path, extra):
    if path.endswith(".rst"):
        arrays = dict(np.load({modes!r}))
        return arrays, {{"units": "SI", "directions": ["UX", "UY", "UZ"]}}
    arrays = dict(np.load({matrices!r}))
    return {{name.replace("_", " "): held for name, held in arrays.items()}}, {{"units": {units!r}}}
"""


def chain(count=6):
    """Masses on springs, the first one held: stiffness [N/m], mass [kg], upper triangles."""
    stiffness = scipy.sparse.diags_array(
        [2e4 * np.ones(count), -1e4 * np.ones(count - 1)], offsets=[0, 1]
    ).tocoo()
    mass = scipy.sparse.diags_array([np.linspace(1.0, 2.0, count)], offsets=[0]).tocoo()
    return stiffness, mass


@pytest.fixture
def answered(tmp_path, monkeypatch):
    """Files for which a process answers with a chain of springs, changed as the test says."""

    def files(units="SI", shape=lambda values: values, **changed):
        stiffness, mass = chain()
        count = stiffness.shape[0]
        arrays = {"dof": np.column_stack([np.arange(1, count + 1), np.full(count, 1)])}
        for name, matrix in (("stiffness", stiffness), ("mass", mass)):
            arrays[f"{name}_row"], arrays[f"{name}_column"] = matrix.coords
            arrays[f"{name}_value"] = matrix.data
        full = stiffness.tocsc() + scipy.sparse.triu(stiffness, 1).T
        values, vectors = eigsh(full, 3, mass.tocsc(), sigma=0.0)
        shapes = np.zeros((3, count, 3))
        shapes[:, :, 0] = vectors.T
        modes = {
            "node": arrays["dof"][:, 0],
            "position": np.column_stack([np.arange(count), np.zeros((count, 2))]),
            "frequency": np.sqrt(values) / (2 * np.pi),
            "shape": shape(shapes),
        }
        np.savez(tmp_path / "matrices.npz", **{**arrays, **changed})
        np.savez(tmp_path / "modes.npz", **modes)
        names = {key: str(tmp_path / f"{key}.npz") for key in ("modes", "matrices")}
        (tmp_path / "reader.py").write_text(SPRINGS.format(units=units, **names))
        monkeypatch.setattr(_reader_process, "_LIBRARIES", tmp_path / "reader.py")
        monkeypatch.setattr(_reader_process, "is_installed", lambda library: True)
        for name in ("job.rst", "job.full"):
            (tmp_path / name).touch()
        return tmp_path / "job.rst", tmp_path / "job.full"

    return files


def test_modes_that_the_matrices_confirm_are_read(answered):
    results, matrices = answered()
    model = ansys.read_modes(results, matrices)
    system = ansys.read_matrices(matrices)
    np.testing.assert_allclose(model.natural_frequency, lowest_frequencies(system, 3), rtol=1e-9)
    assert model.shape.shape == (6, 3)
    doubled = ansys.read_modes(results, matrices, mass_unit=4.0)
    np.testing.assert_allclose(np.abs(doubled.shape), np.abs(model.shape) / 2)


def garbled(values):
    """What issue 235 of the library shows: zeros, and a few enormous numbers."""
    wrong = np.zeros_like(values)
    wrong[:, 2, 0] = 5.8e15
    return wrong


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (garbled, "not orthonormal in the mass .* or read wrongly"),
        (lambda values: 1.01 * values, "not orthonormal in the mass"),
        (lambda values: values[::-1], "its mode 1 is at .* Hz in the matrices"),
        (lambda values: values * np.nan, "holds nan as shapes"),
    ],
)
def test_shapes_that_the_matrices_deny_are_refused(answered, shape, reason):
    results, matrices = answered(shape=shape)
    with pytest.raises(ValueError, match=rf"job\.rst.*{reason}"):
        ansys.read_modes(results, matrices)


def test_other_units_must_be_given(answered):
    _, matrices = answered(units="MPA")
    with pytest.raises(ValueError, match=r"job\.full states the units MPA; .* length_unit=1e-3"):
        ansys.read_matrices(matrices)
    system = ansys.read_matrices(matrices, length_unit=1e-3, mass_unit=1e3)
    np.testing.assert_allclose(system.mass.diagonal()[0], 1e3)


def test_modes_in_other_units_are_confirmed_by_matrices_in_these(answered):
    """The matrices state units; the shapes are orthonormal in these."""
    in_si = ansys.read_modes(*answered())
    results, matrices = answered(units="MPA")
    model = ansys.read_modes(results, matrices, length_unit=1e-3, mass_unit=1e3)
    np.testing.assert_allclose(model.natural_frequency, in_si.natural_frequency)
    np.testing.assert_allclose(model.position, 1e-3 * in_si.position)
    np.testing.assert_allclose(np.abs(model.shape), np.abs(in_si.shape) / np.sqrt(1e3))


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"stiffness_row": np.full(11, 99)}, "an index of its stiffness lies outside"),
        ({"mass_value": -np.ones(6)}, "a negative value on its diagonal"),
        ({"mass_value": np.full(6, np.inf)}, "values that are not finite"),
        ({"dof": np.column_stack([np.arange(1, 7), np.full(6, 19)])}, "degree of freedom 19"),
    ],
)
def test_matrices_that_cannot_be_are_refused(answered, changed, reason):
    _, matrices = answered(**changed)
    with pytest.raises(ValueError, match=rf"job\.full.*{reason}"):
        ansys.read_matrices(matrices)


def test_without_the_library_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(_reader_process, "is_installed", lambda library: False)
    (tmp_path / "job.full").touch()
    with pytest.raises(MissingExtraError, match=r"pip install \"bayes_placement\[ansys\]\""):
        ansys.read_matrices(tmp_path / "job.full")
