"""Shape functions of a basis are evaluated as scikit-fem itself evaluates them."""

import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement._shared.errors import InputError
from bayes_placement.modes.finite_elements import interpolation
from tests.simulator.element_models import slopes, weights

skfem = pytest.importorskip("skfem", reason="scikit-fem is not installed")


def line():
    return skfem.MeshLine(np.array([0.0, 0.2, 0.5, 0.6, 1.0]))


def triangles():
    mesh = skfem.MeshTri.init_symmetric().refined(1)
    return skfem.MeshTri(np.array([[1.3, 0.4], [0.1, 0.9]]) @ mesh.p + [[0.3], [-0.1]], mesh.t)


def rectangles():
    return skfem.MeshQuad.init_tensor(np.array([0, 0.3, 0.5, 1.0]), np.array([0, 0.4, 0.7]))


def tetrahedra():
    return skfem.MeshTet.init_tensor(*3 * [np.array([0, 0.4, 1.0])])


def bricks():
    return skfem.MeshHex.init_tensor(*3 * [np.array([0, 0.4, 1.0])])


CASES = {
    "line P2": (line, skfem.ElementLineP2, (1,)),
    "line Hermite": (line, skfem.ElementLineHermite, (3,)),
    "triangle P1": (triangles, skfem.ElementTriP1, (3,)),
    "Morley": (triangles, skfem.ElementTriMorley, (3,)),
    "Argyris": (triangles, skfem.ElementTriArgyris, (3,)),
    "membrane": (triangles, lambda: skfem.ElementVector(skfem.ElementTriP2()), (1, 2)),
    "quadrilateral 1": (rectangles, skfem.ElementQuad1, (3,)),
    "serendipity": (rectangles, skfem.ElementQuadS2, (3,)),
    "BFS": (rectangles, skfem.ElementQuadBFS, (3,)),
    "solid P2": (tetrahedra, lambda: skfem.ElementVector(skfem.ElementTetP2()), (1, 2, 3)),
    "brick 2": (bricks, lambda: skfem.ElementVector(skfem.ElementHex2()), (1, 2, 3)),
}


def inside(mesh, count):
    """Places inside cells, away from borders where a field may jump."""
    rng, corners = np.random.default_rng(3), mesh.p[:, mesh.t]
    cells = rng.integers(mesh.nelements, size=count)
    share = rng.dirichlet(2 * np.ones(len(mesh.t)), count)
    return np.einsum("dcp,pc->dp", corners[:, :, cells], share)


def in_space(place):
    return np.pad(place.T, [(0, 0), (0, 3 - len(place))])


@pytest.mark.parametrize("case", CASES)
def test_any_place_is_read_as_by_probes(case):
    mesh, element, axes = CASES[case]
    basis = skfem.Basis(mesh(), element())
    place = inside(basis.mesh, 30)
    read = interpolation.scikit_fem(basis, axes=axes)
    weight = weights(read, in_space(place), basis.N)
    expected = basis.probes(place).toarray().reshape(len(axes), -1, basis.N)
    np.testing.assert_allclose(weight, np.moveaxis(expected, 0, 1), atol=1e-9)
    assert read.axes == axes


@pytest.mark.parametrize("case", ["Argyris", "BFS"])
def test_conforming_plates_have_continuous_slopes(case):
    mesh, element, axes = CASES[case]
    basis = skfem.Basis(mesh(), element())
    values = np.random.default_rng(4).normal(size=basis.N)
    inner = np.setdiff1d(np.arange(basis.mesh.nfacets), basis.mesh.boundary_facets())
    ends = basis.mesh.p[:, basis.mesh.facets[:, inner]]
    along = ends[:, 1] - ends[:, 0]
    middle = ends[:, 0] + 0.3 * along
    across = 1e-10 * np.array([along[1], -along[0]])
    read = interpolation.scikit_fem(basis, axes=axes)
    sides = [slopes(read, in_space(middle + s * across), basis.N) @ values for s in (-1, 1)]
    np.testing.assert_allclose(*sides, atol=1e-5)
    assert np.abs(sides[0]).max() > 1


def test_a_solid_converges_at_third_order():
    error = []
    for count in (3, 6):
        mesh = skfem.MeshTet.init_tensor(*3 * [np.linspace(0, 1, count + 1)])
        basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))
        values = np.sin(basis.doflocs.sum(axis=0) * 2)
        place = np.random.default_rng(5).uniform(size=(200, 3))
        read = interpolation.scikit_fem(basis, axes=(1, 2, 3))
        field = weights(read, place, basis.N) @ values
        error.append(np.sqrt(np.mean((field - np.sin(2 * place.sum(axis=1))[:, None]) ** 2)))
    assert np.log2(error[0] / error[1]) == pytest.approx(3, abs=0.25)


