"""What a channel did to its record, told beside laws at ports: data of a mesh of its own."""

import functools
import json
import re
from dataclasses import replace
from unittest.mock import Mock

import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest

import bayes_placement as bp
from bayes_placement.cli._run import Run
from bayes_placement.cli.improve import write_reach
from bayes_placement.criticism.kept_fits import fits_kept_in
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._networks import LawsBeside, with_networks
from bayes_placement.criticism.missing._posterior_odds import Comparison
from bayes_placement.criticism.missing.ledger import Ledger
from bayes_placement.criticism.reach import _as_measured, _at_port, _named_laws
from bayes_placement.criticism.reach._as_measured import as_measured
from bayes_placement.criticism.reach._asked import OF_ROW, Asked, LawsAsked
from bayes_placement.criticism.reach._channels import channels_of, free_factor
from bayes_placement.criticism.reach._filters import FILTERS, PARTS, ChannelFilter, FilterRows
from bayes_placement.criticism.reach._free_factor import Responses
from bayes_placement.criticism.reach._free_law import AnyLaw
from bayes_placement.criticism.reach._laws_in_full import LawsInFull
from bayes_placement.criticism.reach._reached_channels import reached_channels
from bayes_placement.inference.residuals import Problem
from bayes_placement.laws.rows import NUMBERS
from tests.criticism.reach.cantilever import DRIVEN, FURTHER, LINES, experiment, measured
from tests.criticism.reach.test_free_law import gradient_of

OMEGA = 2 * np.pi * LINES
TWO = (DRIVEN, FURTHER)
LOW_PASS = 1 / (1 + 1j * LINES / 1500.0)
LATE = 0.93 * np.exp(-1j * OMEGA * 2e-4)


def in_sensor(number, factor):
    return np.where(np.arange(3)[:, None, None] == number, factor, 1.0)


def heavy(omega):
    return -0.05 * omega**2


RECORDS = {
    "all": ({"factor": LOW_PASS}, "all_channels", "all channels", "low-pass"),
    "one": ({"factor": in_sensor(1, LATE)}, "channel", "sensor s2", ["*", "gain", "delay"]),
    "mass": ({"law": heavy}, "displacement", "", None),
    "force": (
        {"factor": np.array([1.0, 1.3])[None, :, None], "driven": TWO},
        "channel",
        "actuator a2",
        "gain",
    ),
}
MASS, FORCE = (
    pytest.param(name, marks=[pytest.mark.long, pytest.mark.longest]) for name in ("mass", "force")
)


@functools.cache
def reached(name):
    made = RECORDS[name][0]
    with pytest.MonkeyPatch.context() as patch:  # laws on segments take long
        patch.setattr(
            "bayes_placement.criticism.missing.reach.ports_of_many", lambda experiment: []
        )
        return bp.reach(experiment(driven=made.get("driven", (DRIVEN,))), measured(**made))


@functools.cache
def problem(driven=TWO):
    setup = experiment(driven=driven)
    data = setup.data(measured(driven=driven, factor=LOW_PASS))
    return null_hypothesis(setup, data).problem


def port(setting):
    (found,) = (each for each in channels_of(experiment(driven=TWO)) if setting in repr(each))
    return found


def free(number=1):
    return free_factor(channels_of(problem().experiment)[number], Responses(problem()))


def points_of(problem):
    return 0.3 * np.random.default_rng(0).standard_normal((2, problem.dimension))


@pytest.mark.parametrize("name", ["all", "one", MASS, FORCE])
def test_what_acts_has_the_greatest_odds(name):
    found = reached(name)
    _, acts_on, setting, tree = RECORDS[name]
    best = found.laws.iloc[0]
    assert found.fails and found.kinds().index[0] == acts_on
    assert (best["acts_on"], best["setting"]) == (acts_on, setting)
    assert tree is None or best["law"].tree() == tree
    assert best["chi2_per_datum"] == pytest.approx(1.0, abs=0.25)
    assert found.kinds()["probability"].iloc[0] > 0.99
    assert found.kinds()["probability"].sum() == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["all", "one", FORCE])
