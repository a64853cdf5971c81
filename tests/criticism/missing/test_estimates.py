"""What is printed of an estimate and of a ledger: units of people, intervals, 80 columns."""

from dataclasses import replace

import pandas as pd
import pytest

from bayes_placement import effects
from bayes_placement.criticism.missing._change_between_states import FoundEffect
from bayes_placement.criticism.missing._narrow_text import narrow
from bayes_placement.criticism.missing._parameter_estimate import ParameterEstimate
from bayes_placement.criticism.missing.states import EffectInState, LedgerOfStates, courses_of
from tests.plots.test_ledger import ledger, ranking, step

AT = ParameterEstimate(
    0.37, 2.1e-5, 0.36994, 0.37006, "m", "point_mass", "at", "at", 0.36996, 0.37004
)
LOSS = ParameterEstimate(0.2, 0.01, 0.17, 0.23, "1", "cut", "share.loss", "loss", 0.18, 0.22)
MODULUS = ParameterEstimate(
    2.1e11, 2e9, 2.0e11, 2.2e11, "Pa", None, "modulus", "modulus", 2.06e11, 2.14e11
)

COMPLIANCE = ParameterEstimate(
    8.588e-9,
    8.6e-12,
    8.56e-9,
    8.61e-9,
    "m/N",
    "soft",
    "flexibility",
    "flexibility",
    8.571e-9,
    8.605e-9,
)


@pytest.mark.parametrize(
    ("estimate", "words", "short"),
    [
        (AT, "370.000 mm (95 %: 369.960 to 370.040)", "370.000 ± 0.021 mm"),
        (LOSS, "20.0 % (95 %: 18.0 to 22.0)", "20.0 ± 1.0 %"),
        (MODULUS, "210.0 GPa (95 %: 206.0 to 214.0)", "210.0 ± 2.0 GPa"),
        (
            MODULUS._replace(standard_deviation=4.7e4),
            "210.000000 GPa (95 %: 206.000000 to 214.000000)",
            "210.000000 ± 0.000047 GPa",
        ),
        (
            COMPLIANCE,
            "8.5880e-9 m/N (95 %: 8.5710e-9 to 8.6050e-9)",
            "8.5880e-9 ± 8.6e-12 m/N",
        ),
        (AT._replace(standard_deviation=0.0, low_95=0.37, high_95=0.37), "370 mm", "370 ± 0 mm"),
        (AT._replace(low_95=float("nan")), "370.000 ± 0.021 mm", "370.000 ± 0.021 mm"),
    ],
)
def test_an_estimate_is_told_in_the_units_of_people(estimate, words, short):
    assert (estimate.with_interval(), str(estimate)) == (words, short)


def edge(axis, size):
    return LOSS._replace(
        mean=size, unit="m", effect="segment_mass", word=f"extent.{axis}", field="extent"
    )


def test_edges_of_a_patch_are_told_by_their_axes():
    coat = effects.segment_mass((0.2, 0.1, 0.0), (0.06, 0.04, 0.0), 0.09)
    estimates = {f"extent.{axis}": edge(axis, size) for axis, size in ((1, 0.06), (2, 0.04))}
    estimates["mass"] = LOSS._replace(mean=0.09, unit="kg", effect="segment_mass", word="mass")
    fitted = replace(step("segment_mass", 1.0), parameters=estimates)
    assert fitted.in_short(coat) == "extent along x 60 mm, along y 40 mm, mass 90 g"
    assert fitted.description().startswith("extent along x 60 mm (95 %: ")
    found = FoundEffect(coat, "", estimates, None)
    assert "extent along y 40 ± 10 mm" in EffectInState(found, "new").size(str)


@pytest.mark.parametrize(("word", "told"), [("at.along", "at"), ("at.x", "at x"), ("to.y", "to y")])
def test_a_place_is_told_in_the_same_words_everywhere(word, told):
    ends = (0.37, 0.0, 0.0), (0.7, 0.2, 0.0)
    effect = effects.strut(*ends, effects.Spring(1e5), name="point_mass")
    estimates = {word: AT._replace(word=word, field=word.partition(".")[0])}
    fitted = replace(step("point_mass", 1.0), parameters=estimates)
    place = f"{told} {AT.with_interval()}"
    (course,) = courses_of({"a": [FoundEffect(effect, "", estimates, None)]})
    assert course.title() == f"{course.kind} {place}"
    assert fitted.described("point_mass") == place
    assert fitted.in_short(effect).startswith(f"{told} 370.000 mm")


