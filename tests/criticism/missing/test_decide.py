"""What is claimed of rows of numbers: nothing is fitted."""

import dataclasses
import itertools
import json

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing.table import Row, TableOfFits

NOTHING, OTHER = "nothing_missing", "none_of_these"

COUNT = 1000
PASSES, FAILS = COUNT, 2 * COUNT
"""Sums of squares of models that pass their check and that fail."""

BLOCKS = (1.0, 1.2, 0.9, 1.1)
"""Scores of held-out data, of a standard error of 0.06 where those of others are alike."""


def row(kinds, evidence, squares=PASSES, **others):
    """A row of known noise; kinds are typed with blanks between them."""
    names = tuple(kinds.split())
    return Row(names, evidence, squares, COUNT, 4.0, effects=names, **others)


def erroneous(kinds, evidence, chi2, gain=0.0, **others):
    """A row with model error that predicts held-out data better by a gain."""
    held_out = tuple(gain * block for block in BLOCKS)
    settings = {"has_errors": True, "chi2_when_exact": chi2, "held_out": held_out}
    return row(kinds, evidence, **settings | others)


def decided(*rows, **policy):
    return bp.decide(TableOfFits(list(rows)), bp.Policy(**policy))


NONE = row("", -900.0, FAILS)


def test_where_the_model_passes_its_check_nothing_is_missing():
    decision = decided(row("", 0.0), row("mass", -1.0), row("gain", -2.0))
    assert decision.kinds == () and not decision.unexplained and decision.steps == (0,)
    # Odds are 4 and 4 e to one, and of a larger error that the policy says.
    odds = 1 + np.exp(-1) / 2 + np.exp(-2) / 2
    assert decision.probabilities[NOTHING] == pytest.approx(
        (1 - decision.probabilities[OTHER]) / odds
    )
    assert decision.probabilities[OTHER] < bp.Policy().prior_of_none
    assert decision.reasons == ()


def test_strong_evidence_is_a_claim():
    decision = decided(NONE, row("mass", 0.0), row("gain", -800.0, FAILS))
    assert decision.kinds == decision.told_as_missing == ("mass",)
    assert decision.probabilities["mass"] > 0.95
    assert decision.confounded == () and decision.doubts == {"mass": ()}


@pytest.mark.parametrize(("squares", "factor", "kinds"), [(PASSES, 30, ()), (FAILS, 30, ("mass",))])
def test_where_the_model_passes_its_check_twice_strong_evidence_is_needed(squares, factor, kinds):
    """Chi2 of 6000 lines passes although an effect shows in some of them."""
    rows = row("", 0.0, squares), row("mass", np.log(2 * factor))
    decision = decided(*rows)
    assert decision.kinds == kinds
    assert decision.reasons == (() if kinds else ("the model as given passes its check",))
    assert decided(rows[0], row("mass", np.log(2 * 401))).kinds == ("mass",)


def test_two_effects_of_nearly_the_same_odds_are_confounded():
    others = row("gain", -4.0), row("delay", -4.0, FAILS), row("hum", -9.0)
    decision = decided(NONE, row("mass", 0.0), row("spring", -1.0), *others)
    assert decision.kinds == ("mass",)
    # What passes its check as well is not excluded by the misfit.
    assert decision.confounded == (("mass", "spring"), ("mass", "gain"))
    assert decision.probabilities["spring"] == pytest.approx(
        decision.probabilities["mass"] / np.e, rel=1e-6
    )


def test_one_effect_more_with_less_misfit_but_weak_evidence_is_not_claimed():
    single, pair = row("mass", 0.0), row("gain mass", np.log(2 * 19.0), PASSES - 20)
    decision = decided(NONE, single, pair)
    assert decision.kinds == ("mass",)
    assert decision.reasons == ("the evidence for gain + mass is not strong",)
    strong = pair._replace(log_evidence=np.log(2 * 21.0))
    decision = decided(NONE, single, strong)
    assert decision.kinds == ("gain", "mass") and decision.steps == (0, 1, 2)


