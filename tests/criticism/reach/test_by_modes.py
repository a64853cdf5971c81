"""Sums over channels by modes, against those of the same laws as effects of the experiment."""

import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.criticism.reach import _by_modes, _scanned
from bayes_placement.criticism.reach._free_law import FreeLaw
from bayes_placement.criticism.reach._law_by_modes import LawByModes
from bayes_placement.criticism.reach._ports import place_columns, ports_of
from bayes_placement.experiment.frf import motion, readings, receptance
from bayes_placement.inference.residuals import Problem
from bayes_placement.modes.points import Points
from tests.benchmarks import aircraft

NODES, NODE = 120, 44


@pytest.fixture(scope="module")
def reached():
    """The problem of an aircraft, and that with a law across the skin; its nodes."""
    whole = aircraft.skin(NODES, 20)
    setup, rows = aircraft.experiment(whole, 9, 2, np.linspace(4.0, 60.0, 30))
    setup = setup + bp.effects.point_mass(whole.position[7], 40.0)
    data = aircraft.measured(whole, setup, rows, NODE, 2, lambda omega: 3e5 + 0j * omega)
    problem = Problem(setup, setup.data(data))
    port = ports_of(setup)[2]
    return problem, port, problem.with_effect(port.effect)


def test_a_place_reads_the_motion_of_each_instrument():
    modes = bp.beams.bar(10, length=1.0, area=1e-3, youngs_modulus=1e9, density=9e3)
    structure = bp.Structure(modes, damping=bp.damping.Modal(0.02))
    structure += bp.effects.ground_spring(0.61, 2e5)
    omega = 2 * np.pi * jnp.linspace(50.0, 900.0, 7)
    driven, place = (Points(jnp.array(at), np.ones((len(at), 1))) for at in ([0.2, 0.45], [0.83]))
    read, expected = (
        compiled(function)(structure, place, driven, omega) for function in (readings, receptance)
    )
    moved = compiled(motion)(structure, driven, omega)
    np.testing.assert_allclose(jnp.einsum("pk,kil->pil", read, moved), expected, rtol=1e-9)


def first_order(free, points):
    """Least cost with a law that is free at each line, all else linear at no law."""
    at, lines = free.at(points), (len(points), free.problem.data.z.shape[-1])
    slopes = free.slopes(points, np.zeros(lines, complex), np.ones(lines, complex))
    pulls, squares = slopes.products(at.free)
    crossed, share = slopes.crossed(at.slope), 1 / at.information()
    pull, own = at.pull(), np.delete(np.arange(points.shape[1]), free.held)
    gradient = pulls + points - np.real(np.conj(crossed) @ (share * pull)[..., None])[..., 0]
    curvature = squares + np.eye(points.shape[1])
    curvature = curvature - np.real((share[:, None] * crossed) @ np.conj(crossed).swapaxes(1, 2))
    step = np.linalg.solve(curvature[:, own][..., own], gradient[:, own, None])[..., 0]
    left = np.sum(np.abs(at.free) ** 2, axis=(1, 2)) - np.sum(share * np.abs(pull) ** 2, axis=1)
    prior = np.sum(points[:, own] ** 2, axis=1)
    return 0.5 * (left + prior - np.sum(gradient[:, own] * step, axis=1))


def test_the_scan_of_all_nodes_is_the_free_law_at_each(reached, monkeypatch):
    problem, port, with_port = reached
    monkeypatch.setattr(_scanned, "MOST_NUMBERS", 0)
    monkeypatch.setattr(_by_modes, "BEST", 10)
    monkeypatch.setattr(_scanned, "BEST", NODES)
    point = np.array([0.3, -0.2])
    (found,) = _scanned.scanned(problem, point, [port], problem)
    free = FreeLaw(with_port, place_columns(port, with_port))
    points = np.zeros((NODES, with_port.dimension))
    points[:, free.held] = found.places
    points[:, [n for n in range(points.shape[1]) if n not in free.held]] = point
    expected = 2 * first_order(free, points)
    assert found.scanned == NODES
    np.testing.assert_allclose(found.squares[:10], expected[:10], rtol=1e-6)
    np.testing.assert_allclose(found.squares, expected, rtol=2e-3)


def test_a_law_by_modes_is_that_of_the_problem(reached):
    problem, port, with_port = reached
    free = FreeLaw(with_port, place_columns(port, with_port))
    by_modes = LawByModes(problem, free, port.effect_in(with_port.experiment))
    points = 0.3 * np.random.default_rng(0).standard_normal((4, with_port.dimension))
    points[2, [n for n in range(points.shape[1]) if n not in free.held]] = points[0, -1]
    for found, expected in zip(by_modes.at(points), free.at(points), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
    law = free.at(points).best()
    slopes = [each.slopes(points, law, np.ones_like(law)) for each in (by_modes, free)]
    scale = np.abs(slopes[1].along).max()
    np.testing.assert_allclose(slopes[0].along, slopes[1].along, atol=1e-6 * scale)


@pytest.mark.long
@pytest.mark.longest
def test_reach_of_a_scanned_mesh_finds_the_node_and_the_law(monkeypatch):
    whole = aircraft.skin(NODES, 20)
    setup, rows = aircraft.experiment(whole, 9, 2, np.linspace(4.0, 60.0, 60))
    data = aircraft.measured(
        whole, setup, rows, NODE, 2, lambda omega: 3e5 * (1 + 0.2j) + 0 * omega
    )
    monkeypatch.setattr(_scanned, "MOST_NUMBERS", 0)
    monkeypatch.setattr(_scanned, "MOST_DATA", 1080)
    monkeypatch.setattr(_scanned, "FEWEST_LINES", 15)
    found = bp.reach(setup, data)
    best = found.laws.iloc[0]
    np.testing.assert_allclose(best[["x", "y", "z"]].astype(float), whole.position[NODE], atol=1e-3)
    assert (best["setting"], best["law"].tree()) == ("along z", "h")
    assert best["chi2_per_datum"] == pytest.approx(1.0, abs=5 * np.sqrt(2 / 1080))
    assert found.in_bands is None  # its lines would be others
