"""Laws at a port: what is read of them, and the slopes that descents follow."""

import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.reach import _free_law
from bayes_placement.criticism.reach._asked import NETWORK, OF_ROW, PLACE, Asked, LawsAsked, closed
from bayes_placement.criticism.reach._at_port import omega_of, rows_of
from bayes_placement.criticism.reach._free_law import AnyLaw, FreeLaw
from bayes_placement.criticism.reach._free_law_of_many import FreeLawOfMany, newton
from bayes_placement.criticism.reach._laws_in_full import LawsInFull
from bayes_placement.criticism.reach._ports import place_columns, ports_of, ports_of_many
from bayes_placement.experiment.frf import receptance
from bayes_placement.inference.residuals import Problem
from bayes_placement.laws.rows import NUMBERS
from bayes_placement.modes.points import Points
from tests.criticism.reach.cantilever import LINES, experiment, maxwell, measured

KINDS = ("displacement", "relative", "rotation", "cut")
OMEGA = 2 * np.pi * LINES


@pytest.fixture(scope="module")
def base():
    return null_hypothesis(experiment(), experiment().data(measured(maxwell))).problem


@pytest.fixture(scope="module", params=KINDS)
def reached(request, base):
    port = next(port for port in ports_of(base.experiment) if port.acts_on == request.param)
    problem = base.with_effect(port.effect)
    points = 0.3 * np.random.default_rng(0).standard_normal((2, problem.dimension))
    columns = place_columns(port, problem)
    if request.param == "relative":
        points[:, columns] = [[-0.4, 0.8], [-0.9, 0.2]]
    return port, FreeLaw(problem, columns), points


def test_residuals_are_linear_in_one_number_at_each_line(reached):
    _, free, points = reached
    at = free.at(points)
    random = np.random.default_rng(1)
    stiffness = (random.standard_normal(OMEGA.size) + 1j * random.standard_normal(OMEGA.size)) / (
        np.median(np.abs(at.receptance))
    )
    law = np.broadcast_to(stiffness, (2, OMEGA.size))
    found = free.residuals(points, law, np.ones_like(law))
    strength, _ = closed(stiffness, at.receptance, False)
    expected = at.left(strength)
    assert np.max(np.abs(found - expected)) < 1e-7 * np.max(np.abs(found))


def test_the_receptance_of_a_port_is_that_of_the_structure(base):
    port = ports_of(base.experiment)[0]
    problem = base.with_effect(port.effect)
    free = FreeLaw(problem, place_columns(port, problem))
    point = np.zeros((1, problem.dimension))
    (at,) = problem.coordinates.named(point)[f"structure.effects.{port.effect.name}.at"]
    structure = base.experiment.nominal().structure
    place = Points(jnp.array([at]), np.ones((1, 1)))
    expected = np.asarray(receptance(structure, place, place, jnp.asarray(OMEGA)))[0, 0]
    assert np.allclose(free.at(point).receptance[0], expected, rtol=1e-6)


def test_a_law_of_many_ports_is_that_of_one_where_there_is_one(reached):
    _, free, points = reached
    many = FreeLawOfMany(free.problem, free.held)
    one, other = free.at(points), many.at(points)
    assert np.allclose(one.left(one.best()), other.left(other.best()), atol=1e-3)
    stiffness = (0.3 + 0.2j) / np.median(np.abs(one.receptance)) * np.ones_like(one.receptance)
    for of_one, of_many in zip(one, many.about(points, stiffness), strict=True):
        # Second differences of a step of a hundredth leave five digits.
        assert np.allclose(of_one, of_many, rtol=1e-4, atol=1e-4 * np.max(np.abs(of_one)))


