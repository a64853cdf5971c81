"""A model that does not explain the baseline is completed by it, and asked what came since."""

import pytest

import bayes_placement as bp
from bayes_placement import effects
from tests.criticism.small import experiment, measured

FORGOTTEN = effects.point_mass(0.62, 0.5)
"""What both states have, and the model lacks."""

SPRING = effects.ground_spring(0.313, 2e7)
MASS = effects.point_mass(0.313, 0.35, name="new")


def improved(after, before, model_error=None):
    candidates = effects.library(experiment(), ["point_mass", "ground_spring", "gain_error"])
    return bp.improve(
        experiment(), after, baseline=before, candidates=candidates, model_error=model_error
    )


@pytest.fixture(scope="module")
def before():
    return measured(FORGOTTEN, seed=1)


@pytest.mark.parametrize(
    "hidden", [SPRING, pytest.param(MASS, marks=[pytest.mark.long, pytest.mark.longest])]
)
def test_what_is_new_is_found_beside_what_was_forgotten(before, hidden):
    ledger = improved(measured(FORGOTTEN, hidden, seed=2), before)
    assert ledger.verdict == (hidden.kind,)
    assert ledger.baseline.effects == ("point_mass",)
    assert ledger.baseline_as_given.chi2_per_datum > 5 > 1.3 > ledger.baseline.chi2_per_datum
    new = ledger.steps[-1]
    place = new.estimates_of(new.added)["at"]
    assert place.low < 0.313 < place.high
    forgotten = new.estimates_of("point_mass")
    assert forgotten["at"].low < 0.62 < forgotten["at"].high
    assert "was completed by what explains the baseline best: point_mass, " in ledger.sentence()
    assert ledger.to_json()["baseline"]["added"] == "point_mass"


@pytest.mark.long
def test_nothing_is_new_where_nothing_came(before):
    ledger = improved(measured(FORGOTTEN, seed=3), before)
    assert ledger.verdict == () and ledger.baseline.effects == ("point_mass",)


@pytest.mark.long
def test_a_spring_that_was_forgotten_has_a_loss():
    """As real ones do: a spring without one leaves the baseline unexplained."""
    rubber = effects.attached(0.62, effects.LossySpring(8e6, 0.12))
    ledger = improved(measured(rubber, MASS, seed=2), measured(rubber, seed=1))
    assert ledger.verdict == ("point_mass",) and ledger.baseline.effects == ("ground_spring",)
    assert ledger.baseline.chi2_per_datum < 1.3
    estimates = ledger.steps[-1].estimates_of("ground_spring")
    assert 0.1 < estimates["law.loss_factor"].mean < 0.14


@pytest.mark.long
@pytest.mark.longest
def test_a_model_error_stays_beside_what_completes(before):
    ledger = improved(measured(FORGOTTEN, SPRING, seed=2), before, bp.model_error.Embedded())
    assert ledger.verdict == ("ground_spring",)


@pytest.mark.long
def test_explain_completes_by_one_effect(before):
    candidates = effects.library(experiment(), ["point_mass", "ground_spring"])
    ranking = bp.explain(
        experiment(),
        measured(FORGOTTEN, SPRING, seed=2),
        baseline=before,
        candidates=candidates,
        model_error=None,
    )
    assert ranking.claimed == ("ground_spring",) and ranking.baseline.effects == ("point_mass",)
    assert any("was completed by" in sentence for sentence in ranking.words())


@pytest.mark.long
def test_nothing_is_claimed_where_no_effect_explains_the_baseline():
    """A gain cannot stand for a mass."""
    candidates = effects.library(experiment(), ["gain_error"])
    ledger = bp.improve(
        experiment(),
        measured(FORGOTTEN, MASS, seed=2),
        baseline=measured(FORGOTTEN, seed=1),
        candidates=candidates,
        model_error=None,
    )
    assert ledger.verdict == () and ledger.baseline.effects == ()
    assert "with no effect that was tried it does" in ledger.sentence()
