"""Measurements of crude models: the fault is there, and a change moves what it says."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulator.crude_draws import FAULTS, SHIFT, draw, natural
from tests.simulator.fine_elements import effect, plant
from tests.simulator.imperfect_scenes import FORMS, MODES, drawn

pytestmark = pytest.mark.long  # only benchmarks draw structures


def test_a_mass_moves_frequencies_as_one_of_the_mesh_does():
    scene = drawn((3, 0), "beam")
    place, mass = 0.3 * scene.true.length, 0.1 * scene.true.mass
    heavier = replace(scene.true, masses=(*scene.true.masses, (place, mass)))
    of_mesh = plant(heavier).natural[2:MODES]  # the first two are rigid
    found = natural(scene, effect("point_mass", at=place, mass=mass))[2:MODES]
    np.testing.assert_allclose(found, of_mesh, rtol=2e-3)


@pytest.mark.parametrize("seed", range(len(FORMS)))
def test_forms_and_faults_take_turns_and_a_change_is_as_large_as_asked(seed):
    unchanged, changed = draw(seed, False), draw(seed, True)
    assert changed.fault == next(iter(FAULTS[changed.form])) == unchanged.fault
    assert unchanged.hidden.name == "nothing"
    assert 0.95 * SHIFT[0] < changed.shift < 1.05 * SHIFT[1]
    of_before, of_after = (np.abs(each.frf) for each in (changed.baseline, changed.records[0]))
    assert np.median(np.abs(np.log(of_after / of_before))) > 0.05