@pytest.mark.parametrize("acts_on", ["region", "structure"])
def test_residuals_with_a_law_on_many_ports_are_exact_about_it(base, acts_on):
    port = next(port for port in ports_of_many(base.experiment) if port.acts_on == acts_on)
    problem = base.with_effect(port.effect)
    free = port.free(problem, place_columns(port, problem))
    points = 0.3 * np.random.default_rng(0).standard_normal((2, problem.dimension))
    law = (0.3 + 0.2j) * np.broadcast_to(free.size(), (2, OMEGA.size))
    at = free.about(points, law)
    for other, tolerance in ((law, 1e-9), (law * (1 + 1e-4j), 1e-6)):
        strength, _ = closed(other, at.receptance, False)
        found = free.residuals(points, other, np.ones_like(other))
        moved = np.max(np.abs(found - free.residuals(points, 0 * law, np.ones_like(law))))
        assert np.max(np.abs(found - at.left(strength))) < tolerance * moved
    least = free.at(points)
    left = np.abs(free.residuals(points, newton(least), np.ones_like(law))) ** 2
    for step in (1.01, 0.99, 1 + 0.01j, 1 - 0.01j):
        beside = np.abs(free.residuals(points, newton(least) * step, np.ones_like(law))) ** 2
        assert np.mean(left.sum(axis=1) <= beside.sum(axis=1)) > 0.9


def gradient_of(cost, point, columns):
    steps = 1e-5 * np.eye(len(point))[columns]
    return np.array([(cost(point + step) - cost(point - step)) / 2e-5 for step in steps])


def test_slopes_with_a_law_that_is_free(reached, monkeypatch):
    _, free, points = reached
    objective = AnyLaw(free)
    moved = [n for n in range(points.shape[1]) if n not in free.held]
    found = objective.normal_equations(points[:1])
    expected = gradient_of(lambda p: objective.cost(p[None])[0], points[0], moved)
    assert np.allclose(found.gradient[0, moved], expected, rtol=1e-3, atol=1e-3)
    assert np.all(found.gradient[0, free.held] == 0.0)
    assert objective.cost(points[:1]) == pytest.approx(found.cost, rel=1e-9)
    together = objective.normal_equations(points)
    monkeypatch.setattr(_free_law, "MOST_SLOPES", 1)
    for part, whole in zip(objective.normal_equations(points), together, strict=True):
        np.testing.assert_allclose(part, whole, rtol=1e-9, atol=1e-9)


def test_slopes_of_laws_asked_for(reached):
    port, free, points = reached
    rows = rows_of(port, free)
    lines = np.arange(OMEGA.size)
    objective = LawsAsked(Asked.at(free, points, lines), rows, OMEGA, port.is_cut)
    row = np.zeros(OF_ROW)
    row[:NUMBERS] = 0.2 * np.random.default_rng(2).standard_normal(NUMBERS)
    row[NETWORK], row[PLACE] = len(rows.trees) - 3, 1
    found = objective.normal_equations(row[None])
    expected = gradient_of(lambda p: objective.cost(p[None])[0], row, range(NUMBERS))
    assert np.allclose(found.gradient[0, :NUMBERS], expected, rtol=1e-4, atol=1e-3)
    (drawn,) = objective.costs_of_draws(np.array([2]), 1, 1)[0]
    row[:NUMBERS], row[NETWORK] = np.random.default_rng(0).standard_normal((1, NUMBERS))[0], 2
    assert objective.cost(row[None])[0] == pytest.approx(drawn, rel=1e-9)


def test_laws_in_full_are_effects_of_the_experiment(reached):
    port, free, points = reached
    free = FreeLaw(free.problem)
    rows = rows_of(port, free)
    objective = LawsInFull(free, rows, omega_of(free), port.is_cut)
    number = rows.trees.index("k")
    numbers = np.zeros(NUMBERS)
    numbers[0] = -0.4
    point = np.concatenate([points[0], numbers, [number]])
    effect = port.with_law(rows.prior(number), "law")
    problem = free.problem
    known = Problem(problem.experiment.without(port.effect.name) + effect, problem.data)
    start = np.zeros((1, known.dimension))
    for name, place in problem.coordinates.places.items():
        target = name.replace(port.effect.name, "law")
        start[0, known.coordinates.places[target]] = points[0, place]
    (law,) = [name for name in known.coordinates.places if ".law.law" in name]
    start[0, known.coordinates.places[law]] = numbers[0]
    residual, _ = known.squares.residuals(start)
    expected = 0.5 * np.sum(residual**2) + 0.5 * np.sum(start**2)
    assert objective.cost(point[None])[0] == pytest.approx(expected, rel=1e-6)
    found = objective.normal_equations(point[None])
    columns = range(len(point) - 1)
    slopes = gradient_of(lambda p: objective.cost(p[None])[0], point, columns)
    assert np.max(np.abs(found.gradient[0, :-1] - slopes)) < 2e-3 * np.max(np.abs(slopes))