def steps():
    parameters = {f"structure.effects.point_mass.{name}": AT for name in ("at", "other", "third")}
    first = replace(step(None, 1234.0), log_evidence=-1264254.2)
    return first, replace(step("point_mass", 1.0), log_evidence=-12.25, parameters=parameters)


def test_chi2_without_the_model_error_is_a_column_where_all_steps_know_it():
    first, last = (
        replace(step, model_error={"frequency": LOSS}, chi2_when_exact=chi2)
        for step, chi2 in zip(steps(), (1818.0, 3.5), strict=True)
    )
    assert [*ledger(first, last).table()["without model error"]] == ["1818", "3.5"]
    fitted_with_errors_alone = replace(last, chi2_when_exact=float("nan"))
    assert "without model error" not in ledger(first, fitted_with_errors_alone).table()


@pytest.mark.parametrize("result", [ledger(*steps()), replace(ranking(), steps=steps())])
def test_tables_are_printed_in_80_columns_with_the_gain_of_evidence(result):
    steps_of = [replace(step, kind=step.added or "") for step in steps()]
    result = replace(result, steps=tuple(steps_of))
    assert [*result.table()["log evidence gained"]][:2] == ["0.0", "1264242"]
    lines = str(result).splitlines()
    table = lines[: next(number for number, line in enumerate(lines) if line.startswith("- "))]
    assert max(map(len, table)) <= 80
    assert "point_mass: at 370.000 mm (95 %: 369.960 to 370.040)" in str(result)
    assert result.steps[0].to_json()["log_evidence"] == -1264254.2


def test_no_interval_and_no_unit_is_parted_at_the_end_of_a_line():
    for length in range(1, 70):
        estimates = f"{'a' * length} {AT.with_interval()}, {LOSS.with_interval()}"
        text = narrow(pd.DataFrame({"p": [1.0], "parameters": estimates}, index=["point_mass"]))
        assert "370.000 mm" in text
        assert "(95 %: 369.960 to 370.040)" in text
        assert "20.0 %" in text
        assert "(95 %: 18.0 to 22.0)" in text
        assert max(map(len, text.splitlines())) <= 80


MASS = ParameterEstimate(
    0.05, 0.001, 0.0474, 0.0526, "kg", "point_mass", "mass", "mass", 0.048, 0.052
)
LABELS = ("10 nuts", "again, after the holidays", "20 nuts", "with the clamp of the fair")


@pytest.fixture
def of_states():
    """A mass in four states, of which the last has another one besides."""
    mass = FoundEffect(effects.point_mass(0.37, 0.05), "", {"at": AT, "mass": MASS}, None)
    gain = FoundEffect(effects.gain_error("s2", 0.1), "sensor s2+x", {}, None)
    by_state = {label: [mass] for label in LABELS} | {LABELS[-1]: [mass, gain]}
    ledgers = {label: replace(ledger(*steps()), baseline=step(None, 1.25)) for label in LABELS}
    return LedgerOfStates("bare", ledgers, courses_of(by_state, lambda *_: "unchanged"))


def test_a_ledger_of_states_prints_intervals_in_80_columns(of_states):
    text = str(of_states)
    lines = text.splitlines()
    table = lines[: next(number for number, line in enumerate(lines) if line.startswith("- "))]
    assert max(map(len, table)) <= 80
    assert "point_mass at 370.000 mm (95 %: 369.960 to 370.040)" in lines
    assert "  10 nuts: mass 50.0 g (95 %: 48.0 to 52.0), new" in lines
    assert "  20 nuts: mass 50.0 g (95 %: 48.0 to 52.0), unchanged" in lines
    assert text.count("gain_error sensor s2+x\n  with the clamp of the fair: present, new") == 1
    assert [line.split()[-1] for line in lines[:5]] == ["chi-square", "1", "1", "1", "1"]


def test_a_ledger_of_states_shows_intervals_in_a_notebook(of_states):
    html = of_states._repr_html_()
    assert "point_mass at 370.000 mm (95 %: 369.960 to 370.040)" in html
    assert "mass 50.0 g (95 %: 48.0 to 52.0), new" in html
    assert of_states.table().loc["reduced chi-square", "10 nuts"] == "1"


def test_a_ledger_of_states_without_effects_prints_their_misfit(of_states):
    nothing = replace(of_states, courses=())
    assert str(nothing).splitlines()[1].split() == ["10", "nuts", "1"]
    assert [*nothing.table().index] == ["reduced chi-square"]
