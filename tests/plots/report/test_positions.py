"""Deviations of instruments from their records in a report."""

import re

import numpy as np
import pytest
import xarray as xr

import bayes_placement as bp
from bayes_placement.plots.report._saved import Saved
from bayes_placement.plots.report.sections import unknowns
from tests.browser import pages

RNG = np.random.default_rng(4)


def saved(folder, sensors):
    """What a run saved of so many sensors, each uncertain along three axes."""
    size = (sensors, 50, 3)
    item = {
        "kind": ("item", ["sensor"] * sensors),
        "recorded": (("item", "axis"), np.zeros((sensors, 3))),
        "prior": (("item", "draw", "axis"), RNG.uniform(-0.02, 0.02, size)),
        "posterior": (("item", "draw", "axis"), RNG.normal(0.0, 0.002, size)),
        "tilt": (("item", "draw"), np.full(size[:2], np.nan)),
        "direction": (("item", "axis"), np.full((sensors, 3), np.nan)),
        "direction_recorded": (("item", "axis"), np.full((sensors, 3), np.nan)),
    }
    names = [f"s{number + 1}" for number in range(sensors)]
    outline = xr.Dataset(
        {
            "point": (("node", "axis"), np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])),
            "line": (("edge", "end"), np.array([[0, 1], [1, 2]])),
        },
        attrs={"on_a_line": 0},
    )
    places = xr.Dataset(item, coords={"item": names})
    tree = xr.DataTree.from_dict({"/places": places, "/outline": outline})
    return Saved(folder, {}, tree, {}, {})


def deviations(folder, sensors):
    return {item.title: item for item in unknowns.positions(saved(folder, sensors))}[
        "Deviation from the record"
    ].content


@pytest.mark.parametrize(("sensors", "columns"), [(3, 1), (30, 3)])
def test_deviations_of_many_instruments_stand_on_a_page(tmp_path, sensors, columns):
    svg = deviations(tmp_path, sensors).svg
    height = float(re.search(r'viewBox="0 0 [\d.]+ ([\d.]+)"', svg).group(1)) / 72
    assert height <= 11.0
    assert svg.count(">deviation from the") == columns
    heights = {}
    for name in ("s1 x", f"s{sensors} z"):
        (text,) = re.findall(rf'<text[^>]*?y="([\d.-]+)"[^>]*>{name}<', svg)
        heights[name] = float(text)
    assert heights["s1 x"] < heights[f"s{sensors} z"]  # the first is on top


@pytest.mark.long
def test_no_figure_of_a_report_is_higher_than_a_printed_page(tmp_path):
    report = bp.plots.report.Report("tall")
    tall = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 900"><path d="M0 0V900"/></svg>'
    )
    report.add_figure(tall)
    report.write(tmp_path / "report.html")
    with pages() as opened:
        page = opened(tmp_path / "report.html")
        page.emulate_media(media="print")
        box = page.locator("article.item svg").first.bounding_box()
    assert box["height"] / 96 <= 11.0
