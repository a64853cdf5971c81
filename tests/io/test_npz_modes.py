"""The package's layout of modes, written and read, and files with other names of arrays."""

import tracemalloc

import numpy as np
import pytest

from bayes_placement.io import npz_modes
from bayes_placement.modes.finite_elements.modal_model import ModalModel


@pytest.fixture(scope="module")
def model():
    random = np.random.default_rng(np.random.SeedSequence(7))
    return ModalModel.from_arrays(
        node=[5, 3, 9],
        position=random.normal(size=(3, 3)),
        shape=random.normal(size=(3, 6, 4)).astype(np.float32),
        natural_frequency=[0.0, 10.0, 20.0, 30.0],
        modal_mass=[1.0, 2.0, 3.0, 4.0],
        damping_ratio=[0.0, 0.01, 0.02, 0.03],
    )


@pytest.mark.parametrize("damping", [True, False])
def test_there_and_back(tmp_path, model, damping):
    stored = model if damping else ModalModel(**(vars(model) | {"damping_ratio": None}))
    path = npz_modes.write(tmp_path / "new" / "model.npz", stored)
    loaded = npz_modes.read(path)
    for name, value in vars(stored).items():
        np.testing.assert_array_equal(getattr(loaded, name), value, err_msg=name)
    assert loaded.shape.dtype == np.float32


def test_handed_over_arrays(shared_data):
    path = shared_data / "cases" / "models" / "plate" / "nominal.npz"
    if not path.is_file():
        pytest.skip("cases/models/plate of the shared data is not on this machine")
    model, grid, stored = npz_modes.read(path), npz_modes.read_nodes(path), np.load(path)
    np.testing.assert_array_equal(model.shape, stored["modes"])
    np.testing.assert_array_equal(model.natural_frequency, stored["freqs_hz"])
    np.testing.assert_array_equal(model.damping_ratio, stored["modal_damping"])
    np.testing.assert_array_equal(grid.fixed, stored["fixed_dofs"])
    np.testing.assert_array_equal(grid.element, stored["elements"])
    np.testing.assert_array_equal(grid.dof, model.dof)
    assert not model.shape[grid.fixed].any()


def test_nodes_without_modes(tmp_path):
    np.savez(tmp_path / "grid.npz", nodes=np.eye(3), dofs=[(1, 3), (2, 3)])
    grid = npz_modes.read_nodes(tmp_path / "grid.npz")
    assert grid.node.tolist() == [1, 2, 3] and grid.element is None and not grid.fixed.size


def test_a_large_file_is_held_twice_at_most(tmp_path):
    nodes, modes = 20_000, 30
    path = tmp_path / "large.npz"
    np.savez(
        path,
        position=np.zeros((nodes, 3)),
        shape=np.ones((nodes, 3, modes), np.float32),
        natural_frequency=np.arange(modes) + 1.0,
        modal_mass=np.full(modes, 4.0),
    )
    size = 4 * nodes * 3 * modes
    tracemalloc.start()
    model = npz_modes.read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert model.shape.dtype == np.float32
    assert peak < 2.05 * size + 8 * 20 * nodes * 3


def saved(folder, **arrays):
    stored = {"position": np.eye(3), "shape": np.ones((3, 3, 1)), "natural_frequency": [2.0]}
    present = {name: value for name, value in (stored | arrays).items() if value is not None}
    np.savez(folder / "model.npz", **present)
    return folder / "model.npz"


def test_modal_masses_beside_the_file(tmp_path):
    with pytest.raises(ValueError, match=r"1 mode shapes came without modal masses"):
        npz_modes.read(saved(tmp_path))
    assert (npz_modes.read(saved(tmp_path), modal_mass=4.0).shape == 0.5).all()


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"shape": None}, r"holds no shape, among position, natural_frequency; .*modes or shapes"),
        ({"nodes": np.eye(3)}, r"holds both position and nodes, among .*its position once"),
        ({"modal_mass": np.array([{}])}, r"cannot be read as .npz \(array modal_mass: .*pickle"),
    ],
)
def test_what_is_refused(tmp_path, arrays, message):
    with pytest.raises(ValueError, match=message):
        npz_modes.read(saved(tmp_path, **arrays))


def test_files_of_another_kind(tmp_path, model):
    with pytest.raises(FileNotFoundError, match=r"no file .*none.npz; a .npz file of nodes"):
        npz_modes.read(tmp_path / "none.npz")
    np.save(tmp_path / "one.npy", np.eye(3))
    with pytest.raises(ValueError, match=r"cannot be read as .npz \(it is a single array\)"):
        npz_modes.read(tmp_path / "one.npy")
    (tmp_path / "text.npz").write_text("position")
    with pytest.raises(ValueError, match=r"text.npz cannot be read as .npz"):
        npz_modes.read(tmp_path / "text.npz")
    all_bytes = npz_modes.write(tmp_path / "whole.npz", model).read_bytes()
    (tmp_path / "cut.npz").write_bytes(all_bytes[: len(all_bytes) // 2])
    with pytest.raises(ValueError, match=r"cut.npz cannot be read as .npz"):
        npz_modes.read(tmp_path / "cut.npz")
    with pytest.raises(ValueError, match=r"a name that ends in .npz is needed.*model.npz"):
        npz_modes.write(tmp_path / "model.dat", model)


@pytest.mark.parametrize("name", ["modal_dampings", "MODAL_DAMPING", "dampingratio"])
def test_a_misspelt_array_is_not_ignored(tmp_path, name):
    with pytest.raises(ValueError, match=rf"model\.npz holds an array {name}, which is not known"):
        npz_modes.read(saved(tmp_path, modal_mass=[1.0], **{name: [0.02]}))


def test_an_array_without_a_name_is_not_ignored(tmp_path):
    with pytest.raises(ValueError, match=r"model\.npz holds an array without a name \(arr_0\)"):
        npz_modes.read(saved(tmp_path, modal_mass=[1.0], arr_0=[0.02]))


def test_arrays_of_other_names_are_ignored(tmp_path):
    model = npz_modes.read(saved(tmp_path, modal_mass=[1.0], comment=[3.0]))
    assert model.damping_ratio is None
