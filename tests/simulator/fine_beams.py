"""A fine mesh of cubic elements with any complex matrix added, or cut open at a node.

Independent of bayes_placement.
"""

import functools

import numpy as np

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


def spread(element, start, end):
    """A matrix of each element, summed over those of a segment."""
    total = np.zeros((ROWS, ROWS), dtype=np.asarray(element).dtype)
    for number in range(node(start), node(end)):
        window = slice(2 * number, 2 * number + 4)
        total[window, window] += element
    return total


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
    stiffness, mass = (np.pad(matrix, (0, 1)) for matrix in matrices())
    window = [copy if i == gone else i for i in range(2 * node(at), 2 * node(at) + 4)]
    straight = list(range(2 * node(at), 2 * node(at) + 4))
    for matrix, element in ((stiffness, BENDING * STIFF), (mass, PER_LENGTH * HEAVY)):
        matrix[np.ix_(straight, straight)] -= element
        matrix[np.ix_(window, window)] += element
    jump = np.eye(1, ROWS + 1, gone)[0] - np.eye(1, ROWS + 1, copy)[0]
    opened = np.outer(jump, jump)
    return _between(places, omega, lambda w: stiffness - w**2 * mass + law(w) * opened, ends)


def _between(places, omega, dynamic_stiffness, ends):
    size = len(dynamic_stiffness(omega[0]))
    left, right = ends.split("-")
    held = [*FIXED[left], *(ROWS - 2 + freedom for freedom in FIXED[right])]
    free = np.setdiff1d(np.arange(size), held)
    read = np.zeros((size, len(places)))
    read[:ROWS] = np.array([beside(*np.atleast_1d(place)) for place in places]).T
    solutions = [
        np.linalg.solve(dynamic_stiffness(w)[np.ix_(free, free)], read[free]) for w in omega
    ]
    return np.moveaxis(np.array([read[free].T @ solution for solution in solutions]), 0, -1)
