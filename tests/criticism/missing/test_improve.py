"""Improve: hidden effects are found, nothing is claimed where none is, and what the ledger says."""

import dataclasses
import json
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.criticism.missing import _fits_with_errors, _shared_fits
from bayes_placement.criticism.missing.explain import explain
from bayes_placement.criticism.missing.improve import improve
from bayes_placement.criticism.noise_needed import TOO_FEW, NoiseNeeded
from tests.criticism.small import GAIN, LINES, MASS, experiment, measured

KINDS = ["point_mass", "gain_error", "time_delay"]


@pytest.fixture(scope="module")
def candidates():
    return effects.library(experiment(), KINDS)


@pytest.fixture(scope="module")
def with_mass(candidates):
    return improve(experiment(), measured(MASS, seed=1), candidates=candidates)


FITTED_WITH_ERRORS = []
"""Kinds of the hypotheses that were fitted with a model error where two effects are missing."""


@pytest.fixture(scope="module")
def with_both(candidates):
    def counted(fit):
        def fitted(exact, *arguments):
            FITTED_WITH_ERRORS.append(exact.kinds)
            return fit(exact, *arguments)

        return fitted

    with pytest.MonkeyPatch.context() as patch:
        for name in ("with_errors", "given_with_errors"):
            patch.setattr(_fits_with_errors, name, counted(getattr(_fits_with_errors, name)))
        return improve(experiment(), measured(MASS, GAIN, seed=2), candidates=candidates)


@pytest.fixture(scope="module")
def with_nothing(candidates):
    return improve(experiment(), measured(seed=3), candidates=candidates)


def test_a_hidden_mass_is_named_and_the_error_falls_to_the_noise(with_mass):
    assert with_mass.verdict == ("point_mass",)
    first, last = with_mass.steps
    assert (first.added, last.added) == (None, "point_mass")
    assert first.chi2_per_datum > 3
    assert last.chi2_per_datum < 1.2
    assert last.log_evidence > first.log_evidence + 20
    assert last.held_out > first.held_out
    assert not with_mass.unexplained
    assert with_mass.probabilities["point_mass"] > 0.95


def test_what_explain_fits_is_not_fitted_again(with_mass, candidates, monkeypatch):
    """The same numbers come from fits of `improve`, and from ones that are made anew."""
    asked = experiment(), measured(MASS, seed=1)
    _shared_fits._LAST.clear()
    anew = explain(*asked, candidates=candidates)
    monkeypatch.setattr(_shared_fits, "single_effects", lambda *_: pytest.fail("fitted again"))
    shared = explain(*asked, candidates=effects.library(experiment(), KINDS))
    improved = improve(*asked, candidates=candidates)
    assert shared.probabilities == anew.probabilities == improved.probabilities
    assert improved.probabilities == with_mass.probabilities
    assert shared.steps[0].parameters == anew.steps[0].parameters


def test_another_question_is_fitted_anew(candidates, monkeypatch):
    asked = experiment(), experiment().data(measured(MASS, seed=1)), candidates, None
    fits = _shared_fits.shared_fits(*asked)
    assert _shared_fits.shared_fits(*asked) is fits
    again = experiment(), experiment().data(measured(MASS, seed=1)), asked[2], None
    assert _shared_fits.shared_fits(*again) is fits
    heavier = dataclasses.replace(candidates.effects[0], mass=0.1)
    fewer, other, further = (
        dataclasses.replace(candidates, **changes)
        for changes in (
            {"effects": candidates.effects[:1]},
            {"effects": (heavier, *candidates.effects[1:])},
            {"networks": True},
        )
    )
    others = [
        (experiment(), experiment().data(measured(MASS, seed=2)), candidates, None),
        *((experiment(), asked[1], library, None) for library in (fewer, other, further)),
        (experiment().fix({"structure.damping.ratio": 0.04}), asked[1], candidates, None),
    ]
    for other in others:
        first = _shared_fits.shared_fits(*asked)
        assert _shared_fits.shared_fits(*other) is not first


