"""Where claimed effects act and their laws, in the report of a run."""

import inspect
import json
import re
import types
from unittest.mock import Mock

import pandas as pd
import pytest
import xarray as xr
from matplotlib.figure import Figure

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.cli._run import Run
from bayes_placement.cli.improve import draw_where, write_reach
from bayes_placement.plots.report import Report, write_report
from bayes_placement.plots.report._saved import Saved
from bayes_placement.plots.report._svg import as_file, svg_of
from bayes_placement.plots.report.sections import laws, verdict
from tests.browser import pages
from tests.criticism.missing.test_claims_in_words import entry
from tests.criticism.reach.cantilever import experiment, maxwell, measured
from tests.plots.report.test_report import check_page

STRUT = entry(
    kind="strut: spring",
    acts_on="relative",
    place_m=[[0.1], [0.4]],
    place_95_m=[[[0.09, 0.11]], [[0.38, 0.42]]],
    law="Spring(2e4)",
    parameters={},
)
MASS = entry(name="point_mass", kind="point_mass", law="Mass(0.5)", parameters={})


def items(folder, *effects):
    saved = Saved(folder, {}, xr.DataTree(), {}, {}, effects)
    return {item.title: item for item in laws.items(saved)}


def test_a_network_is_drawn_with_its_values_and_intervals(tmp_path):
    shown = items(tmp_path, entry())
    assert list(shown) == ["Where it acts", "Network", "Numbers"]
    svg = shown["Network"].content.svg
    assert re.findall(r">([ck][^<]*)</text>", svg) == [
        "c₁ = 3.000 (2.960 to 3.040) N s/m",
        "k = 20.60 (20.00 to 21.20) kN/m",
        "c₂ = 0.5 N s/m",
    ]
    assert "displacement at 359.3 mm (95 %: 358.1 to 360.6)" in shown["Network"].caption
    rows = shown["Numbers"].content.rows
    assert rows[0] == ("c₁", "dashpot", 3.0, 2.96, 3.04, "N s/m")
    assert rows[2] == ("c₂", "dashpot", "0.5 N s/m", None, None, "given")


def test_each_of_several_effects_is_drawn_and_what_explains_as_much_is_listed(tmp_path):
    claimed = entry(equivalent=[STRUT | {"probability": 0.0789}])
    shown = items(tmp_path, claimed, MASS)
    rivals = "What the data do not tell apart"
    assert list(shown) == ["Where it acts", "Network 1", "Numbers 1", rivals]
    first, second, third = shown[rivals].content.rows
    assert first[2] == 0.9
    assert second[1:] == ("spring of 2e+04 N/m", 0.079)
    assert "to 400 mm" in second[0] and third[1] == "point_mass"


def test_figures_of_the_run_are_shown_with_their_numbers(tmp_path):
    (tmp_path / "law.svg").write_text(as_file(svg_of(Figure(figsize=(1.0, 1.0)))))
    pd.DataFrame({"frequency": [1.0], "unit": ["N/m"]}).to_csv(tmp_path / "law.csv", index=False)
    shown = items(tmp_path)
    assert list(shown) == ["The law as measured"]
    assert shown["The law as measured"].data.columns == ("frequency", "unit")
    (tmp_path / "law.svg").write_text("<svg><script>alert(1)</script></svg>")
    with pytest.raises(InputError, match="A figure with script was given"):
        items(tmp_path)


@pytest.mark.long
def test_the_page_shows_reach_and_law_in_letters_that_can_be_read(tmp_path):
    setup, kept = experiment(), {}
    reach = bp.reach(setup, measured(maxwell))
    run = Mock(
        spec=Run,
        table=lambda name, table, index: table.to_csv(tmp_path / name, index=index),
        begin=lambda name, write: write(tmp_path / name),
        law=lambda name, table: None,
        figures=lambda draw: kept.update(draw()),
        attempt=lambda what, draw: draw(),
    )
    result = types.SimpleNamespace(reach=reach, port=None)
    inspect.unwrap(write_reach)(result, run)
    inspect.unwrap(draw_where)(result, types.SimpleNamespace(experiment=setup), run)
    assert set(kept) == {"reach.png", "law.png"}
    claimed = entry(equivalent=[STRUT])
    step = {"added": None, "chi2_per_datum": 1.0, "noise_needed": None, "parameters": {}}
    ledger = {"effects": [claimed], "steps": [step], "verdict": [], "probabilities": {}}
    (tmp_path / "ledger.json").write_text(json.dumps(ledger))
    page = write_report(tmp_path)
    check_page(page)
    (chapter,) = Report.read(page).chapters
    sections = {name: [item.title for item in items] for name, items in chapter.sections}
    assert {"Network", "The law as measured"} <= {*sections["Where it acts, and its law"]}
    assert sections["Suspicion"] == ["What one law at each place could do"]
    with pages() as opened:
        shown = opened(page)
        shown.click("#unfold")
        assert not shown.trouble
        shown.emulate_media(media="print")
        shown.set_viewport_size({"width": 680, "height": 1000})  # A4 without its margins
        sizes = shown.evaluate(SIZES)
        assert len(sizes) > 50 and min(sizes) >= 7.0
        assert shown.evaluate("document.documentElement.scrollWidth") <= 680


SIZES = """
() => [...document.querySelectorAll('.drawing text')].map(text => {
    const scale = text.getScreenCTM();
    return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(scale.a, scale.b) * 0.75;
})
"""
"""Heights of letters of figures as they are printed [pt]."""


def test_a_drawing_as_a_file_names_its_language():
    assert as_file(svg_of(Figure())).startswith('<svg xmlns="http://www.w3.org/2000/svg"')


def test_noise_that_is_needed_falls_to_the_scatter_of_neighbouring_lines():
    step = {"added": None, "chi2_per_datum": 1.0, "chi2_per_datum_when_exact": None}
    noises = [{"relative": 0.65, "over_scatter": 1.0}, {"relative": 0.017, "over_scatter": 1.25}]
    item = verdict._falling([step | {"noise_needed": noise} for noise in noises])
    assert item.caption == (
        "The noise that the best fit needs falls from 65 % to 1.7 %; "
        "1.36 % is the scatter of neighbouring lines."
    )
    unknown = step | {"noise_needed": {"relative": 0.017, "over_scatter": None}}
    assert verdict._falling([unknown]).caption == "The noise that the best fit needs is 1.7 %."
