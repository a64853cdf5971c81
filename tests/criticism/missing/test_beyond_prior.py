"""A number of the structure whose true value lies beyond its prior is named as such."""

import dataclasses
import re

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._types import InputError
from bayes_placement.experiment.modal_parameters import ModalParameters
from tests.criticism.reach import cantilever
from tests.criticism.small import experiment, measured
from tests.simulator import fine_beams

TRUE = fine_beams.STIFFNESS
MODULUS, DENSITY = "structure.modes.youngs_modulus", "structure.modes.density"
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
    return bp.improve(
        given, measurement, candidates=effects.library(given, kinds), **SETTINGS
    )


@pytest.fixture(scope="module")
def plain():
    return cantilever.measured()


@pytest.mark.parametrize(("low", "high"), [(0.7, 1 / 1.1), (1 / 0.9, 1.4)])
def test_youngs_modulus_beyond_either_end_is_named_with_its_value(plain, low, high):
    end, verb = (high, "ends") if high < 1 else (low, "begins")
    ledger = improved(low * TRUE, high * TRUE, plain)
    assert ledger.verdict == ("beyond_prior",) and not ledger.unexplained
    (entry,) = ledger.effects
    assert (entry["name"], entry["acts_on"], entry["on"]) == ("beyond_prior", "structure", MODULUS)
    value = entry["parameters"]["value"]
    assert value["unit"] == "Pa" and value["interval_99"][0] < TRUE < value["interval_99"][1]
    said = rf"Young's modulus of (\d\d\.\d+) GPa explains the data; your prior {verb} at (\S+) GPa"
    numbers = re.match(rf"{said} \(probability 1\); reduced chi-square falls", ledger.sentence())
    np.testing.assert_allclose([*map(float, numbers.groups())], [70.0, 70.0 * end], atol=0.02)


def test_where_the_prior_is_right_nothing_is_claimed(plain):
    ledger = improved(0.94 * TRUE, 1.06 * TRUE, plain)
    assert ledger.verdict == () and ledger.probabilities["beyond_prior"] < 0.01


def test_a_mass_that_lowers_all_lines_is_still_the_mass():
    ledger = improved(0.94 * TRUE, 1.06 * TRUE, cantilever.measured(lambda w: -0.05 * w**2))
    assert ledger.verdict == ("point_mass",)


# ------------------------------------------------------------------- what stands for another


def test_where_only_frequencies_are_seen_stiffness_and_density_are_told_as_confounded():
    true = with_priors(experiment(), youngs_modulus=1.2e9).structure
    frequency = np.asarray(true.modes.natural_frequency[:4])
    given = with_priors(experiment(), density=dist.Uniform(8800.0, 9200.0))
    free = [dataclasses.replace(sensor) for sensor in given.sensor.values()]
    asked = bp.Experiment(
        given.structure,
        sensors=free,
        observe=bp.observe.Modes(frequency=frequency, quantity="acceleration"),
        noise=None,
    )
    assert asked and ModalParameters
