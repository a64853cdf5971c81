"""Beams of cubic elements, continuous or with a jump at a node.

Cubic elements are exact at their nodes for forces and jumps there. Independent of bayes_placement.
"""

import functools

import numpy as np
from scipy.linalg import eigh

LENGTH, AREA, MOMENT, STIFFNESS, DENSITY = 1.7, 2e-3, 3e-7, 7e10, 2700.0
BENDING, AXIAL = STIFFNESS * MOMENT, STIFFNESS * AREA
MASS = DENSITY * AREA * LENGTH
ELEMENTS = 20
NODES = np.linspace(0.0, LENGTH, ELEMENTS + 1)
READ = np.array([0, 2, 7, 11, 17, 20])  # nodes; neither symmetric nor equidistant
CUT = np.array([0, 2, 8, 13, 15, 19])


class Elements:
    """Hermite elements of a beam, the structure cut open where asked."""

    def __init__(self, ends):
        h = LENGTH / ELEMENTS
        turn = np.outer([1, h, 1, h], [1, h, 1, h])
        stiff = [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
        heavy = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
        self.stiff = BENDING / h**3 * np.array(stiff) * turn
        self.heavy = DENSITY * AREA * h / 420 * np.array(heavy) * turn
        size = 2 * (ELEMENTS + 1)
        fixed_freedoms = {"fixed": (0, 1), "pinned": (0,), "guided": (1,), "free": ()}
        left, right = ends.split("-")
        gone = [*fixed_freedoms[left], *(size - 2 + freedom for freedom in fixed_freedoms[right])]
        free = np.setdiff1d(np.arange(size), gone)
        self.mass = self._whole(self.heavy, size)
        block = np.ix_(free, free)
        squared, shapes = eigh(self._whole(self.stiff, size)[block], self.mass[block])
        self.shapes, self.elastic = np.zeros((size, squared.size)), squared > 1e-4 * squared[4]
        self.shapes[free] = shapes
        self.flexibility = self.shapes[:, self.elastic] / squared[self.elastic]
        self.flexibility = self.flexibility @ self.shapes[:, self.elastic].T

    def _whole(self, element, size):
        matrix = np.zeros((size, size))
        for first in range(0, size - 2, 2):
            matrix[first : first + 4, first : first + 4] += element
        return matrix

    def jump(self, node, component):
        """Displacements, stiffness and mass when an element leaves its left node by one."""
        window = slice(2 * node, 2 * node + 4)
        force, momentum = np.zeros(len(self.mass)), np.zeros(len(self.mass))
        force[window], momentum[window] = -self.stiff[component], self.heavy[component]
        rigid = self.shapes[:, ~self.elastic]
        shape = self.flexibility @ force - rigid @ (rigid.T @ momentum)
        moving = shape[window] + np.eye(4)[component]
        mass = shape @ (self.mass @ shape + 2 * momentum) + self.heavy[component, component]
        return shape, self.stiff[component] @ moving, mass


@functools.cache
def elements(ends):
    return Elements(ends)