@pytest.mark.parametrize(
    ("chi2", "kinds"), [(30.0, ("mass",)), (50.0, ("mass",)), (51.0, ()), (90.0, ())]
)
def test_an_effect_explains_more_than_it_leaves_to_the_model_error(chi2, kinds):
    rows = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, chi2, gain=1.0)
    decision = decided(*rows)
    assert decision.kinds == kinds
    reason = "mass removes no more than 50% of the misfit, and the model error would have to "
    reason += "take up the rest"
    assert decision.reasons == (() if kinds else (reason,))
    # What is new since a baseline may be small.
    assert decided(*(each._replace(states=2) for each in rows)).kinds == ("mass",)


@pytest.mark.parametrize(
    ("noise", "ratio", "kinds"), [(0.1, 0.1, ("mass",)), (0.19, 0.1, ()), (0.19, 0.7, ("mass",))]
)
def test_of_unknown_noise_what_is_smooth_is_the_misfit(noise, ratio, kinds):
    unknown = {"is_noise_known": False, "outliers": 0.0}
    none = erroneous("", 0.0, np.nan, noise=0.2, neumann=(0.05, 20.0), **unknown)
    left = {"noise": noise, "neumann": (ratio, 20.0)}
    assert (
        decided(none, erroneous("mass", 30.0, np.nan, gain=1.0, **left, **unknown)).kinds == kinds
    )


AT_EDGE = (("model_error.damping.size", 1.0, 0.98), ("model_error.gain.size", 0.01, 0.6))


def test_beside_a_model_error_as_large_as_its_prior_allows_nothing_is_new():
    rows = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, 9.0, gain=1.0)
    rows = [each._replace(states=2) for each in rows]
    assert decided(*rows).kinds == ("mass",)
    decision = decided(rows[0], rows[1]._replace(sizes=AT_EDGE))
    assert decision.kinds == ()
    (reason,) = decision.reasons
    assert reason.startswith("mass needs as large a model error of damping as its prior allows: ")


@pytest.mark.parametrize(("on_structure", "kinds"), [(True, ()), (False, ("mass",))])
def test_nothing_acts_on_a_structure_whose_model_error_is_no_rival(on_structure, kinds):
    """Not so of a reversed sensor, say, which no error of a structure resembles."""
    none, mass = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, 9.0, gain=1.0)
    mass = mass._replace(on_structure=on_structure)
    assert decided(none, mass).kinds == ("mass",)
    decision = decided(none, mass._replace(sizes=AT_EDGE))
    assert decision.kinds == kinds
    doubted = [doubt.words for doubts in decision.doubts.values() for doubt in doubts]
    assert doubted == ["the model error is as large as its prior allows"] * len(kinds)


@pytest.mark.parametrize(
    "baseline",
    [
        row("", 0.0, FAILS),
        erroneous("", 0.0, 9.0, sizes=AT_EDGE),
        row("", 0.0, is_noise_known=False, neumann=(0.2, 20.0)),
    ],
)
def test_of_a_baseline_that_is_not_explained_nothing_is_said_to_be_new(baseline):
    rows = [row("", -900.0, FAILS, states=2), row("mass", 0.0, states=2)]
    explained = baseline._replace(squares=PASSES, sizes=(), neumann=(1.0, 20.0))
    assert bp.decide(TableOfFits(rows, (), explained)).kinds == ("mass",)
    decision = bp.decide(TableOfFits(rows, (), baseline))
    assert decision.kinds == decision.told_as_missing == ()
    assert decision.reasons == ("the baseline is not explained by the model",)


def test_beside_a_model_error_what_something_else_explains_as_well_is_not_claimed():
    rows = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, 9.0, gain=1.0)
    decision = decided(*rows, erroneous("spring", 29.0, 9.0, gain=1.0))
    assert decision.kinds == () and decision.confounded == (("mass", "spring"),)
    (reason,) = decision.reasons
    assert reason.endswith("explains the data beside a model error: so does spring")
    # What is not believed has no probability; what stands in its place neither.
    assert decision.probabilities["mass"] == 0.0
    assert decision.probabilities[OTHER] > 0.6 > 0.4 > decision.probabilities["spring"]