def test_part_of_a_mesh_is_read_alone():
    basis = skfem.Basis(triangles(), skfem.ElementTriMorley())
    read = interpolation.scikit_fem(basis.with_elements(np.array([3, 5])), axes=(3,))
    assert read.rows.shape == (2, 6)
    centre = basis.mesh.p[:, basis.mesh.t[:, [5]]].mean(axis=1)
    weight = weights(read, in_space(centre), basis.N)[:, 0]
    np.testing.assert_allclose(weight, basis.probes(centre).toarray(), atol=1e-12)


def test_a_plate_may_lie_anywhere_in_space():
    basis = skfem.Basis(rectangles(), skfem.ElementQuadBFS())
    origin, directions = np.array([1.0, 2.0, 3.0]), np.array([[0.0, 0.6], [0, 0.8], [1, 0]])
    plate = interpolation.scikit_fem(basis, axes=(1,), origin=origin, directions=directions)
    place = inside(basis.mesh, 10)
    weight = weights(plate, origin + place.T @ directions.T, basis.N)[:, 0]
    np.testing.assert_allclose(weight, basis.probes(place).toarray(), atol=1e-12)


def test_cells_alike_share_one_set_of_polynomials():
    mesh = tetrahedra().refined(1)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP1()))
    read = interpolation.scikit_fem(basis, axes=(1, 2, 3))
    assert read.coefficients.shape == (1, 4, 3, 12)
    part = read.near(np.array([[0.1, 0.1, 0.1]]), 0.01)
    assert len(part.rows) < mesh.nelements and part.coefficients.shape == (1, 4, 3, 12)


def test_reading_is_the_same_one_by_one():
    basis = skfem.Basis(triangles(), skfem.ElementTriMorley())
    read = interpolation.scikit_fem(basis, axes=(3,))
    place = in_space(inside(basis.mesh, 2))
    batch = weights(read, place, basis.N)
    single = eqx.filter_jit(read.at)(jnp.asarray(place[1]))
    np.testing.assert_allclose(single.weight, batch[1][:, np.asarray(single.rows)], atol=1e-14)


def test_cells_that_are_not_affine_are_refused():
    bent = skfem.MeshQuad(np.array([[0, 1, 1.2, 0], [0, 0, 1.1, 1]]), np.array([[0, 1, 2, 3]]).T)
    with pytest.raises(ValueError, match=r"Cell 0 of the mesh is curved or no parallelogram"):
        interpolation.scikit_fem(skfem.Basis(bent, skfem.ElementQuad1()), axes=(3,))
    mesh = skfem.MeshTri2.init_circle(1)
    with pytest.raises(ValueError, match=r"mesh\.to_meshtri\(\)"):
        interpolation.scikit_fem(skfem.Basis(mesh, skfem.ElementTriP2()), axes=(3,))


def test_a_field_of_other_components_is_refused():
    basis = skfem.Basis(triangles(), skfem.ElementTriP1())
    with pytest.raises(ValueError, match=r"field of 1 components; each needs its axis"):
        interpolation.scikit_fem(basis, axes=(1, 2))


def test_several_fields_are_refused():
    pair = skfem.ElementComposite(skfem.ElementTriP1(), skfem.ElementTriP2())
    with pytest.raises(ValueError, match="which has 2 fields"):
        interpolation.scikit_fem(skfem.Basis(triangles(), pair), axes=(3,))


def test_other_cells_are_refused():
    basis = skfem.Basis(skfem.MeshWedge1(), skfem.ElementWedge1())
    with pytest.raises(ValueError, match="A basis on the cell RefWedge was given"):
        interpolation.scikit_fem(basis, axes=(3,))


def test_a_wrong_degree_is_refused(monkeypatch):
    basis = skfem.Basis(triangles(), skfem.ElementTriP2())
    monkeypatch.setattr(basis.elem, "maxdeg", 1, raising=False)
    with pytest.raises(ValueError, match="are no polynomials of the degree"):
        interpolation.scikit_fem(basis, axes=(3,))


def test_only_a_basis_of_cells_is_read():
    with pytest.raises(InputError, match=r"A MeshTri1 was given; a skfem\.CellBasis is needed"):
        interpolation.scikit_fem(triangles(), axes=(3,))


def test_a_missing_scikit_fem_is_named(monkeypatch):
    basis = skfem.Basis(triangles(), skfem.ElementTriP1())
    monkeypatch.setitem(sys.modules, "skfem", None)
    with pytest.raises(ImportError, match=r'pip install "bayes_placement\[scikit-fem\]"'):
        interpolation.scikit_fem(basis, axes=(3,))


def test_weights_have_second_derivatives_on_the_faces_of_elements_too():
    """A power of a coordinate that is zero there must not make them undefined."""
    basis = skfem.Basis(rectangles(), skfem.ElementVector(skfem.ElementQuad2()))
    reader = interpolation.scikit_fem(basis, axes=(1, 2))
    second = jax.jit(jax.hessian(lambda place: reader.at(place).weight))
    for place in ([0.0, 0.2, 0.0], [0.3, 0.4, 0.0], [0.7, 0.0, 0.0]):
        assert jnp.isfinite(second(jnp.array(place))).all()
