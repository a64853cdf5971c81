"""Simpler effects are fitted where the best one acts, whatever their own descents found."""

from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.kept_fits import kept_with_sizes
from bayes_placement.criticism.missing import _before_and_after as states
from bayes_placement.criticism.missing._fitted_candidates import only_scanned
from bayes_placement.criticism.missing._posterior_odds import Comparison
from bayes_placement.criticism.missing._simpler_laws import with_simpler_laws
from bayes_placement.inference.residuals_of_state import State
from tests.criticism.small import MASS, experiment, measured

pytestmark = pytest.mark.long

PLACE, WEIGHT = 0.313, 0.35


@pytest.fixture(scope="module")
def only_absorber():
    """A mass came since the baseline, and an absorber alone was fitted, from where the mass is."""
    setup = experiment().with_model_error(bp.model_error.Embedded())
    effects = bp.effects.library(
        setup.with_errors(None), ["tuned_absorber", "ground_dashpot", "point_mass"]
    ).effects
    earlier = states.state_of(setup, measured(seed=1))
    before = states.fitted_baseline(earlier, setup.model_error)
    unchanged = states.over_both(State(setup, setup.data(measured(MASS))), earlier, before)
    null, (absorber, *_) = states.nothing_new(unchanged), effects
    problem = null.problem.with_effect(absorber)
    places = problem.coordinates.places
    start = null.point_in(problem)
    for field, coordinate in {"at": -0.49, "mass": 1.3, "frequency": 2.5}.items():
        start[places[f"structure.effects.tuned_absorber.{field}"]] = coordinate
    fitted = kept_with_sizes(problem, start[None], (0.1, 0.01))
    best = replace(null, effects=(absorber,), **vars(fitted))
    candidates = only_scanned([(unchanged, effect) for effect in effects], lambda: None)
    return Comparison([null, best], {effect.kind: 1 for effect in effects}, candidates)


def test_a_mass_is_found_where_only_an_absorber_was_fitted(only_absorber):
    assert only_absorber.best().kinds == ("tuned_absorber",)
    found = with_simpler_laws(only_absorber)
    mass = found.best()
    assert mass.kinds == ("point_mass",)
    assert mass.log_evidence > only_absorber.best().log_evidence
    values = mass.problem.coordinates.named(mass.fit.point[None])
    place, weight = (
        float(np.squeeze(values[f"structure.effects.point_mass.{field}"]))
        for field in ("at", "mass")
    )
    assert place == pytest.approx(PLACE, abs=0.01) and weight == pytest.approx(WEIGHT, rel=0.05)
    # Nothing is simpler than one number.
    assert with_simpler_laws(found).hypotheses == found.hypotheses


@pytest.mark.parametrize(
    ("place", "mass"), [(0.7, dist.LogUniform(1e-3, 1.0)), (dist.Uniform(0.0, 1.0), 0.2)]
)
def test_a_mass_whose_place_or_size_is_known_is_left_as_it_is(only_absorber, place, mass):
    unchanged = only_absorber.candidates[0].base
    known = bp.effects.point_mass(place, mass)
    candidate = replace(only_absorber.candidates[0], base=unchanged, effect=known)
    found = with_simpler_laws(only_absorber._replace(candidates=[candidate]))
    assert found.hypotheses == only_absorber.hypotheses
