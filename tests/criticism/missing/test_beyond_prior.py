"""A number of the structure whose true value lies beyond its prior is named as such."""

import re

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._model_error_choice import Question
from bayes_placement.criticism.missing._parameter_estimate import ParameterEstimate
from bayes_placement.criticism.missing.fitted_model import FittedModel
from bayes_placement.io.case._effects import stated_effects
from tests.criticism.reach import cantilever
from tests.criticism.small import experiment, measured
from tests.experiment import modal_bars
from tests.simulator import fine_beams

TRUE = fine_beams.STIFFNESS
MODULUS = "structure.modes.youngs_modulus"
KINDS = ["beyond_prior", "point_mass", "local_stiffness_loss", "dimension_error"]
SETTINGS = {"model_error": None, "most_effects": 1}


def with_priors(given, **priors):
    """An experiment with other priors of its modes."""
    for field, prior in priors.items():
        given = eqx.tree_at(
            lambda tree, field=field: getattr(tree.structure.modes, field),
            given,
            prior,
            is_leaf=lambda leaf: isinstance(leaf, dist.Distribution),
        )
    return given


def improved(low, high, measurement, kinds=KINDS):
    """The cantilever, its Young's modulus between two shares of the true one."""
    given = with_priors(cantilever.experiment(), youngs_modulus=dist.Uniform(low, high))
    return bp.improve(given, measurement, candidates=effects.library(given, kinds), **SETTINGS)


@pytest.fixture(scope="module")
def plain():
    return cantilever.measured()


@pytest.mark.parametrize(
    ("low", "high"),
    [(0.7, 1 / 1.1), pytest.param(1 / 0.9, 1.4, marks=[pytest.mark.long, pytest.mark.longest])],
)
def test_youngs_modulus_beyond_either_end_is_named_with_its_value(plain, low, high):
    end, verb = (high, "ends") if high < 1 else (low, "begins")
    ledger = improved(low * TRUE, high * TRUE, plain)
    assert ledger.verdict == ("beyond_prior",) and not ledger.unexplained
    (entry,) = ledger.effects
    assert (entry["name"], entry["acts_on"], entry["on"]) == ("beyond_prior", "structure", MODULUS)
    value = entry["parameters"]["value"]
    assert value["unit"] == "Pa" and value["interval_99"][0] < TRUE < value["interval_99"][1]
    said = rf"Young's modulus of (\d\d\.\d+) GPa explains the data; your prior {verb} at (\S+) GPa"
    numbers = re.match(
        rf"{said} \(probability 0\.99\d+\); reduced chi-square falls", ledger.sentence()
    )
    np.testing.assert_allclose([*map(float, numbers.groups())], [70.0, 70.0 * end], atol=0.02)


def test_where_the_prior_is_right_nothing_is_claimed(plain):
    ledger = improved(0.94 * TRUE, 1.06 * TRUE, plain)
    assert ledger.verdict == () and ledger.probabilities["beyond_prior"] < 0.01


@pytest.mark.long
def test_a_mass_that_lowers_all_lines_is_still_the_mass():
    ledger = improved(0.94 * TRUE, 1.06 * TRUE, cantilever.measured(lambda w: -0.05 * w**2))
    assert ledger.verdict == ("point_mass",)


@pytest.mark.long
def test_explain_says_it_in_the_same_words(plain):
    given = with_priors(
        cantilever.experiment(), youngs_modulus=dist.Uniform(0.7 * TRUE, 0.9 * TRUE)
    )
    tried = effects.library(given, ["beyond_prior"])
    ranking = bp.explain(given, plain, candidates=tried, model_error=None)
    said = r"Young's modulus of \S+ GPa explains the data; your prior ends at \S+ GPa \(probability"
    assert re.match(said, ranking.words()[0])
    assert ranking.suspicion["p_value"].min() < 1e-6


