"""Networks read off from what is measured at a port."""

import json

import numpy as np
import pytest

from bayes_placement.criticism.reach._ports import INNER, PLAIN
from bayes_placement.laws.rows import LOGARITHM, NUMBERS, NetworkRows, rational

OMEGA = 2 * np.pi * np.geomspace(20.0, 2000.0, 160)
MIDDLE = float(np.sqrt(OMEGA[0] * OMEGA[-1]))
S = 1j * OMEGA / MIDDLE
RECEPTANCE = 1 / (1 + 0.02j * OMEGA / 900 - (OMEGA / 900) ** 2) + 0.3


def drawn(tree, seed):
    """Natural logarithms of a network's elements, and its dynamic stiffness at the lines."""
    rows = NetworkRows([tree], 1.0, MIDDLE)
    point = np.zeros((1, NUMBERS))
    point[0, :3] = 0.4 * np.random.default_rng(seed).standard_normal(3)
    return LOGARITHM * point[0, :3], rows.at_lines(np.array([0]), point, OMEGA)[0][0]


def read(tree, stiffness, is_cut, noise=0.0):
    """Dynamic stiffness of the network that is read off from its strength at the port."""
    strength = 1 / (stiffness + RECEPTANCE) if is_cut else stiffness / (1 + RECEPTANCE * stiffness)
    generator = np.random.default_rng(7)
    error = noise * np.abs(strength)
    strength = strength + error * (generator.standard_normal((2, 160)).T @ [1, 1j]) / np.sqrt(2)
    weight = np.ones(160) if noise == 0 else 1 / error
    logs = rational(tree).numbers(strength[None], RECEPTANCE[None], weight[None], S, is_cut)
    point = np.zeros((1, NUMBERS))
    point[0, : logs.shape[1]] = logs[0] / LOGARITHM
    return NetworkRows([tree], 1.0, MIDDLE).at_lines(np.array([0]), point, OMEGA)[0][0]


@pytest.mark.parametrize("tree", PLAIN, ids=json.dumps)
def test_a_network_is_read_off_without_noise(tree):
    _, stiffness = drawn(tree, 1)
    np.testing.assert_allclose(read(tree, stiffness, False), stiffness, rtol=1e-5)


@pytest.mark.parametrize("tree", [t for t in PLAIN if t in INNER], ids=json.dumps)
def test_a_network_in_a_cut_is_read_off(tree):
    _, stiffness = drawn(tree, 2)
    np.testing.assert_allclose(read(tree, stiffness, True), stiffness, rtol=1e-5)


def test_a_resonance_without_damping_is_read_off_with_noise():
    tree = ["|", "k", ["-", "k", "m"]]
    _, stiffness = drawn(tree, 3)
    far = np.median(np.abs(read(tree, stiffness, False, noise=0.01) / stiffness - 1))
    assert far < 0.02


def test_a_network_that_would_need_a_negative_element_is_not_read_off():
    strength = -1 / (1 - RECEPTANCE[None])
    logs = rational("k").numbers(strength, RECEPTANCE[None], np.ones((1, 160)), S, False)
    assert np.isnan(logs).all()


def test_a_springpot_is_no_quotient_of_polynomials():
    assert rational(["|", "k", "p"]) is None