def test_the_true_mass_and_its_place_lie_in_their_intervals(with_mass):
    parameters = with_mass.steps[-1].parameters
    mass = parameters["structure.effects.point_mass.mass"]
    place = parameters["structure.effects.point_mass.at"]
    assert mass.low < MASS.mass < mass.high
    assert place.low < MASS.at < place.high
    assert mass.high - mass.low < 0.1 * MASS.mass
    assert (mass.unit, place.unit) == ("kg", "m")


def test_the_suspicion_map_points_near_the_mass(with_mass):
    rows = with_mass.suspicion.query("kind == 'point_mass'")
    assert rows["p_value"].iloc[0] < 1e-6
    assert rows.loc[rows["score"].abs().idxmax(), "at"] == pytest.approx(MASS.at, abs=0.1)


def test_two_effects_at_once_are_found(with_both):
    assert set(with_both.verdict) == {"point_mass", "gain_error"}
    assert with_both.steps[0].added is None
    assert {step.added for step in with_both.steps[1:]} == {"point_mass", "gain_error"}
    falling = [step.chi2_per_datum for step in with_both.steps]
    assert falling == sorted(falling, reverse=True)
    assert falling[-1] < 1.2
    error = with_both.steps[-1].parameters["instrument_effects.gain_error.error"]
    assert error.low < GAIN.error < error.high


class Ripple(effects.InstrumentEffect):
    """A periodic error of all channels, of so many periods over the lines."""

    absent = ("size", 0.0)
    size: Any
    name: str = eqx.field(static=True, default="ripple", kw_only=True)
    periods: ClassVar[float]

    def channel_factor(self, omega, instruments):
        """Return one and a small cosine over the band."""
        return 1 + self.size * jnp.cos(self.periods * omega / LINES[-1])

    @classmethod
    def suggest(cls, scales):
        """Return it with a wide prior."""
        return [cls(dist.Normal(0.0, 0.1))]


@pytest.mark.long
@pytest.mark.longest
def test_ten_useless_candidates_lose_no_answer(with_both):
    useless = [type(f"Ripple{n}", (Ripple,), {"periods": n / 2}) for n in range(1, 11)]
    many = effects.library(experiment(), KINDS, further=useless)
    ledger = improve(experiment(), measured(MASS, GAIN, seed=2), candidates=many)
    assert ledger.verdict == with_both.verdict
    for kind in ledger.verdict:
        assert ledger.probabilities[kind] > with_both.probabilities[kind] - 0.1


def test_where_two_effects_explain_all_model_errors_are_not_tried_beside_every_effect(with_both):
    assert not with_both.unexplained
    assert [(), (with_both.steps[1].added,)] == FITTED_WITH_ERRORS


def test_where_nothing_is_missing_nothing_is_claimed(with_nothing):
    assert with_nothing.verdict == ()
    assert len(with_nothing.steps) == 1
    assert not with_nothing.unexplained
    assert with_nothing.probabilities["nothing_missing"] > 0.9
    assert "Nothing is claimed to be missing" in with_nothing.sentence()
    assert with_nothing.suspicion["p_value"].min() > 1e-3


def test_where_the_noise_is_in_doubt_no_effect_is_called_improbable(with_mass):
    doubted = with_mass.probabilities | {"point_mass": 1e-9, "none_of_these": 0.999}
    ledger = dataclasses.replace(with_mass, probabilities=doubted, unexplained=True)
    assert "(the best of the candidates) also reduces the misfit" in ledger.sentence()
    assert "Missing" not in ledger.sentence()
    assert "The model fails" in ledger.sentence()