@pytest.mark.long
def test_numbers_that_the_data_see_as_a_product_are_told_as_confounded(plain):
    """Bending sees the product of Young's modulus and second moment alone."""
    given = with_priors(
        cantilever.experiment(),
        youngs_modulus=dist.Uniform(0.7 * TRUE, 0.9 * TRUE),
        second_moment=dist.Uniform(0.99 * fine_beams.MOMENT, 1.01 * fine_beams.MOMENT),
    )
    tried = effects.library(given, ["beyond_prior"])
    ledger = bp.improve(given, plain, candidates=tried, **SETTINGS)
    assert ledger.verdict == ("beyond_prior",)
    names = {f"beyond_prior of structure.modes.{w}" for w in ("youngs_modulus", "second_moment")}
    assert [{*pair} for pair in ledger.confounded] == [names]
    assert f"These data do not distinguish {ledger.confounded[0][0]} from" in ledger.words()[1]


@pytest.mark.long
@pytest.mark.longest
def test_of_frequencies_and_scaled_shapes_stiffness_and_density_are_not_told_apart():
    places = [0.13, 0.31, 0.44, 0.78]
    modes = modal_bars.measured(places, 5, noise=np.random.default_rng(1), ratio=0.01)
    stiff = modal_bars.experiment(modes, places, modulus=dist.Uniform(1.1e9, 1.3e9))
    given = with_priors(stiff, density=dist.Uniform(8900.0, 9100.0))
    tried = effects.library(given, ["beyond_prior", "point_mass"])
    ledger = bp.improve(given, modes, candidates=tried, **SETTINGS)
    assert ledger.verdict == ("beyond_prior",)
    names = {f"beyond_prior of structure.modes.{w}" for w in ("youngs_modulus", "density")}
    assert [{*pair} for pair in ledger.confounded] == [names]


# ------------------------------------------------------------------------------ the words


def claimed(*effects_of_model):
    """What a fitted model says of its effects beyond priors."""
    estimates = {
        effect.name: ParameterEstimate(
            *(effect.value, 0.01 * effect.value, 0.0, 0.0), unit, effect.name, "value", "value"
        )
        for effect, unit in effects_of_model
    }
    with_effects = experiment()
    for effect, _ in effects_of_model:
        with_effects = with_effects + effect
    return FittedModel(
        added="beyond_prior",
        effects=tuple(estimates),
        parameters=estimates,
        chi2_per_datum=1.0,
        p_value=0.4,
        log_evidence=0.0,
        log_evidence_error=None,
        held_out=0.0,
        experiment=with_effects,
    )


RATIO = effects.beyond_prior("structure.damping.ratio", 0.08, end=0.06)
SLOW = effects.beyond_prior("structure.modes.youngs_modulus", 0.9e9, end=0.95e9, name="soft")


def test_a_share_is_told_in_percent_and_a_low_value_by_where_the_prior_begins():
    of_damping = "Damping ratio of 8.000 % explains the data; your prior ends at 6 %"
    assert claimed((RATIO, "1")).claim("beyond_prior") == of_damping
    both = claimed((RATIO, "1"), (SLOW, "Pa")).claim("beyond_prior")
    of_modulus = "Young's modulus of 0.9000 GPa explains the data; your prior begins at 0.95 GPa"
    assert both == f"{of_damping} and {of_modulus}"


def test_as_one_of_several_it_is_named_by_its_kind():
    words = claimed((RATIO, "1")).in_words("beyond_prior")
    assert words == "beyond_prior, damping ratio of 8.000 % where your prior ends at 6 %"
    assert claimed((RATIO, "1")).explanation("point_mass") == ""


# ---------------------------------------------------------------------- two states, and files


def asked_of(kinds):
    given = experiment()
    tried = effects.library(given, kinds)
    return Question.of(given, given.data(measured()), tried, None, level=0.01)


def test_it_is_nothing_that_is_new_since_an_earlier_state():
    new = asked_of(["point_mass", "beyond_prior"]).of_what_is_new()
    assert new.tried.kinds == ["point_mass"]
    with pytest.raises(InputError, match="candidates=beyond_prior was given beside an earlier"):
        asked_of(["beyond_prior"]).of_what_is_new()


def test_what_was_added_is_found_among_the_candidates_of_the_model_as_given():
    given = experiment()
    for place, effect in enumerate(effects.library(given, ["beyond_prior"]).effects):
        stated = stated_effects(given, [effect])
        assert stated == [{"kind": "beyond_prior", "candidate": place + 1, "name": "beyond_prior"}]
