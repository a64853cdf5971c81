"""Structures that hide effects from invisible to plain have the properties stated."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulator.fine_elements import NOTHING, Effect
from tests.simulator.graded_draws import EXCESS, FAINT, FEW_DATA, MASS, faint, graded
from tests.simulator.hidden_structures import accelerance

pytestmark = pytest.mark.long  # only benchmarks draw structures


def missed(draw, true, hidden):
    """Excess of chi2 per datum of a structure and an effect, by the noise of the records."""
    levels = [
        (record, accelerance(true, draw.sensors, draw.actuators, record.frequency, hidden))
        for record in draw.records
    ]
    return np.mean([np.abs(level.frf - exact) ** 2 / level.variance() for level, exact in levels])


BOUNDS = {graded: EXCESS, faint: (FAINT[0] / FEW_DATA, FAINT[1] / FEW_DATA)}


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("family", BOUNDS)
def test_records_are_those_of_all_that_is_hidden(family, seed):
    drawn = family(seed)
    draw = drawn.draw
    assert (
        len(drawn.hidden)
        == len(drawn.excess)
        == len(draw.true.attached) + (draw.hidden.name != "nothing")
    )
    assert all(BOUNDS[family][0] <= excess <= BOUNDS[family][1] for excess in drawn.excess)
    if draw.records[0].force_level is None:
        count = draw.records[0].frf.size
        assert abs(missed(draw, draw.true, draw.hidden) - 1) < 5 / np.sqrt(count)


def test_all_numbers_of_effects_are_drawn():
    counts = {len(graded(seed).hidden) for seed in range(8)}
    assert counts == {0, 1, 2}
    two = next(drawn for drawn in map(graded, range(8)) if len(drawn.hidden) == 2)
    assert two.hidden[1] == MASS != two.hidden[0]
    assert graded(3).hidden == graded(3).hidden


def test_an_attached_mass_is_the_effect_of_a_mass():
    """Where the modes themselves have a mass, their damping ratios are as without it."""
    draw = faint(2).draw
    bare, mass = replace(draw.true, attached=()), ((0.3 * draw.true.length, 0.1),)
    at, kilograms = mass[0]
    effect = Effect("point_mass", (("at", at), ("mass", kilograms)))
    frequency = draw.records[0].frequency

    def response(line, hidden=NOTHING):
        return accelerance(line, draw.sensors, draw.actuators, frequency, hidden)

    expected = response(bare, effect)
    np.testing.assert_allclose(response(replace(bare, attached=mass)), expected, rtol=1e-9)
    assert not np.allclose(response(replace(bare, masses=mass)), expected, rtol=1e-4)


def test_few_data_are_few():
    for draw in (faint(seed).draw for seed in range(4)):
        assert [record.frf.shape for record in draw.records] == [(3, 1, 75)]