def test_the_factor_as_measured_is_that_which_acts(name):
    true = {"all": LOW_PASS, "one": LATE, "force": 1.3}[name]
    found = reached(name)
    table = found.law_as_measured()
    assert set(table["unit"]) == {"1"}
    best = np.asarray(found.laws["law"].iloc[0].factor(OMEGA))
    assert np.allclose(best, true, atol=0.01)
    true = true + 0j * OMEGA
    for part, exact in (("real", true.real), ("imaginary", true.imag)):
        apart = np.abs(table[part] - exact) / table[f"deviation_{part}"]
        assert np.mean(apart < 1.96) > 0.85


def test_any_factor_on_one_sensor_removes_what_that_sensor_misses():
    curves = reached("one").curves.set_index("setting")
    assert curves.loc["sensor s2", "any_law"] > 0.98
    assert curves.loc[["sensor s1", "sensor s3"], "any_law"].max() < 0.05
    assert curves.loc["sensor s2", "x"] != curves.loc["sensor s2", "x"]  # no place


def test_any_factor_in_all_channels_and_a_low_pass_do_the_same():
    (row,) = reached("all").curves.query("acts_on == 'all_channels'").to_dict("records")
    assert row["any_law"] == pytest.approx(1.0, abs=0.01)
    assert 0.98 < row["few_numbers"] <= row["any_law"] + 0.02


def test_what_a_folder_keeps_is_not_fitted_again(tmp_path, monkeypatch):
    setup = experiment()
    null = null_hypothesis(setup, setup.data(measured(factor=LOW_PASS)))
    responses = Responses(null.problem)
    with fits_kept_in(tmp_path):
        _, laws = reached_channels(null.problem, null.fit, [])
        table = as_measured(laws[0], free_factor(laws[0].port, responses))
        for module in (_at_port, _named_laws):
            monkeypatch.setattr(module, "minimise", None)
        monkeypatch.setattr(_as_measured, "over", None)
        _, again = reached_channels(null.problem, null.fit, [])
        pd.testing.assert_frame_equal(
            as_measured(again[0], free_factor(again[0].port, responses)), table
        )
    assert [law.log_odds for law in again] == [law.log_odds for law in laws]


def test_each_channel_and_all_of_them_are_tried():
    settings = [each.setting(experiment(driven=TWO)) for each in channels_of(problem().experiment)]
    sensors, actuators = [f"sensor s{n}" for n in (1, 2, 3)], ["actuator a1", "actuator a2"]
    assert settings == [*sensors, *actuators, "all channels"]
    # One actuator is no channel against others.
    assert len(channels_of(experiment())) == 4


def test_channels_are_told_in_words_and_in_a_file():
    found = reached("one")
    words = r"channel s2: gain of 0\.9[23]\d* and delay of [\d.]+ µs removes 100% of the misfit"
    assert re.match(words, found.words()[0])
    (entry,) = (each for each in found.to_json() if each["acts_on"] == "channel")
    assert entry["best"]["law_tree"] == ["*", "gain", "delay"]
    assert entry["best"]["setting"] == "sensor s2" and entry["best"]["place_m"] == []
    assert len(entry["curve"]) == 3
    assert json.loads(json.dumps(entry)) == entry


@pytest.mark.parametrize(
    ("any_law", "few", "fails", "words"),
    [
        (
            0.38,
            0.3,
            True,
            "No single attachment explains this, whatever its law: the best place re"
            "moves 38%. Look",
        ),
        (
            0.9,
            0.3,
            True,
            "No single attachment of few numbers explains this: the best place remove"
            "s 30%, any law up to 90%. Look",
        ),
        (0.9, 0.6, True, "all channels: "),
        (0.38, 0.3, None, "all channels: "),  # of unknown noise there is no check
    ],
)
def test_that_nothing_removes_half_is_told_first(any_law, few, fails, words):
    found = reached("all")
    curves, laws = found.curves.copy(), found.laws.assign(few_numbers=few)
    curves["any_law"] = np.where(curves["setting"] == "", any_law, 1.0)
    weak = replace(found, curves=curves, laws=laws, fails=fails)
    assert weak.words()[0].startswith(words)
    assert len(weak.words()) == len(weak.kinds()) + words.startswith("No single")