HERE, BESIDE, NEXT, LONG = (
    ((0.3, 0.5), (0.34, 0.52)),
    ((0.27, 0.5), (0.32, 0.51)),
    ((0.345, 0.5), (0.36, 0.52)),
    ((0.1,) * 2, (0.9,) * 2),
)


@pytest.mark.parametrize(
    ("place", "kinds"),
    [
        (BESIDE, ("mass",)),
        (NEXT, ("mass",)),
        (LONG, ()),
        (((0.5, 0.5), (0.54, 0.52)), ()),
        (None, ()),
    ],
)
def test_what_else_explains_the_data_at_the_same_place_is_told_beside(place, kinds):
    """A spring and a bed about it are one claim; not what acts elsewhere, or who knows where."""
    rows = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, 9.0, gain=1.0)
    other = erroneous("spring", 29.0, 9.0, gain=1.0)
    mass = rows[1]._replace(places=(("mass", HERE),))
    other = other if place is None else other._replace(places=(("spring", place),))
    decision = decided(rows[0], mass, other)
    assert decision.kinds == kinds and decision.confounded == (("mass", "spring"),)


def test_of_two_masses_it_is_not_known_which_one_is_replaced():
    twice = row("mass mass", 0.0)._replace(places=(("mass", HERE), ("mass", LONG)))
    assert twice.place_of("mass") is None and twice.place_of("spring") is None
    assert twice._replace(places=twice.places[:1]).place_of("mass") == HERE


@pytest.mark.parametrize(("held_out", "kinds"), [(-1.0, ()), (0.25, ()), (0.27, ("mass",))])
def test_an_effect_predicts_held_out_data_better_by_two_standard_errors(held_out, kinds):
    none = erroneous("", 0.0, 100.0, held_out=(0.0, 0.1, -0.1, 0.2))
    scores = tuple(held_out + noise for noise in (0.1, 0.0, 0.2, -0.1))
    decision = decided(none, erroneous("mass", 30.0, 9.0, held_out=scores))
    assert decision.kinds == kinds
    assert decision.reasons == (() if kinds else ("mass predicts held-out data no better",))


@pytest.mark.parametrize("states", [1, 2])
@pytest.mark.parametrize(("ratio", "kinds"), [(9.0, ("mass",)), (11.0, ())])
def test_beside_a_model_error_a_size_at_the_edge_of_its_prior_is_no_claim(states, ratio, kinds):
    edges = (("mass", "upper", ratio),)
    mass = erroneous("mass", 30.0, 1.0, gain=1.0, edges=edges, states=states)
    decision = decided(erroneous("", 0.0, 100.0, states=states), mass)
    assert decision.kinds == kinds
    assert bool(decision.reasons) == (not kinds)
    # Two effects of which one sits there: the other stays.
    both = mass._replace(kinds=("gain", "mass"), effects=("gain", "mass"), log_evidence=60.0)
    single = erroneous("gain", 30.0, 20.0, gain=0.5, states=states)
    both = both._replace(held_out=tuple(2 * each for each in mass.held_out))
    found = decided(erroneous("", 0.0, 100.0, states=states), single, both).kinds
    assert found == (("gain", "mass") if kinds else ("gain",))


def test_an_effect_that_predicts_better_once_the_next_is_there_is_not_doubted():
    none, single = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, 60.0, gain=-1.0)
    pair = erroneous("gain mass", 60.0, 5.0, gain=2.0)
    decision = decided(none, single, pair)
    assert decision.kinds == ("gain", "mass")
    assert decision.doubts == {"gain": (), "mass": ()}


def test_effects_that_do_not_hold_are_left_out_one_by_one():
    rows = [
        erroneous("", 0.0, 100.0),
        erroneous("mass", 30.0, 20.0, gain=1.0),
        erroneous("gain mass", 60.0, 5.0, gain=0.9),
    ]
    assert decided(*rows).kinds == ("mass",)
    assert decided(*rows).reasons == ("gain + mass predicts held-out data no better",)
    probabilities = decided(*rows).probabilities
    assert probabilities["gain"] < 1e-9 and probabilities["mass"] > 0.95
    rows[1] = erroneous("mass", 30.0, 20.0, gain=-1.0)
    rows[2] = erroneous("gain mass", 60.0, 15.0, gain=-2.0)
    assert decided(*rows).kinds == () and len(decided(*rows).reasons) == 2


