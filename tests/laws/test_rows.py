"""Networks as rows of arrays: the laws that they stand for, their slopes, their priors."""

import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.criticism.reach._ports import ATTACHED, INNER, PLAIN
from bayes_placement.laws.catalogue import classes, is_grounded, networks
from bayes_placement.laws.rows import NUMBERS, NetworkRows, coordinates_of_numbers

TREES = networks("kcmph", 3)
ROWS = NetworkRows(TREES, 3e4, 400.0)
OMEGA = np.geomspace(50.0, 3000.0, 20)
WHICH = np.arange(len(TREES))
POINTS = 0.3 * np.random.default_rng(0).standard_normal((len(TREES), NUMBERS))


def stiffness(points):
    return ROWS.stiffness(WHICH, points, OMEGA)


def test_rows_are_the_laws_that_they_stand_for():
    of_rows = stiffness(POINTS)
    of_laws = [
        ROWS.law(int(number), POINTS[number]).dynamic_stiffness(jnp.asarray(OMEGA))
        for number in WHICH
    ]
    assert np.allclose(of_rows, np.array(of_laws), rtol=1e-11)


@pytest.mark.parametrize("coordinate", range(NUMBERS))
def test_slopes_are_those_of_differences(coordinate):
    step = 1e-6 * np.eye(NUMBERS)[coordinate]
    differences = (stiffness(POINTS + step) - stiffness(POINTS - step)) / 2e-6
    slopes = ROWS.at_lines(WHICH, POINTS, OMEGA)[1][:, coordinate]
    scale = np.abs(stiffness(POINTS))
    # Next to a resonance without damping the stiffness bends within a step.
    assert np.max(np.abs(slopes - differences) / scale) < 2e-6


@pytest.mark.parametrize("tree", [["-", "m", ["|", "c", "k"]], ["|", "k", "p"], ["-", "h", "m"]])
def test_the_numbers_of_a_law_are_coordinates_of_its_row(tree):
    number = TREES.index(tree)
    bar = bp.beams.bar(5, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    structure = bp.Structure(bar, damping=bp.damping.Modal(0.02))
    effect = effects.attached(0.4, ROWS.prior(number))
    unknowns = (structure + effect).effects["attached"]
    experiment = bp.Experiment(
        structure + effect,
        sensors=[bp.Sensor("s1", at=0.3)],
        actuators=[bp.Actuator("a1", at=0.6)],
        frequency=OMEGA / (2 * np.pi),
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(1e-5),
    )
    columns = coordinates_of_numbers(tree)
    values = {
        name: unknown.distribution.icdf(jnp.asarray(_probability(POINTS[number, column])))
        for (name, unknown), column in zip(experiment.unknown.items(), columns, strict=True)
    }
    known = experiment.fix(values).structure.effects["attached"].law
    assert unknowns.law.tree() == known.tree()
    found = known.dynamic_stiffness(jnp.asarray(OMEGA))
    assert np.allclose(found, stiffness(POINTS)[number], rtol=1e-6)


def _probability(coordinate):
    from scipy.special import ndtr

    return float(ndtr(coordinate))


def test_an_element_that_is_not_there_changes_nothing():
    one, two = (NetworkRows([tree], 1e4, 100.0) for tree in ("k", ["|", "c", "k"]))
    zero = np.zeros((1, NUMBERS))
    weak = zero.copy()
    weak[0, 0] = -20.0  # the dashpot
    at = np.zeros(1, int)
    assert np.allclose(one.at_lines(at, zero, OMEGA)[0], two.at_lines(at, weak, OMEGA)[0])


def test_networks_that_are_tried_are_of_different_classes():
    for trees in (ATTACHED, INNER):
        plain = [tree for tree in trees if "h" not in str(tree)]
        assert len(classes(plain[:8])) == 8 and len(set(map(str, trees))) == len(trees)
    assert not any("m" in str(tree) for tree in INNER)


@pytest.mark.long
def test_one_network_of_each_class_is_tried():
    found = classes([tree for tree in networks("kcm", 3) if is_grounded(tree)])
    assert [members[0] for members in found] == list(PLAIN)
