"""Random structures that hide an effect have the properties stated."""

import numpy as np
import pytest

from tests.simulator import hidden_draws, hidden_scenes
from tests.simulator.hidden_structures import accelerance

pytestmark = pytest.mark.long  # only benchmarks draw structures


@pytest.mark.parametrize("name", [None, *hidden_scenes.EFFECTS])
def test_a_draw_hides_what_it_says(name):
    draw = hidden_draws.draw(5, name)
    assert draw.hidden.name == (name or "nothing")
    low, high = hidden_draws.MISFIT if name else (1.0, 1.0)
    assert low <= draw.misfit <= high
    for field, (least, most) in draw.priors.items():
        assert least <= getattr(draw.true, field) <= most
        assert least <= getattr(draw.nominal, field) <= most
    for instrument in (*draw.sensors, *draw.actuators):
        assert abs(instrument.true - instrument.recorded) <= instrument.within
        assert 0 < instrument.true < draw.true.length
    for level in draw.records:
        exact = accelerance(
            draw.true,
            draw.sensors,
            draw.actuators,
            level.frequency,
            draw.hidden,
            level.force_level or 1.0,
        )
        chi2 = np.abs(level.frf - exact) ** 2 / level.variance()
        assert abs(chi2.mean() - 1) < 5 / np.sqrt(chi2.size)


@pytest.mark.parametrize("seed", range(5))
def test_the_band_holds_four_to_nine_modes(seed):
    scene = hidden_scenes.drawn((seed, 0), None, 0.0)
    low, high = 2 * np.pi * scene.frequency[[0, -1]]
    natural = hidden_scenes.elastic(scene.nominal)
    assert 4 <= np.sum((natural > low) & (natural < high)) <= 9
    assert natural[0] > 2 * low


def test_a_draw_is_its_seed():
    first, again, other = (hidden_draws.draw(seed, "any") for seed in (3, 3, 4))
    assert first.hidden == again.hidden
    assert np.array_equal(first.records[0].frf, again.records[0].frf)
    assert first.hidden != other.hidden


def test_what_the_stiffness_can_imitate_is_drawn_stronger_when_tuned_after_a_fit():
    name = "compliant_support"
    weak, strong = (hidden_draws.tuned((3, 0), name, after_fit) for after_fit in (False, True))
    assert hidden_draws.fitted_misfit(weak) < 1.5
    assert 3 < hidden_draws.fitted_misfit(strong) < 30
    assert strong.misfit() > 100
