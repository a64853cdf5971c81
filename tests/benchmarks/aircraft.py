"""A synthetic aircraft: beams with stiff sections, whose skin is read at many nodes.

Beams in space carry rigid sections; nodes of the skin follow these. So a few hundred degrees of
freedom give the modes, and as many nodes as are asked for move by them. Nothing of this package
makes the data.
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

import bayes_placement as bp

YOUNGS, SHEAR, DENSITY = 7e10, 2.7e10, 2700.0
BEAMS = (
    # Start, end [m], elements, half-width and half-height of the skin [m], wall [m].
    ((0.0, 0.0, 0.0), (14.0, 0.0, 0.0), 14, (0.9, 0.9), 4e-3),
    ((6.0, 0.0, 0.0), (7.5, 8.0, 0.6), 10, (0.8, 0.12), 5e-3),
    ((6.0, 0.0, 0.0), (7.5, -8.0, 0.6), 10, (0.8, 0.12), 5e-3),
    ((13.0, 0.0, 0.0), (14.0, 3.0, 0.1), 5, (0.4, 0.08), 3e-3),
    ((13.0, 0.0, 0.0), (14.0, -3.0, 0.1), 5, (0.4, 0.08), 3e-3),
    ((13.0, 0.0, 0.0), (14.5, 0.0, 2.5), 5, (0.4, 0.08), 3e-3),
)
LOSS, NOISE = 0.02, 0.03
"""Loss factor, and standard deviation of the noise over the mean amplitude."""


class Skin(NamedTuple):
    """Nodes of the skin and its modes."""

    position: np.ndarray
    """Positions [m] [node, 3]."""
    shape: np.ndarray
    """Mass-normalised shapes [node, axis, mode]."""
    natural: np.ndarray
    """Natural angular frequencies [rad/s]."""


def skin(nodes, modes):
    """Nodes all over the skin, and modes of the beams beneath."""
    points, sections, pieces = _mesh()
    stiffness, mass = (np.zeros((6 * len(points),) * 2) for _ in range(2))
    for ends, frame, (wide, high), wall in pieces:
        k, m = _element(np.linalg.norm(np.diff(points[list(ends)], axis=0)), wide, high, wall)
        turned = np.kron(np.eye(4), frame)
        rows = np.concatenate([6 * end + np.arange(6) for end in ends])
        stiffness[np.ix_(rows, rows)] += turned.T @ k @ turned
        mass[np.ix_(rows, rows)] += turned.T @ m @ turned
    values, vectors = eigh(stiffness, mass, subset_by_index=(0, modes - 1))
    natural = np.sqrt(np.clip(values, 0.0, None))
    natural[:6] = 0.0  # it is free
    position, owner = _around(points, sections, nodes)
    of_owner = vectors.reshape(len(points), 6, modes)[owner]
    arm = position - points[owner]
    shape = of_owner[:, :3] + np.cross(of_owner[:, 3:], arm[:, :, None], axis=1)
    return Skin(position, shape, natural)


def experiment(whole, sensors, shakers, lines):
    """Sensors in every direction at some nodes, some shakers across; modulus and loss unknown."""
    from numpyro.distributions import LogNormal, Uniform

    count = len(whole.position)
    model = bp.finite_elements.ModalModel.from_arrays(
        position=whole.position,
        shape=whole.shape,
        natural_frequency=whole.natural / (2 * np.pi),
        modal_mass=1.0,
    )
    modes = bp.finite_elements.modes_from_shapes(
        model,
        bp.finite_elements.interpolation.nearest(model),
        youngs_modulus=LogNormal(0.0, 0.02),
    )
    structure = bp.Structure(modes, damping=bp.damping.Structural(Uniform(0.01, 0.04)))
    at = np.linspace(0, count - 1, sensors // 3 + 2).astype(int)[1:-1]
    driven = np.linspace(0, count - 1, shakers + 2).astype(int)[1:-1] + 5
    return bp.Experiment(
        structure,
        sensors=[
            bp.Sensor(f"s{number}", at=whole.position[node], directions=(1, 2, 3))
            for number, node in enumerate(at)
        ],
        actuators=[
            bp.Actuator(f"a{number}", at=whole.position[node], directions=(3,))
            for number, node in enumerate(driven)
        ],
        frequency=lines,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromVariance(),
    ), (at, driven)


def measured(whole, setup, rows, node, axis, law, seed=0):
    """FRFs with a law [N/m] at a node along an axis, and noise."""
    sensors, shakers = rows
    omega = 2 * np.pi * np.asarray(setup.frequency)
    modal = 1 / ((1 + 1j * LOSS) * (whole.natural**2)[:, None] - omega**2)
    read = whole.shape[sensors].reshape(-1, len(whole.natural))
    driven, port = whole.shape[shakers, 2], whole.shape[node, axis]
    own = (port**2) @ modal
    strength = law(omega) / (1 + own * law(omega))
    to_port, from_port = (read * port) @ modal, (driven * port) @ modal
    random, frf = np.random.default_rng(seed), []
    for row, shaker in enumerate(driven):
        exact = (read * shaker) @ modal - to_port * strength * from_port[row]
        frf.append(-(omega**2) * exact)
    frf = np.stack(frf, axis=1)
    variance = np.broadcast_to((NOISE * np.abs(frf).mean()) ** 2, frf.shape)
    noise = random.standard_normal((2, *frf.shape)) * np.sqrt(variance / 2)
    return bp.Measurement.from_arrays(
        frf + noise[0] + 1j * noise[1],
        setup.frequency,
        sensors=setup.sensor_channels,
        actuators=setup.actuator_channels,
        quantity="accelerance",
        variance=np.array(variance),
    )


def _mesh():
    """Points of the beams, the section about each, and elements with their frames."""
    points, sections, pieces = [], [], []

    def numbered(place):
        for number, known in enumerate(points):
            if np.allclose(known, place, atol=1e-9):
                return number
        points.append(np.asarray(place))
        return len(points) - 1

    for start, end, count, size, wall in BEAMS:
        start, end = np.array(start), np.array(end)
        along = (end - start) / np.linalg.norm(end - start)
        frame = _frame(along)
        chain = [numbered(start + share * (end - start)) for share in np.arange(count + 1) / count]
        pieces += [(pair, frame, size, wall) for pair in itertools.pairwise(chain)]
        sections += [(pair, frame, size) for pair in itertools.pairwise(chain)]
    return np.array(points), sections, pieces


def _frame(along):
    """Axes of a beam: along it, along the width of its section, and along the height."""
    up = np.array([0.0, 0.0, 1.0]) if abs(along[2]) < 0.8 else np.array([0.0, 1.0, 0.0])
    wide = np.cross(up, along)
    wide /= np.linalg.norm(wide)
    return np.stack([along, wide, np.cross(along, wide)])


def _around(points, sections, nodes):
    """Positions all around each element, and the end of it that each follows."""
    each = -(-nodes // len(sections))
    position, owner = [], []
    share = (np.arange(each) + 0.5) / each
    angle = 2 * np.pi * 0.618034 * np.arange(each)  # no two alike
    for (first, last), frame, (wide, high) in sections:
        around = np.cos(angle)[:, None] * wide * frame[1] + np.sin(angle)[:, None] * high * frame[2]
        along = points[first] + share[:, None] * (points[last] - points[first])
        position.append(along + around)
        owner.append(np.where(share < 0.5, first, last))
    return np.concatenate(position)[:nodes], np.concatenate(owner)[:nodes]


def _element(length, wide, high, wall):
    """Stiffness and mass of a thin-walled beam element in its own axes."""
    area = 4 * wall * (wide + high)
    about_wide = wall * 4 * high**2 * (wide + high / 3)
    about_high = wall * 4 * wide**2 * (high + wide / 3)
    torsion = 16 * wide**2 * high**2 * wall / (wide + high)
    k, m = np.zeros((12, 12)), np.zeros((12, 12))
    pair = np.array([[1, -1], [-1, 1]]) / length
    for row, size, inertia in ((0, YOUNGS * area, area), (3, SHEAR * torsion, 2 * about_high)):
        rows = [row, row + 6]
        k[np.ix_(rows, rows)] += size * pair
        m[np.ix_(rows, rows)] += DENSITY * inertia * length / 6 * np.array([[2, 1], [1, 2]])
    for rows, second, sign in (((1, 5, 7, 11), about_high, 1), ((2, 4, 8, 10), about_wide, -1)):
        bent, moved = _bending(length, sign)
        k[np.ix_(rows, rows)] += YOUNGS * second / length**3 * bent
        m[np.ix_(rows, rows)] += DENSITY * area * length / 420 * moved
    return k, m


def _bending(length, sign):
    """Hermite matrices of deflection and slope, whose sign follows from the axis."""
    side = sign * length
    square = length**2
    k = [
        [12, 6 * side, -12, 6 * side],
        [6 * side, 4 * square, -6 * side, 2 * square],
        [-12, -6 * side, 12, -6 * side],
        [6 * side, 2 * square, -6 * side, 4 * square],
    ]
    m = [
        [156, 22 * side, 54, -13 * side],
        [22 * side, 4 * square, 13 * side, -3 * square],
        [54, 13 * side, 156, -22 * side],
        [-13 * side, -3 * square, -22 * side, 4 * square],
    ]
    return np.array(k), np.array(m)
