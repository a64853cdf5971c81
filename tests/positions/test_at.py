"""Positions as a user writes them: which priors may lie on a structure."""

import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro.distributions.transforms import AffineTransform

from bayes_placement.positions.at import position_on

BAR = (0.0, 0.35)


def test_a_prior_without_quantile_function_is_taken():
    """A Beta distribution that is stretched without its domain: what it reaches is not known."""
    stretched = dist.TransformedDistribution(dist.Beta(2.0, 2.0), AffineTransform(0.1, 0.2))
    assert position_on(stretched, BAR, "Sensor") is stretched


def test_a_prior_up_to_the_edge_of_a_mesh_in_single_precision_is_taken():
    edge = float(np.nextafter(np.float32(0.35), np.float32(0.0)))
    prior = dist.Uniform(0.1, 0.35)
    assert position_on(prior, (0.0, edge), "Sensor") is prior


@pytest.mark.parametrize("low, high", [(0.1, 0.351), (-0.001, 0.2)])
def test_a_prior_that_reaches_beyond_is_refused(low, high):
    with pytest.raises(ValueError, match="lies outside the structure"):
        position_on(dist.Uniform(low, high), BAR, "Sensor")
