"""Effects that are applied beforehand give the response of effects that act in it."""

import jax
import numpy as np
import pytest

from bayes_placement.experiment.with_effects_applied import with_effects_applied
from tests.effects.test_effect_laws import AT, GROUPS, experiment, group, structure, together


@pytest.mark.long
@pytest.mark.parametrize("names", GROUPS, ids=" ".join)
def test_any_effects_together(names):
    base = experiment(structure())
    for effect in group(names, AT):
        base = base + effect
    expected = together(names)
    seen = jax.jit(lambda: with_effects_applied(base).receptance())()
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-13 * np.abs(expected).max())