def test_unknown_noise_is_judged_by_the_scatter_of_neighbouring_lines():
    unknown = {"is_noise_known": False, "outliers": 10.0}
    smooth, rough = {**unknown, "neumann": (0.3, 20.0)}, {**unknown, "neumann": (1.0, 20.0)}
    decision = decided(row("", 0.0, **smooth), row("mass", 50.0, **rough))
    assert decision.kinds == decision.told_as_missing == ("mass",)
    assert not decision.unexplained
    nothing = decided(row("", 50.0, **smooth), row("mass", 0.0, **smooth))
    assert nothing.kinds == () and nothing.unexplained
    assert nothing.probabilities[OTHER] > 0.99
    only_best = decided(row("", 0.0, **smooth), row("mass", 50.0, **smooth))
    assert only_best.kinds == ("mass",) and only_best.told_as_missing == ()


@pytest.mark.parametrize(("others", "kinds"), [(0.5, ("mass",)), (-0.5, ())])
def test_an_effect_that_shows_in_one_block_predicts_better_where_the_others_agree(others, kinds):
    """The block that gains most makes the standard error as large as the mean."""
    gains = (90.0, *(others + 0.01 * number for number in range(9)))
    none = erroneous("", 0.0, 100.0, held_out=(0.0,) * 10)
    assert decided(none, erroneous("mass", 30.0, 9.0, held_out=gains)).kinds == kinds


def test_a_claim_is_doubted_by_edges_held_out_data_and_its_check():
    none = NONE._replace(held_out=BLOCKS)
    worse = tuple(score - loss for score, loss in zip(BLOCKS, (0.1, 0.2, 0.1, 0.2), strict=True))
    edges = (("mass", "upper", 30.0), ("mass", "lower", 9.0), ("gain", "lower", 40.0))
    mass = row("mass", 0.0, 1.3 * COUNT, held_out=worse, edges=edges)
    decision = decided(none, mass)
    words = [doubt.words for doubt in decision.doubts["mass"]]
    assert words == [
        "its size sits at the upper edge of its prior",
        "held-out data are predicted worse with it",
        "the model still fails its check",
    ]
    assert decision.doubts["mass"][0].p_value == pytest.approx(1 / 30)
    assert decision.unexplained


POOL = [
    erroneous("", 0.0, 100.0),
    erroneous("gain", 8.0, 90.0, gain=0.1),
    erroneous("mass", 30.0, 20.0, gain=1.0),
    erroneous("mass", 12.0, 25.0),
    erroneous("spring", 24.0, 30.0, gain=0.9),
    erroneous("gain mass", 70.0, 4.0, gain=1.5),
]


def test_the_order_of_rows_has_no_consequence():
    first = decided(*POOL)
    assert first.kinds == ("gain", "mass")
    for rows in itertools.islice(itertools.permutations(POOL), 0, 720, 7):
        decision = decided(*rows)
        assert [rows[n] for n in decision.steps] == [POOL[n] for n in first.steps]
        assert decision.confounded == first.confounded
        assert decision.reasons == first.reasons
        assert decision.probabilities == pytest.approx(first.probabilities)


@pytest.mark.parametrize("excess", [3.1, 4.0, 7.0, 20.0])
def test_twice_the_difference_of_evidence_is_no_less_of_a_claim(excess):
    rows = NONE, row("mass", NONE.log_evidence + excess + np.log(2))
    twice = rows[0], rows[1]._replace(log_evidence=NONE.log_evidence + 2 * excess + np.log(2))
    assert decided(*rows).kinds == decided(*twice).kinds == ("mass",)


@pytest.mark.parametrize(
    ("policy", "kinds"),
    [({}, ("mass",)), ({"strong": 100.0}, ()), ({"prior_of_further_effect": 0.1}, ())],
)
def test_the_policy_says_what_is_strong(policy, kinds):
    rows = row("", 0.0, FAILS), row("mass", np.log(2 * 30.0), FAILS)
    assert decided(*rows, **policy).kinds == kinds