@pytest.mark.parametrize(
    ("unexplained", "words"),
    [
        (False, "Missing: point_mass"),
        (True, "point_mass, 0.3495 kg at 312.96 mm (probability 0.999 among the candidates) also"),
    ],
)
def test_with_unknown_noise_an_effect_is_missing_if_what_is_left_scatters_as_noise(
    with_mass, unexplained, words
):
    needed = NoiseNeeded(0.05, 3.0 if unexplained else 1.0, 1e-9 if unexplained else 0.4)
    steps = tuple(dataclasses.replace(step, noise_needed=needed) for step in with_mass.steps)
    likely = with_mass.probabilities | {"point_mass": 0.999}
    ledger = dataclasses.replace(
        with_mass, steps=steps, probabilities=likely, unexplained=unexplained
    )
    assert words in ledger.sentence()
    assert ledger.sentence().startswith("The model fails" if unexplained else "Missing")
    assert ("Missing" in ledger.sentence()) is not unexplained


@pytest.mark.parametrize("alike", [True, False])
def test_lines_that_tell_no_noise_are_said_where_nothing_is_claimed(with_nothing, alike):
    noise = NoiseNeeded(0.1, 1.0, 0.5, is_misfit_alike=alike)
    steps = tuple(dataclasses.replace(step, noise_needed=noise) for step in with_nothing.steps)
    ledger = dataclasses.replace(with_nothing, steps=steps, verdict=())
    assert "the model needs noise of 10 % of the amplitude" in ledger.sentence()
    assert ("cannot tell noise from a misfit" in ledger.sentence()) == alike


def test_explain_ranks_the_kinds_and_claims_what_improve_claims(with_mass, candidates):
    shares = []
    measurement = measured(MASS, seed=1)
    ranking = explain(experiment(), measurement, candidates=candidates, progress=shares.append)
    assert max(ranking.probabilities, key=ranking.probabilities.get) == "point_mass"
    assert next(iter(ranking.table().index)) == "point_mass"
    assert "point_mass" in ranking.words()[0]
    assert np.all(np.diff(shares) >= 0)
    assert shares[-1] == 1
    assert ranking.claimed == with_mass.verdict
    noise = NoiseNeeded(0.1, 1.0, 0.5, is_misfit_alike=True)
    few = [dataclasses.replace(step, noise_needed=noise) for step in ranking.steps]
    assert TOO_FEW in dataclasses.replace(ranking, steps=type(ranking.steps)(few)).words()


@pytest.mark.long
@pytest.mark.longest
def test_explain_claims_nothing_where_improve_claims_nothing(with_nothing, candidates):
    ranking = explain(experiment(), measured(seed=3), candidates=candidates)
    assert ranking.claimed == with_nothing.verdict
    favoured = {"point_mass": 0.9, "nothing_missing": 0.1, "none_of_these": 0.0}
    doubtful = dataclasses.replace(ranking, probabilities=favoured)
    assert doubtful.words()[0] == (
        "The evidence favours point_mass (probability 0.9), but not clearly."
    )
    certain = dataclasses.replace(doubtful, claimed=("point_mass",))
    assert (
        certain.words()[0]
        == "Missing is point_mass (probability 0.9); reduced chi-square falls from 1.01 to 1.01."
    )


def test_what_no_candidate_explains_is_said_to_be_unexplained():
    library = effects.library(experiment(), ["time_delay"])
    ledger = improve(experiment(), measured(MASS, seed=4), candidates=library, model_error=None)
    assert ledger.unexplained
    assert ledger.probabilities["none_of_these"] > 0.9
    assert any("None of the candidates" in line for line in ledger.words())


