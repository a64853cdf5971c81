"""A fine mesh of cubic elements with any sparse matrix added, or cut open at a node.

Independent of bayes_placement.
"""

import functools

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

LENGTH, AREA, MOMENT, STIFFNESS, DENSITY = 0.6, 3e-4, 2.5e-9, 7e10, 2700.0
BENDING, PER_LENGTH = STIFFNESS * MOMENT, DENSITY * AREA
ELEMENTS = 240
SIZE = LENGTH / ELEMENTS
ROWS = 2 * (ELEMENTS + 1)

_TURN = np.outer([1, SIZE, 1, SIZE], [1, SIZE, 1, SIZE])
STIFF = (
    _TURN * np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / SIZE**3
)
HEAVY = (
    _TURN
    * np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    * SIZE
    / 420
)
FIXED = {"fixed": (0, 1), "pinned": (0,), "guided": (1,), "free": ()}


def node(place):
    """Number of the node at a place [m]."""
    number = round(place / SIZE)
    assert abs(number * SIZE - place) < 1e-9, "the place is no node"
    return number


def row(place, slope=False):
    """Weights of the freedoms in the deflection or slope at a place."""
    return np.eye(1, ROWS, 2 * node(place) + slope)[0]


def beside(place, arm=0.0):
    """Weights of the freedoms in the deflection at the end of a rigid arm."""
    return row(place) + arm * row(place, slope=True)


def outer(weights):
    """Matrix of a law between the freedoms that it acts on."""
    return scipy.sparse.csc_array(np.outer(weights, weights))


def spread(element, start, end):
    """A matrix of each element, summed over those of a segment."""
    window = 2 * np.arange(node(start), node(end))[:, None] + np.arange(4)
    rows, columns = np.repeat(window, 4, axis=1).ravel(), np.tile(window, 4).ravel()
    values = np.tile(np.ravel(element), len(window))
    return scipy.sparse.csc_array((values, (rows, columns)), (ROWS, ROWS))


@functools.cache
def matrices():
    return BENDING * spread(STIFF, 0.0, LENGTH), PER_LENGTH * spread(HEAVY, 0.0, LENGTH)


def receptance(places, omega, added, ends="fixed-free"):
    """Receptance between places, or ends of arms, with a matrix added, a function of omega."""
    stiffness, mass = matrices()
    return _between(places, omega, lambda w: stiffness - w**2 * mass + added(w), ends)


def cut_open(places, omega, at, law, freedom, ends="fixed-free"):
    """Receptance once the deflection (0) or slope (1) may jump at a node, held by a law."""
    gone, copy = 2 * node(at) + freedom, ROWS
    stiffness, mass = (np.pad(matrix.toarray(), (0, 1)) for matrix in matrices())
    window = [copy if i == gone else i for i in range(2 * node(at), 2 * node(at) + 4)]
    straight = list(range(2 * node(at), 2 * node(at) + 4))
    for matrix, element in ((stiffness, BENDING * STIFF), (mass, PER_LENGTH * HEAVY)):
        matrix[np.ix_(straight, straight)] -= element
        matrix[np.ix_(window, window)] += element
    stiffness, mass = map(scipy.sparse.csc_array, (stiffness, mass))
    opened = outer(np.eye(1, ROWS + 1, gone)[0] - np.eye(1, ROWS + 1, copy)[0])
    return _between(places, omega, lambda w: stiffness - w**2 * mass + law(w) * opened, ends)


def _between(places, omega, dynamic_stiffness, ends):
    size = dynamic_stiffness(omega[0]).shape[0]
    left, right = ends.split("-")
    held = [*FIXED[left], *(ROWS - 2 + freedom for freedom in FIXED[right])]
    free = np.setdiff1d(np.arange(size), held)
    read = np.zeros((size, len(places)))
    read[:ROWS] = np.array([beside(*np.atleast_1d(place)) for place in places]).T
    solutions = [_solved(dynamic_stiffness(w)[free][:, free], read[free]) for w in omega]
    return np.moveaxis(np.array([read[free].T @ solution for solution in solutions]), 0, -1)


def _solved(matrix, right):
    """Solution of a sparse system, each right side a column."""
    return scipy.sparse.linalg.spsolve(matrix, right).reshape(right.shape)
