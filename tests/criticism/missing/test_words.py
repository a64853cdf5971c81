"""What a verdict says: the answer first, how the model fails, and nothing that misleads."""

import dataclasses
import re

import numpy as np
import numpyro.distributions as dist
import pandas as pd
import pytest
from scipy.integrate import trapezoid
from scipy.stats import norm

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.criticism.findings.findings import models_of
from bayes_placement.criticism.missing import _rows
from bayes_placement.criticism.missing._hypotheses import Hypothesis, null_hypothesis
from bayes_placement.criticism.missing._narrow_text import narrow
from bayes_placement.criticism.missing._parameter_estimate import ParameterEstimate
from bayes_placement.criticism.missing._posterior_odds import Comparison
from bayes_placement.criticism.missing._standing import Standing
from bayes_placement.criticism.missing._verdict_in_words import _near, sizes_in_words
from bayes_placement.criticism.missing._weighed import NONE
from bayes_placement.criticism.missing._where_it_fails import where_it_fails
from bayes_placement.criticism.missing.decide import Doubt
from bayes_placement.criticism.missing.improve import _steps
from bayes_placement.criticism.missing.table import Policy, gain_of_smooth_misfit
from bayes_placement.laws import Dashpot, Mass, Spring
from tests.criticism import small
from tests.criticism.missing.test_outliers import of_unknown_noise
from tests.criticism.small import GAIN, MASS, TRUTH, experiment, measured, without_coherence

FAILS = r"The model fails \(reduced chi-square \d+\); no single cause that we know explains it"
NEAR = r"time_delay, -?[\d.]+ µs"
WHERE = r"It fails most at sensor s[12]\+x, from [\d.]+ to [\d.]+ Hz\."


@pytest.fixture(scope="module")
def delays():
    return effects.library(experiment(), ["time_delay"])


def searched(candidates, **settings):
    asked = experiment(), measured(MASS, seed=4)
    return bp.improve(*asked, candidates=candidates, most_effects=1, **settings)


@pytest.fixture(scope="module")
def beside_errors(delays):
    return searched(delays)


def explained(candidates, **settings):
    return bp.explain(experiment(), measured(MASS, seed=4), candidates=candidates, **settings)


def test_a_model_that_fails_says_so_first_then_what_was_nearest_and_where(delays):
    sentence = searched(delays, model_error=None).sentence()
    best = rf"{NEAR} \(the best of the candidates\) also reduces the misfit; reduced chi-square "
    assert re.fullmatch(rf"{FAILS}\. {best}falls from \d+ to \d+\. {WHERE}", sentence)
    ranking = explained(delays, model_error=None)
    nearest = rf"Nearest was {NEAR}: reduced chi-square falls from \d+ to \d+\."
    assert re.match(rf"{FAILS} \(probability 1\)\. {nearest} {WHERE}", ranking.words()[0])


def test_where_a_model_error_explains_all_the_exact_model_fails_first(delays, beside_errors):
    exact = r"The exact model fails \(reduced chi-square \d+\)\."
    sentence = beside_errors.sentence()
    assert re.match(rf"{exact} {WHERE} Nothing is claimed to be missing: a model error", sentence)
    nearest = rf"Nearest was {NEAR}\. Without model error the reduced chi-square falls from \d+ to"
    assert re.search(nearest, sentence)
    said = explained(delays).words()[0]
    assert re.match(rf"{exact} {WHERE} No effect is clearly missing\.", said)


@pytest.mark.long
def test_reach_is_told_before_what_was_nearest(delays):
    ledger = searched(dataclasses.replace(delays, networks=True), model_error=None)
    nothing = dataclasses.replace(ledger, verdict=(), unexplained=True, steps=ledger.steps[:1])
    reach = r"Reach: displacement at 31\d mm: mass removes 100% of the misfit"
    assert re.match(rf"{FAILS}\. {reach}", nothing.sentence())


LIBRARY = effects.library(experiment(), ["point_mass"])


@pytest.fixture(scope="module")
def too_light():
    """A mass whose prior ends below the true one."""
    mass = effects.point_mass(dist.Uniform(0.0, 1.0), dist.Uniform(0.0, 0.34))
    return dataclasses.replace(LIBRARY, effects=(mass,))


