"""A mode that the model cannot have: its closed form, and finding it in what was measured."""

import dataclasses

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._scanned_candidates import scanned
from tests.criticism.small import LINES, MASS, TRUTH, experiment, measured

INERTIA, STIFFNESS, VISCOSITY = 3.6e-3, 2.88e4, 0.36
OFFSETS, FORCED = np.array([0.012, -0.017]), 0.02
NATURAL = np.sqrt(STIFFNESS / INERTIA)
TWIST = effects.further_mode(
    OFFSETS[:, None] * FORCED / INERTIA,
    frequency=NATURAL / (2 * np.pi),
    damping_ratio=VISCOSITY / (2 * INERTIA * NATURAL),
)
"""A bar that also turns about its axis on a spring, read and driven beside the axis [m]."""


def test_a_body_that_turns_as_well_adds_what_sensors_beside_its_axis_see():
    true = experiment().fix(TRUTH)
    omega = 2 * np.pi * LINES
    turning = FORCED / (STIFFNESS - INERTIA * omega**2 + 1j * VISCOSITY * omega)
    expected = -(omega**2) * OFFSETS[:, None, None] * turning
    added = (true + TWIST).nominal_measurement().frf - true.nominal_measurement().frf
    np.testing.assert_allclose(added, expected, rtol=1e-9)


@pytest.mark.parametrize("levels", [1, 2])
def test_its_scan_solves_for_the_residues_within_the_width_of_its_resonance(levels):
    forces = [1.0, 2.0][:levels]
    setup = experiment(force_levels=forces).fix(TRUTH)
    measurement = [
        dataclasses.replace(measured(TWIST, seed=2), force_level=force) for force in forces
    ]
    null = null_hypothesis(setup, setup.data(measurement))
    (candidate,) = effects.library(setup, ["further_mode"]).effects
    (found,) = scanned([(null, candidate)], lambda: None)
    point = np.zeros((1, found.problem.dimension))
    point[0] = found.best_places(1)[0]
    values = found.problem.coordinates.named(point)
    of = {name.rpartition(".")[2]: np.squeeze(value) for name, value in values.items()}
    assert of["frequency"] == pytest.approx(TWIST.frequency, rel=TWIST.damping_ratio)
    np.testing.assert_allclose(of["residue"], TWIST.residue.ravel(), rtol=0.3)


SECOND = effects.further_mode(
    np.array([[-0.05], [0.03]]), frequency=610.0, damping_ratio=0.012, name="second"
)


@pytest.mark.parametrize("beside", [(), (MASS,), (SECOND,)])
def test_it_is_named_alone_and_beside_a_mass_or_another(beside):
    measurement = measured(TWIST, *beside, seed=3)
    candidates = effects.library(
        experiment(), ["point_mass", "ground_spring", "gain_error", "further_mode"]
    )
    ledger = bp.improve(experiment(), measurement, candidates=candidates)
    assert sorted(ledger.verdict) == sorted(["further_mode", *(each.kind for each in beside)])
    estimates = ledger.steps[-1].estimates_of("further_mode")
    assert estimates["frequency"].low < TWIST.frequency < estimates["frequency"].high
    assert "residue at s1" in str(ledger) and "residue" not in ledger.sentence()
    assert "torsion" in ledger.sentence()


def test_without_phases_it_is_not_tried():
    amplitudes = eqx.tree_at(
        lambda tree: tree.observe, experiment(), bp.observe.LogAmplitude("acceleration")
    )
    assert not effects.library(amplitudes, ["further_mode"]).effects
    assert effects.library(experiment(), ["further_mode"]).effects


def test_residues_of_another_shape_are_refused_with_values_of_their_size():
    with pytest.raises(InputError, match=r"residue=np\.full\(\(2, 1\), 0\.3\)"):
        experiment() + effects.further_mode(np.array([0.2, 0.3, 0.4]), 40.0, 0.01)
    prior = dist.Normal(np.zeros(3), 1.0).to_event(1)
    with pytest.raises(InputError, match=r"residue=np\.full\(\(2, 1\), 0\)"):
        experiment() + effects.further_mode(prior, 40.0, 0.01)
