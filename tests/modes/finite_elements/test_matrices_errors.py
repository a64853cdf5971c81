"""Matrices that are no model, and impossible requests to a model, are refused."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from bayes_placement.modes.finite_elements.matrices import Matrices
from tests.small_models import Plate, free_beam

SIZE = len(free_beam()["dof"])


def beam(**changes):
    return Matrices(**(free_beam() | changes))


@pytest.fixture(scope="module")
def plate():
    return Plate((4, 3), (0.4, 0.3))


def altered(name, row, column, value):
    matrix = getattr(beam(), name).toarray()
    matrix[row, column] = value
    return {name: csr_array(matrix)}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(stiffness=np.ones((3, 2))), r"stiffness has shape \(3, 2\); a square matrix"),
        (dict(mass=np.eye(3)), "mass has 3 rows, but dof names 42"),
        (altered("stiffness", 4, 6, np.nan), "stiffness is nan in row 4, column 6"),
        (altered("mass", 4, 5, 1.0), r"mass is not symmetric: between node 3 .*triangle"),
        (altered("mass", 2, 2, -1.0), r"mass is -1 on its diagonal for node 2 y \(row 2\)"),
        (dict(mass=csr_array((SIZE, SIZE))), "neither strain energy nor mass"),
        (altered("stiffness", 2, 2, -1e9), "not positive semi-definite"),
        (dict(fixed=[42]), "fixed names row 42, but rows go from 0 to 41"),
        (dict(fixed=[0.5]), r"fixed has shape \(1,\) and type float64"),
        (dict(fixed=np.arange(SIZE)), "fixed holds every row"),
        (dict(dof=np.ones((3, 3))), r"dof has shape \(3, 3\)"),
        (dict(node=np.zeros(21, dtype=int)), "more than once"),
        (dict(regions={"half": np.eye(3)}), 'regions\\["half"\\] has 3 rows'),
        (
            dict(regions={name: beam().stiffness * 0.6 for name in "ab"}),
            r"regions add up to .* on the diagonal of node",
        ),
    ],
)
def test_what_cannot_be_a_model_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        beam(**changes).modes(count=4)


def test_a_mass_that_is_negative_between_rows_is_refused():
    mass = beam().mass.toarray()
    mass[4, 6] = mass[6, 4] = 2 * mass[4, 4]
    with pytest.raises(ValueError, match="mass is not positive: a motion"):
        beam(mass=mass)


def test_a_negative_mass_is_also_found_in_a_larger_model():
    arrays = Plate((12, 12), (0.3, 0.3)).model()
    mass = arrays["mass"].tolil()
    row, other = np.flatnonzero(arrays["dof"][:, 1] == 3)[[60, 75]]
    mass[row, other] = mass[other, row] = 1.5 * mass[row, row]
    with pytest.raises(ValueError, match="mass is not positive: a motion"):
        Matrices(**(arrays | dict(mass=mass)))


def test_a_row_with_neither_stiffness_nor_mass_is_refused_unless_it_is_held(plate):
    arrays = plate.model()
    idle = np.diag(np.arange(len(arrays["dof"])) == 7).astype(float)
    keep = np.eye(len(idle)) - idle
    arrays |= {name: keep @ arrays[name].toarray() @ keep for name in ("stiffness", "mass")}
    arrays["fixed"] = np.setdiff1d(arrays["fixed"], [7])
    with pytest.raises(ValueError, match=r"\(row 7\) has neither stiffness nor mass"):
        Matrices(**arrays)
    assert Matrices(**(arrays | dict(fixed=[*arrays["fixed"], 7]))).modes(count=1)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda model: model.modes(), "one of both is needed"),
        (lambda model: model.modes(count=2, up_to=3.0), "one of both is needed"),
        (lambda model: model.modes(up_to=1.0), r"modes\(up_to=1\) keeps no mode"),
        (lambda model: model.modes(count=0), r"modes\(count=0\) keeps no mode"),
        (lambda model: model.static_flexibility([99]), "rows names row 99"),
        (lambda model: model.static_flexibility([1], [0.5]), "columns has shape"),
        (
            lambda model: model.release([5], model.modes(count=1)),
            "node 3 rz .*, which is free",
        ),
        (lambda model: model.release([0, 0], model.modes(count=1)), "asked for a row twice"),
    ],
)
def test_what_cannot_be_asked_is_refused(ask, message):
    with pytest.raises(ValueError, match=message):
        ask(beam(fixed=[0, 1]))


def test_release_needs_a_structure_that_is_held():
    model = beam(fixed=[0])
    with pytest.raises(ValueError, match="with 1 rigid-body modes"):
        model.release([0], model.modes(count=2))


def test_the_model_says_what_it_is(plate):
    sentence = "Matrices: 20 nodes, 80 degrees of freedom, 32 of them held, 0 regions"
    assert repr(Matrices(**plate.model())) == sentence