def test_a_size_at_the_edge_of_its_prior_is_never_certain(too_light):
    ledger = searched(too_light, model_error=None)
    assert ledger.verdict == ("point_mass",)
    edge = "among the candidates, but its size sits at the upper edge of its prior"
    words = rf"Missing: point_mass, 0\.33\d+ kg at 31\S+ mm \(probability \S+ {edge}\); reduced"
    assert re.match(words, ledger.sentence())
    (claim,) = ledger.to_json()["effects"]
    assert claim["probability"] < 0.5 < 0.99 < claim["probability_among_candidates"]
    assert claim["doubts"] == ["its size sits at the upper edge of its prior"]
    assert edge in explained(too_light, model_error=None).words()[0]


def test_a_claim_without_doubt_is_as_probable_as_any_candidate_is():
    ledger = searched(LIBRARY, model_error=None)
    (claim,) = ledger.to_json()["effects"]
    assert claim["doubts"] == []
    right = 1 - ledger.probabilities[NONE]
    assert claim["probability"] == pytest.approx(claim["probability_among_candidates"] * right)
    assert "among the candidates" not in ledger.sentence()


def test_what_predicts_held_out_data_worse_is_never_certain(monkeypatch):
    lost = np.array([0.1, 0.25])  # by every effect, of two blocks
    monkeypatch.setattr(_rows, "scores", lambda hypothesis: -lost * len(hypothesis.effects))
    ledger = searched(LIBRARY, model_error=None)
    (claim,) = ledger.to_json()["effects"]
    assert claim["doubts"] == ["held-out data are predicted worse with it"]
    assert claim["probability"] < 0.25
    assert "among the candidates, but held-out data are predicted worse" in ledger.sentence()


def test_what_leaves_the_check_failing_is_never_certain():
    asked = experiment(), measured(MASS, GAIN, seed=2)
    ledger = bp.improve(*asked, candidates=LIBRARY, model_error=None, most_effects=1)
    assert ledger.unexplained and ledger.verdict == ("point_mass",)
    (claim,) = ledger.to_json()["effects"]
    assert claim["probability"] < 0.5
    assert claim["doubts"] == ["the model still fails its check"]
    assert "Missing" not in ledger.sentence()
    assert re.match(FAILS, ledger.sentence())


def test_an_instrument_effect_is_named_with_its_channel_and_size():
    library = effects.library(experiment(), ["gain_error"])
    asked = experiment(), measured(GAIN, seed=2)
    sentence = bp.improve(*asked, candidates=library, model_error=None).sentence()
    assert re.match(r"Missing: gain_error, sensor s2\+?x?, -[56]\.\d+ % \(probability ", sentence)


@pytest.mark.parametrize("regions", [{}, {"joint": 0.3 * np.eye(2)}])
def test_of_a_finite_element_model_without_regions_no_loss_of_stiffness_was_tried(regions):
    model = bp.finite_elements.ModalModel.from_arrays(
        position=np.linspace(0.0, 1.0, 9)[:, None] * [1.0, 0.0, 0.0],
        shape=np.random.default_rng(0).normal(size=(9, 3, 2)),
        natural_frequency=[30.0, 80.0],
        modal_mass=1.0,
    )
    nearest = bp.finite_elements.interpolation.nearest(model)
    modes = bp.finite_elements.modes_from_shapes(model, nearest, regions=regions)
    asked = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.01, 0.05))),
        sensors=[bp.Sensor("s1", at=(0.25, 0.0, 0.0), directions=(3,))],
        actuators=[bp.Actuator("a1", at=(0.5, 0.0, 0.0), directions=(3,))],
        frequency=np.arange(20.0, 100.0, 2.0),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Relative(0.01, 0.0),
    )
    heavier = asked + effects.tuned_absorber((0.25, 0.0, 0.0), 0.3, 40.0, 0.05)
    candidates = effects.library(asked, ["gain_error"])
    measurement = heavier.nominal_measurement()
    for answer in (bp.improve, bp.explain):
        words = answer(asked, measurement, candidates=candidates, model_error=None).words()[0]
        assert ("No loss of stiffness was tried" in words) == (not regions)