def test_model_error_is_a_rival_of_what_no_candidate_explains():
    library = effects.library(experiment(), ["time_delay"])
    told = []
    ledger = improve(experiment(), measured(MASS, seed=4), candidates=library, callback=told.append)
    assert [model.effects for model in told[:2]] == [(), ("time_delay",)]
    assert told[0].chi2_per_datum > told[1].chi2_per_datum > told[-1].chi2_per_datum
    assert not told[0].model_error and told[-1].values == ledger.steps[-1].values
    assert ledger.verdict == ()
    assert set(ledger.steps[0].model_error) == {
        "frequency",
        "damping",
        "shape",
        "gain",
        "stiffness_and_mass",
    }
    assert ledger.steps[0].chi2_when_exact > 2
    assert decided_again(ledger).exact_fails
    sizes = {size for _, size, share in ledger.rows.rows[0].sizes if 0 < share < 1}
    assert sizes == {size.mean for size in ledger.steps[0].model_error.values()}
    assert "a model error explains the data better than any candidate" in ledger.sentence()


@pytest.mark.long
def test_beside_a_declared_model_error_three_effects_are_found(candidates):
    delay = effects.time_delay(4e-5)
    small = bp.model_error.Embedded(
        frequency=1e-4, damping=None, shape=None, gain=None, stiffness_and_mass=None
    )
    erring = experiment().with_model_error(small)
    ledger = improve(erring, measured(MASS, GAIN, delay, seed=6), candidates=candidates)
    assert ledger.verdict == ("gain_error", "point_mass", "time_delay") and not ledger.unexplained


def test_the_ledger_file_says_what_the_ledger_says(with_both, tmp_path):
    with_both.write(tmp_path / "ledger.json")
    read = json.loads((tmp_path / "ledger.json").read_text())
    assert set(read) == {
        "schema",
        "effects",
        "reach",
        "steps",
        "verdict",
        "baseline",
        "probabilities",
        "confounded",
        "unexplained",
        "cautions",
        "wall_seconds",
        "table",
        "policy",
        "record",
    }
    assert read["verdict"] == list(with_both.verdict)
    assert {effect["name"] for effect in read["effects"]} == set(with_both.verdict)
    assert read["steps"][0]["added"] is None
    assert read["steps"][-1]["chi2_per_datum"] == with_both.steps[-1].chi2_per_datum
    error = read["steps"][-1]["parameters"]["instrument_effects.gain_error.error"]
    assert error["interval_99"][0] < GAIN.error < error["interval_99"][1]
    assert [error[word] for word in ("effect", "field", "word")] == ["gain_error", "error", "error"]
    ratio = read["steps"][0]["parameters"]["structure.damping.ratio"]
    assert (ratio["effect"], ratio["field"]) == (None, "ratio")
    twice = {"point_mass_2", "gain_error_2"}  # that there are two of either was tried
    further = {"nothing_missing", "none_of_these"}
    assert set(KINDS) | twice | further == set(read["probabilities"])
    assert max(read["probabilities"][kind] for kind in twice) < 0.05


def decided_again(ledger):
    """What is decided of the file of a ledger."""
    stored = json.loads(json.dumps(ledger.to_json()))
    decision = bp.decide(stored["table"], bp.Policy(**stored["policy"]))
    assert decision.kinds == ledger.verdict
    assert decision.probabilities == ledger.probabilities
    assert decision.confounded == ledger.confounded
    assert decision.unexplained == ledger.unexplained
    assert decision.doubts == ledger.standing.doubts
    return decision


def test_the_table_of_a_ledger_gives_its_verdict_again(with_mass, with_both, with_nothing):
    assert decided_again(with_mass).told_as_missing == ("point_mass",)
    assert len(decided_again(with_both).steps) == 3
    decided_again(with_nothing)
    read = with_both.to_json()["table"]["rows"]
    held_out = [np.mean(read[n]["held_out"]) for n in decided_again(with_both).steps]
    assert held_out == [step.held_out for step in with_both.steps]


def test_words_name_effect_and_error(with_mass):
    assert "Missing: point_mass" in with_mass.sentence()
    assert f"{with_mass.steps[0].chi2_per_datum:.3g}" in with_mass.sentence()
    assert "point_mass" in str(with_mass)


def test_the_experiment_of_the_ledger_has_the_effect(with_mass):
    assert "point_mass" in with_mass.experiment.structure.effects