def test_the_policy_says_when_a_check_fails_and_what_stands_out():
    rows = row("", 0.0, 1.09 * COUNT), row("mass", np.log(2 * 30.0))
    assert decided(*rows).kinds == () and decided(*rows, level=0.05).kinds == ("mass",)
    small = erroneous("", 0.0, 100.0), erroneous("mass", 30.0, 60.0, gain=1.0)
    assert decided(*small).kinds == () and decided(*small, explained=0.3).kinds == ("mass",)
    seldom = decided(*rows, prior_of_none=1e-6).probabilities[OTHER]
    assert seldom < 1e-4 * decided(*rows).probabilities[OTHER] / bp.Policy().prior_of_none


def test_a_table_is_the_same_after_json():
    unknown = row("mass", 1 / 3, is_noise_known=False, neumann=(0.3, 20.0), outliers=2.5)
    edged = POOL[-1]._replace(edges=(("mass", "upper", 12.5),), sizes=(("sigma", 0.02, 0.7),))
    table = TableOfFits([*POOL[:-1], edged], ("gain", "mass", "spring", "delay"), POOL[0])
    again = TableOfFits.from_json(json.loads(json.dumps(table.to_json())))
    np.testing.assert_equal(again, table)
    assert bp.decide(again) == bp.decide(table) == bp.decide(table.to_json())
    np.testing.assert_equal(TableOfFits.from_json(TableOfFits([unknown]).to_json()).rows, [unknown])
    assert bp.decide(table).probabilities["delay"] == 0


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"rows": []}, "'kinds' and 'rows' with"),
        ({"kinds": [], "rows": [{"kinds": []}]}, "all fields of each"),
        ({"kinds": [], "rows": [{"colour": "red"}]}, "all fields of each"),
        (TableOfFits([row("mass", 0.0)]), "one without is needed"),
    ],
)
def test_what_is_no_table_is_refused(table, words):
    with pytest.raises(InputError, match=words):
        bp.decide(table)


def test_an_error_that_may_not_be_larger_is_refused():
    with pytest.raises(InputError, match="more than 1 is needed"):
        bp.Policy(largest_factor=1.0)


def test_no_threshold_is_without_consequence():
    """Each but those of words changes a decision on some of the rows above."""
    mixed = [
        row("", 0.0, 1.09 * COUNT, held_out=BLOCKS),
        row("mass", 6.0, held_out=tuple(score - 1 for score in BLOCKS)),
        row("spring", 4.0, PASSES, edges=(("spring", "upper", 12.0),)),
    ]
    worse = tuple(score - loss for score, loss in zip(BLOCKS, (0.1, 0.5, 0.1, 0.2), strict=True))
    doubted = [
        row("", 0.0, FAILS, held_out=BLOCKS),
        row("mass", 99.0, held_out=worse, edges=(("mass", "upper", 12.0),)),
    ]
    alike = [NONE, row("mass", 0.0), row("spring", -1.0)]
    beside = [
        erroneous("", 0.0, 100.0),
        erroneous("mass", 30.0, 9.0, gain=1.0)._replace(places=(("mass", HERE),)),
        erroneous("spring", 29.0, 9.0, gain=1.0)._replace(places=(("spring", BESIDE),)),
    ]
    tables = [mixed, doubted, alike, beside, POOL[:3]]
    extremes = {
        "level": 0.5,
        "strong": 1e30,
        "strong_where_passing": 1.0,
        "prior_of_further_effect": 0.01,
        "prior_of_none": 0.5,
        "largest_factor": 2.0,
        "held_out_errors": 50.0,
        "explained": 0.99,
        "piled_up": 20.0,
        "doubted": 0.999,
        "one_place": 0.01,
    }
    names = {field.name for field in dataclasses.fields(bp.Policy)}
    assert names == {*extremes, "outlier"}
    for name, value in extremes.items():
        changed = [decided(*rows, **{name: value}) != decided(*rows) for rows in tables]
        assert any(changed), name