@pytest.mark.parametrize(("p_value", "probability"), [(0.05, 0.289), (0.01, 0.111), (0.5, 0.5)])
def test_a_p_value_is_a_probability_by_the_table_of_sellke_bayarri_and_berger(p_value, probability):
    assert Doubt("", p_value).probability == pytest.approx(probability, abs=5e-4)


def test_of_several_doubts_the_greatest_counts():
    stands = Standing(doubts={"mass": (Doubt("a", 0.05), Doubt("b", 0.01))})
    assert stands.probability_of_any("mass", 0.3) == Doubt("b", 0.01).probability
    assert stands.probability_of_any("mass", 0.95) == pytest.approx(0.05)
    assert stands.probability_of_any("other", 0.3) == 0.7


@pytest.mark.parametrize(("hidden", "is_one"), [((), False), ((MASS,), True)])
def test_unknown_noise_that_is_smooth_belongs_to_none_of_these(hidden, is_one):
    bar = of_unknown_noise()
    null = null_hypothesis(bar, bar.data(without_coherence(measured(*hidden, seed=4))))
    share = Comparison([null], {"point_mass": 1}).weighed.probabilities()[NONE]
    assert share > 0.99 if is_one else share < Policy().prior_of_none / 10


@pytest.mark.parametrize(
    ("ratio", "certainty"), [(0.3, 12.0), (0.7, 20.0), (0.9, 40.0), (1.1, 9.0)]
)
def test_the_gain_of_a_smooth_misfit_is_that_of_its_integral(ratio, certainty):
    largest = Policy().largest_factor
    log_factor = np.linspace(0.0, np.log(largest), 200_001)
    density = norm.pdf((ratio - np.exp(-2 * log_factor)) * certainty)
    density /= norm.pdf((ratio - 1) * certainty)
    exact = np.log(trapezoid(density, log_factor) / np.log(largest))
    # Of a ratio above 1 the tail is shorter than half of the Gaussian.
    tolerance = 0.3 if ratio < 1 else 0.9
    assert gain_of_smooth_misfit(ratio, certainty, largest) == pytest.approx(exact, abs=tolerance)


@pytest.fixture(scope="module")
def of_close_lines():
    """The bar of which all is known, at lines 2 Hz apart, and its measurement."""
    known = experiment().fix(TRUTH)
    bar = bp.Experiment(
        known.structure,
        sensors=[*known.sensor.values()],
        actuators=[*known.actuator.values()],
        frequency=np.arange(20.0, 320.0, 2.0),
        observe=known.observe,
        noise=known.noise,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(small, "LINES", np.asarray(bar.frequency))
        return bar, small.recorded(bar, seed=3)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ((50, 100, 150), "Single lines stand out: s2+x at 50, 100, 150 Hz: mains."),
        ((90, 212), "Single lines stand out: s2+x at 90, 212 Hz."),
    ],
)
def test_lines_that_stand_out_are_named(of_close_lines, lines, words):
    bar, measurement = of_close_lines
    frf = np.array(measurement.frf)
    frf[1, 0, np.isin(bar.frequency, lines)] *= 1.2
    wrong = dataclasses.replace(measurement, frf=frf)
    said = where_it_fails(null_hypothesis(bar, bar.data(wrong)))
    assert said.endswith(words)
    assert said.startswith("It fails most at sensor s2+x, from ")


def test_no_line_of_noise_stands_out(of_close_lines):
    bar, measurement = of_close_lines
    assert "Single lines" not in where_it_fails(null_hypothesis(bar, bar.data(measurement)))


def test_a_table_that_is_too_wide_stands_in_blocks_of_whole_columns():
    headings = ["reduced chi-square", "p", "log evidence gained", "held out", "frequency", "shape"]
    rows = pd.Index(["as given", "point_mass"], name="added")
    table = pd.DataFrame("0.001 %", rows, headings).assign(parameters=["", "mass 0.5 kg"])
    text = narrow(table)
    assert max(map(len, text.splitlines())) <= 80 and "\\" not in text
    assert all(text.count(f" {heading}") == 1 for heading in headings)
    assert text.count("point_mass") == 3  # a row in each block, and its parameters


def test_what_takes_away_nothing_that_can_be_read_is_not_near(beside_errors):
    step = beside_errors.steps[0]
    barely = dataclasses.replace(step, chi2_when_exact=step.chi2_when_exact * 0.9999)
    assert not _near(step, barely) and "Nearest was" in beside_errors.sentence()