def test_that_nothing_is_missing_is_all_that_is_told():
    (sentence,) = replace(reached("all"), fails=False).words()
    assert sentence == "Nothing is seen to be missing: the model reaches the noise without it."


@pytest.mark.long
@pytest.mark.longest
def test_channels_become_no_networks():
    setup = experiment()
    null = null_hypothesis(setup, setup.data(measured(factor=LOW_PASS)))
    found = with_networks(Comparison([null], {}), LawsBeside(null, lambda: None))
    assert found.reach.kinds().index[0] == "all_channels"
    _, *others = found.hypotheses
    assert others and all(isinstance(h.effects[0], bp.effects.OnPorts) for h in others)


def test_a_pair_that_was_not_measured_has_no_part_in_a_factor():
    setup = experiment(driven=TWO)
    taken = measured(driven=TWO, factor=in_sensor(1, 1.3))
    gone = (np.arange(3)[:, None, None] == 1) & (np.arange(2)[None, :, None] == 0)
    frf, coherence = (np.where(gone, np.nan, each) for each in (taken.frf, taken.coherence))
    data = setup.data(replace(taken, frf=frf, coherence=coherence))
    base = null_hypothesis(setup, data).problem
    at = free_factor(channels_of(setup)[1], Responses(base)).at(np.zeros((1, base.dimension)))
    seen = np.abs(at.slope[0]).max(axis=1) > 0
    assert list(seen) == [False, False, False, True, False, False]  # s2 by a2
    assert np.isfinite(at.left(at.best())).all() and np.all(at.left(at.best())[0, 2] == 0.0)


@pytest.mark.parametrize("number", [1, 4, 5], ids=["sensor", "actuator", "all"])
def test_a_free_factor_is_that_of_an_effect(number):
    here, points = free(number), points_of(problem())
    port = channels_of(problem().experiment)[number]
    gain = (
        bp.effects.gain_error(port.effect.transducer, error=0.3, side=port.effect.side)
        if port.acts_on == "channel"
        else bp.effects.low_pass(None, frequency=900.0)
    )
    change = 0.3 + 0j * OMEGA if port.acts_on == "channel" else 1 / (1 + 1j * LINES / 900.0) - 1
    changed = Problem(problem().experiment + gain, problem().data)
    expected, _ = changed.squares.residuals(points)
    law = np.broadcast_to(change, (2, OMEGA.size))
    found = here.residuals(points, law, np.ones_like(law))
    parts = np.stack([found.real, found.imag], axis=2)
    assert np.allclose(parts.reshape(2, -1), expected, rtol=1e-9, atol=1e-6)


