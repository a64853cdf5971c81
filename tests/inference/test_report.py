"""Reports name the methods that disagree, with the difference, and no others."""

import numpy as np
import pytest
import xarray as xr

import bayes_placement as bp

MEAN, VARIATION = "damping mean", "damping variation"


def result(
    mean=0.04, error=0.001, *, cv=0.1, kl=2.0, evidence=(5.0, 0.1), engine="SMC", warnings=()
):
    """Estimates of one unknown, as `infer` lays them out; an exact result has error zero."""
    zero = 0.0 if error == 0 else 1.0
    estimates = xr.Dataset(
        {
            "mean": ("unknown", [mean]),
            "mean_error": ("unknown", [error]),
            "cv": ("unknown", [cv]),
            "cv_error": ("unknown", [0.01 * zero]),
            "ess": ("unknown", [400.4]),
            "r_hat": ("unknown", [np.nan]),
            "kl_parameters": kl,
            "kl_parameters_error": 0.05 * zero,
            "log_evidence": evidence[0],
            "log_evidence_error": evidence[1],
        },
        coords={"unknown": ["damping"]},
    )
    tree = xr.DataTree.from_dict({"/estimates": estimates, "/sample_stats": xr.Dataset()})
    tree.attrs = {"engine": engine, "warnings": list(warnings), "seconds": 1.234}
    return tree


def words(**results):
    return bp.report(results).words()


def test_methods_within_their_errors_agree():
    assert words(one=result(0.040), two=result(0.043)) == ["All methods agree within their errors."]


def test_methods_beyond_their_errors_are_named_with_both_values():
    report = bp.report({"one": result(0.040), "two": result(0.050)})
    (sentence,) = report.words()
    assert sentence == (
        "one and two disagree on one figure: damping mean, 0.040 ± 0.001 against 0.050 ± 0.001, "
        "7 standard errors apart."
    )
    (disagreement,) = report.disagreements
    assert disagreement.figure == MEAN
    assert disagreement.deviation == pytest.approx(0.01 / np.hypot(0.001, 0.001))


@pytest.mark.parametrize(
    ("other", "figure"),
    [
        ({"cv": 0.3}, VARIATION),
        ({"kl": 3.0}, "KL of parameters"),
        ({"evidence": (7.0, 0.1)}, "log evidence"),
    ],
)
def test_every_figure_is_compared(other, figure):
    (disagreement,) = bp.report({"one": result(), "two": result(**other)}).disagreements
    assert disagreement.figure == figure


def test_several_disagreements_of_a_pair_make_one_sentence_about_the_largest():
    (sentence,) = words(one=result(), two=result(0.05, evidence=(9.0, 0.1)))
    assert sentence.startswith("one and two disagree on 2 figures, most on one: log evidence")


def test_only_the_method_that_stands_apart_is_accused():
    sentences = words(one=result(), two=result(), odd=result(0.06))
    assert [line.split(" disagree")[0] for line in sentences] == ["one and odd", "two and odd"]


def test_a_figure_without_an_error_is_shown_but_not_compared():
    report = bp.report({"one": result(), "two": result(evidence=(50.0, np.nan))})
    assert report.disagreements == []
    assert report.table.loc["two", "log evidence"] == "50"


def test_the_error_of_one_method_is_enough_to_compare_it_with_an_exact_one():
    report = bp.report({"one": result(0.0405), "grid": result(0.05, 0.0, engine="Grid")})
    (disagreement,) = report.disagreements
    assert disagreement.deviation == pytest.approx(9.5)
    assert report.table.loc["grid", MEAN] == "0.05 exact"
    assert report.table.loc["grid", "log evidence"] == "5 exact"


def test_two_exact_methods_are_held_to_each_other():
    exact = {"engine": "Grid", "error": 0.0}
    near = bp.report({"one": result(0.04, **exact), "two": result(0.040001, **exact)})
    assert near.words() == ["All methods agree within their errors."]
    (sentence,) = words(one=result(0.04, **exact), two=result(0.05, **exact))
    assert sentence.endswith(
        "damping mean, 0.04 exact against 0.05 exact, though neither has a sampling error."
    )


def test_agreement_is_not_claimed_where_nothing_was_compared():
    nan = np.nan
    blind = result(error=nan, evidence=(5.0, nan))
    blind["estimates"] = xr.DataTree(
        blind["estimates"].to_dataset().assign(cv_error=("unknown", [nan]), kl_parameters=nan)
    )
    assert words(one=blind, two=blind) == [
        "No two methods have a figure with a standard error in common to compare."
    ]
    assert words(one=result()) == [
        "One method alone checks nothing; give a second one to compare with."
    ]


def test_warnings_are_passed_on_under_the_name_of_the_method():
    sentences = words(one=result(warnings=("It is wet.", "It is cold.")), two=result())
    assert sentences[:2] == ["one: It is wet.", "one: It is cold."]


def test_the_printed_report_holds_table_and_words():
    text = str(bp.report({"one": result(), "two": result(0.06)}))
    for piece in ("one", "two", MEAN, "0.040 ± 0.001", "smallest ESS", "400", "1.2", "- one and"):
        assert piece in text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.03505, 2.9e-5, "0.03505 ± 0.00003"),
        (0.0358, 9.98e-5, "0.0358 ± 0.0001"),
        (5.1052, 0.031, "5.11 ± 0.03"),
        (12.34, 7.0, "12 ± 7"),
        (7.0123e10, 2.1e8, "(7.01 ± 0.02)e10"),
        (-0.5, 0.002, "-0.500 ± 0.002"),
        (2e-7, 3e-5, "(0 ± 3)e-5"),
    ],
)
def test_a_figure_is_written_to_the_first_digit_of_its_error(value, error, text):
    report = bp.report({"one": result(value, error)})
    assert report.table.loc["one", MEAN] == text


def test_figures_of_unknowns_are_told_from_those_of_the_entire_result():
    report = bp.report({"one": result()})
    assert report.of_unknowns == {MEAN: ("damping", "mean"), VARIATION: ("damping", "variation")}
    assert {*report.table} - {*report.of_unknowns} >= {"log evidence", "seconds"}


def test_methods_that_agree_are_rarely_accused():
    # Four methods, 24 comparisons: at most one report in a hundred may accuse one of them.
    rng = np.random.default_rng(11)

    def noisy():
        mean, cv, kl, evidence = rng.normal([0.04, 0.1, 2.0, 5.0], [0.001, 0.01, 0.05, 0.1])
        return result(mean, cv=cv, kl=kl, evidence=(evidence, 0.1))

    alarms = sum(
        bool(bp.report({name: noisy() for name in "abcd"}).disagreements) for _ in range(150)
    )
    assert alarms <= 6  # 1.5 expected; more than 6 with a probability of 4e-4


def test_a_tree_of_another_program_is_refused():
    foreign = xr.DataTree.from_dict({"/posterior": xr.Dataset({"x": ("draw", [1.0])})})
    with pytest.raises(ValueError, match='"numpyro" holds no group "estimates"'):
        bp.report({"numpyro": foreign})