def _sizes(step, **sizes):
    least = {"frequency": 1e-5, "damping": 1e-3, "shape": 1e-4, "gain": 1e-4} | sizes
    found = {kind: ParameterEstimate(size, 0.0, 0.0, 1.0, "1") for kind, size in least.items()}
    errors = {
        "model_error.damping.standard[0]": -0.5,
        "model_error.damping.standard[1]": 1e-3,
        "model_error.gain.standard.sensor.s1[0]": 1.6,
    }
    return sizes_in_words(dataclasses.replace(step, model_error=found, errors=errors))


def test_errors_of_one_kind_alone_become_a_part_of_the_model(beside_errors):
    step = beside_errors.steps[0]
    assert _sizes(step) == "The model hardly needs to err."
    alone = _sizes(step, damping=0.4)
    assert alone.startswith("The model needs to err: damping by 40 %, hardly in anything else. ")
    assert "from mode to mode (mode 1 -18 %): " in alone and "damping.Modal([dist" in alone
    assert "recorded (sensor s1 +8 %): " in _sizes(step, gain=0.05)
    both = _sizes(step, damping=0.4, shape=0.02)
    assert both.endswith("damping by 40 %, mode shapes by 2 %, hardly in anything else.")


@pytest.mark.parametrize(("p_value", "is_told"), [(0.0, False), (0.5, True)])
def test_explain_says_no_more_than_improve_where_the_check_fails_beside_a_model_error(
    p_value, is_told
):
    setup = experiment()
    kinds = effects.library(setup, ["point_mass"])
    ranking = bp.explain(setup, measured(MASS), candidates=kinds, model_error=None)
    sizes = {"shape": ParameterEstimate(0.3, 0.0, 0.0, 1.0, "1")}
    best, *others = ranking.steps
    steps = (dataclasses.replace(best, model_error=sizes, p_value=p_value), *others)
    said = dataclasses.replace(ranking, steps=steps).words()[0]
    assert said.startswith("Missing is point_mass") == is_told
    assert ("The exact model fails" in said and "reduces the misfit; " in said) != is_told


@pytest.fixture(scope="module")
def way():
    """The small bar as given, and with two laws that were found together."""
    data = experiment().data(measured(MASS))
    null = null_hypothesis(experiment(), data)
    absorber = Spring(dist.Uniform(0.9e5, 1.1e5)) - Mass(0.2)
    laws = (
        effects.attached(0.3, absorber, name="attached: spring"),
        effects.attached(0.7, Dashpot(dist.Uniform(1.0, 9.0)), name="attached: spring_2"),
    )
    both = null_hypothesis(experiment() + laws[0] + laws[1], data)
    return null, dataclasses.replace(both, effects=laws)


def test_laws_that_were_found_together_are_one_row_that_names_and_describes_both(
    way, beside_errors
):
    """No model with one of them alone was fitted, and each law is told by its elements."""
    steps = _steps(way, {})
    table = (ledger := dataclasses.replace(beside_errors, steps=steps)).table()
    both = "attached: spring - mass + attached: dashpot"
    assert table.index.tolist() == ["as given", both]
    said = "attached: spring - mass: at 0.3 m, law.parts.1.stiffness .*; attached: dashpot: at 0.7"
    assert re.match(said, table["parameters"].iloc[-1])
    assert f"{both}: {said[:23]}" in str(ledger)
    models = ["as given", "with attached: spring - mass and attached: dashpot"]
    assert [model.name for model in models_of(ledger, experiment())] == models
    assert [*ledger.fits][1:] == models
    last = ledger.to_json()["steps"][-1]
    assert (last["added"], last["names"]) == (both, ["attached: spring", "attached: spring_2"])
    assert {each.effect for each in steps[-1].parameters_of_added().values()} == {*last["names"]}


def test_a_step_adds_the_law_that_is_new_although_an_other_had_its_name(way):
    """The best of two laws need not have the names that the best single one has."""
    null, both = way
    first, second = both.effects
    alone = Hypothesis((dataclasses.replace(second, name=first.name),), null.problem, null.fit)
    assert _steps((null, alone, both), {})[-1].title == "attached: spring - mass"
