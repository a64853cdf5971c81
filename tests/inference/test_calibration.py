"""Ranks of true values among draws; the benchmark of this name has all engines and studies."""

import numpy as np
import pytest

from bayes_placement._shared import compiled as _compiled
from bayes_placement.inference.engines import about_mode
from tests.benchmarks.calibration_studies import ranked
from tests.benchmarks.uniform_ranks import p_value

pytestmark = pytest.mark.long


def test_draws_of_a_finalist_are_calibrated():
    rows = [ranked("bar", "finalist", replicate) for replicate in range(30)]
    # Ranks of different unknowns of a replicate are all but independent.
    assert p_value(np.array([rank for row in rows for rank in row.ranks.values()])) > 0.01


def test_problems_of_one_form_share_what_samples_them(monkeypatch):
    monkeypatch.setattr(about_mode, "LEAST_ESS", np.inf)  # so that SMC goes on from the Gaussian
    misses = []
    for replicate in (0, 1):
        ranked("bar", "finalist", replicate)
        misses.append(_compiled._jitted.cache_info().misses)
    assert misses[0] == misses[1]