def test_slopes_with_a_factor_that_is_free():
    here, points = free(), points_of(problem())
    objective = AnyLaw(here)
    found = objective.normal_equations(points[:1])
    expected = gradient_of(lambda p: objective.cost(p[None])[0], points[0], range(points.shape[1]))
    assert np.allclose(found.gradient[0], expected, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("tree", ["mount", ["*", "gain", "delay"]], ids=str)
def test_slopes_of_filters(tree):
    here, points = free(4), points_of(problem())
    rows = FilterRows(OMEGA, of_force=True)
    asked = LawsAsked(Asked.at(here, points, np.arange(OMEGA.size)), rows, OMEGA, False)
    numbers = 0.2 * np.random.default_rng(2).standard_normal(NUMBERS)
    row = np.concatenate([numbers, [FILTERS.index(tree), 1]])
    assert row.size == OF_ROW
    full = np.concatenate([points[0], row[:-1]])
    for objective, point in ((asked, row), (LawsInFull(here, rows, OMEGA, False), full)):
        found = objective.normal_equations(point[None])
        free_ones = range(len(point) - (2 if objective is asked else 1))
        slopes = gradient_of(lambda p, o=objective: o.cost(p[None])[0], point, free_ones)
        found = found.gradient[0, : len(slopes)]
        assert np.max(np.abs(found - slopes)) < 2e-3 * np.max(np.abs(slopes))


@pytest.mark.parametrize("side", ["sensor", "actuator"])
def test_filters_are_the_effects_of_the_library(side):
    effects = {
        "low-pass": (bp.effects.low_pass("x", frequency=300.0, side=side), (300.0,)),
        "low-pass-2": (bp.effects.low_pass("x", frequency=300.0, order=2, side=side), (300.0,)),
        "high-pass": (bp.effects.high_pass("x", frequency=300.0, side=side), (300.0,)),
        "gain": (bp.effects.gain_error("x", error=-0.2, side=side), (0.8,)),
        "delay": (bp.effects.channel_delay("x", delay=1e-4, side=side), (1e-4,)),
        "reversed": (bp.effects.reversed_channel("x", side=side), ()),
    }
    if side == "sensor":
        effects["mount"] = (
            bp.effects.mount_resonance("x", frequency=400.0, damping_ratio=0.1),
            (400.0, 0.1),
        )
    sensor, actuator = bp.Sensor("x", at=0.1), bp.Actuator("x", at=0.2)
    setup = bp.Experiment(
        experiment().structure,
        sensors=[sensor],
        actuators=[actuator],
        frequency=LINES,
        observe=bp.observe.Complex("velocity"),
        noise=None,
    )
    for name, (effect, numbers) in effects.items():
        (added,) = (setup + effect).effects
        expected = np.ravel(added.channel_factor(jnp.asarray(OMEGA), setup.instruments))
        found = ChannelFilter({name: numbers}, of_force=side == "actuator").factor(OMEGA)
        assert np.allclose(found, expected), name


def test_other_filters_are_their_closed_forms():
    def factor(name, *numbers, of_force=False):
        return ChannelFilter({name: numbers}, of_force).factor(OMEGA)

    assert np.allclose(factor("high-pass", 50.0), 1j * LINES / (50.0 + 1j * LINES))
    assert np.allclose(factor("differentiated"), 1j * OMEGA)
    assert np.allclose(factor("integrated", of_force=True), 1j * OMEGA)
    assert set(PARTS) >= {"differentiated", "integrated", "high-pass"}


def test_figures_have_bars_for_channels_and_the_factor():
    found = reached("one")
    axes = bp.plots.reach.curves(found).axes
    (bars,) = (each for each in axes if each.get_title().startswith("sensor s2"))
    assert [text.get_text() for text in bars.get_yticklabels()] == [
        "s1",
        "s2",
        "s3",
        "all channels",
    ]
    widths = [patch.get_width() for patch in bars.patches]
    assert widths[:4] == pytest.approx(list(100 * found.curves["any_law"].tail(4)))
    magnitude, phase = bp.plots.reach.law(found).axes
    assert magnitude.get_title() == "channel s2"
    assert magnitude.get_ylabel() == "factor [1]" and magnitude.get_yscale() == "linear"
    *_, law = phase.lines
    assert np.allclose(law.get_ydata(), np.degrees(np.angle(LATE)), atol=1.0)


@pytest.mark.parametrize("name", ["one", MASS])
def test_a_factor_is_no_universal_file_of_a_law(name):
    ledger = Mock(spec=Ledger, reach=reached(name), port=None)
    run = Mock(spec=Run)
    write_reach(ledger, run)
    assert run.law.called == (name == "mass")
    assert [call.args[0] for call in run.table.call_args_list] == ["reach.csv", "law.csv"]
