"""What is claimed where a model error is allowed: evidence alone does not suffice."""

import dataclasses

import pytest

from bayes_placement.criticism.missing import _answers
from bayes_placement.criticism.missing._answers import Answer
from tests.criticism.missing.test_posterior_odds import comparison, hypothesis

LEVEL = 0.01


def erroneous(kinds, evidence, chi2):
    exact = hypothesis(kinds, evidence)
    return dataclasses.replace(exact, has_errors=True, chi2_when_exact=chi2)


def claimed(monkeypatch, chi2, *, held_out=1.0, error=0.1, baseline=None):
    """Kinds that are claimed of a mass of plain evidence, chi2 of the exact model being 100."""
    none, mass = erroneous([], 0.0, 100.0), erroneous(["point_mass"], 30.0, chi2)
    scores = {id(none): 0.0, id(mass): held_out}

    def gain(one, other):
        return scores[id(one)] - scores[id(other)], error

    monkeypatch.setattr(_answers, "gain_held_out", gain)
    return Answer(none, comparison(none, mass), baseline).best(LEVEL).kinds


@pytest.mark.parametrize(
    ("chi2", "kinds"), [(30.0, ("point_mass",)), (50.0, ("point_mass",)), (51.0, ()), (90.0, ())]
)
def test_an_effect_explains_more_than_it_leaves_to_the_model_error(monkeypatch, chi2, kinds):
    assert claimed(monkeypatch, chi2) == kinds


@pytest.mark.parametrize(("evidence", "kinds"), [(6.0, ()), (20.0, ("point_mass",))])
def test_where_the_model_passes_its_check_twice_strong_evidence_is_needed(evidence, kinds):
    """Chi2 of 6000 lines passes although an effect shows in some of them."""
    none, mass = hypothesis([], 0.0), hypothesis(["point_mass"], evidence)
    assert Answer(none, comparison(none, mass)).best(LEVEL).kinds == kinds


def test_what_is_new_since_a_baseline_may_be_small(monkeypatch):
    before = hypothesis([], 0.0)
    assert claimed(monkeypatch, 90.0, baseline=before) == ("point_mass",)


def test_an_effect_predicts_held_out_data_better_by_two_standard_errors(monkeypatch):
    assert claimed(monkeypatch, 30.0, held_out=-1.0) == ()
    assert claimed(monkeypatch, 30.0, held_out=1.0, error=0.6) == ()
    assert claimed(monkeypatch, 30.0, held_out=1.0, error=0.4) == ("point_mass",)
