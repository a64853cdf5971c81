"""Figures of placements: values, units, and the marked optimum."""

import functools

import numpy as np
import numpy.testing as npt
import pandas as pd
import pytest
import xarray as xr

from bayes_placement.design.information.estimator import jackknife_error
from bayes_placement.design.place import Placement
from bayes_placement.design.tolerance import FACTOR, ToleranceStudy
from bayes_placement.plots import placement as placement_plots

PLACES = {
    "s1": np.linspace(0.1, 0.9, 9),
    "a1": np.linspace(0.2, 0.8, 5),
    "s2": np.array([0.15, 0.5, 0.7, 0.95]),
}
TOP = {"s1": 0.3, "a1": 0.65, "s2": 0.7}
KL = "information [nat]"


def hill(*names, height=1.0, error=1e-3):
    """A map with one hill, as `information_map` lays it out; errors are not common."""
    grid = np.meshgrid(*(PLACES[name] for name in names), indexing="ij")
    apart = sum((x - TOP[name]) ** 2 for x, name in zip(grid, names, strict=True))
    return labelled(names, height * np.exp(-apart / 0.1), error).assign_coords(
        {name: (name, PLACES[name], {"units": "m"}) for name in names}
    )


def labelled(names, kl, error):
    random = np.random.default_rng(4)
    without = kl[..., None] + error / np.sqrt(3) * random.standard_normal((*kl.shape, 4))
    return xr.Dataset(
        {
            "information_gain": (names, kl),
            "information_gain_se": (names, jackknife_error(without)),
            "information_gain_jackknife": ([*names, "replicate"], without),
        }
    )


def in_space(*names):
    """A map of places on a plate at x-z, best at the fifth place of the first."""
    x, z = (values.ravel() for values in np.meshgrid([0.0, 0.2, 0.4], [0.0, 0.15, 0.3]))
    kl = np.exp(-(((x - 0.2) ** 2 + (z - 0.15) ** 2) / 0.05))
    kl = kl if len(names) == 1 else np.add.outer(kl, 2 * np.roll(kl, 1))
    triple = {"x": x, "y": np.full(9, 0.02), "z": z}
    return labelled(names, kl, 1e-3).assign_coords(
        {f"{name}.{axis}": (name, at) for name in names for axis, at in triple.items()}
    )


def study(*names):
    factors = [1.0, 0.5, 0.25]
    maps = [hill(*names, height=height) for height in (1.0, 1.5, 1.6)]
    along = xr.DataArray(factors, dims=FACTOR, name=FACTOR)
    return ToleranceStudy(xr.concat(maps, dim=along), pd.DataFrame())


def placement(count):
    kl = np.linspace(2.0, 1.0, count)
    columns = {
        "s1": np.linspace(0.1, 0.9, count),
        "information_gain": kl,
        "information_gain_se": np.full(count, 0.02),
    }
    tried = pd.DataFrame(columns | {"cost": np.zeros(count), "net_gain": kl})
    return Placement({"s1": 0.1}, (), 2.0, 0.02, 0.0, 0.1, 0.01, tried, "Exhaustive", count)


FIGURES = {
    "curve": lambda: placement_plots.information(hill("s1")),
    "map": lambda: placement_plots.information(hill("s1", "a1")),
    "pairs": lambda: placement_plots.information(hill("s1", "a1", "s2")),
    "space": lambda: placement_plots.information(in_space("s1")),
    "two in space": lambda: placement_plots.information(in_space("s1", "a1")),
    "tolerances": lambda: placement_plots.tolerances(study("s1", "a1")),
    "tolerances of one": lambda: placement_plots.tolerances(study("s1")),
    "tolerances of three": lambda: placement_plots.tolerances(study("s1", "a1", "s2")),
    "placements": lambda: placement_plots.placements(placement(30)),
    "one placement": lambda: placement_plots.placements(placement(1)),
}


def drawn(figure):
    """Draw a figure; a warning of the layout or of a missing value is an error in this suite."""
    figure.draw_without_rendering()
    return figure


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def line(axis, label):
    (curve,) = [line for line in axis.lines if line.get_label() == label]
    return curve.get_xdata(), curve.get_ydata()


def panels(figure):
    """Panels without the bars of colours."""
    return [axis for axis in figure.axes if axis.get_xlabel()]


def bars(figure):
    return [axis for axis in figure.axes if not axis.get_xlabel()]


@functools.cache
def figure_of(name):
    return drawn(FIGURES[name]())


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_bears_a_name_and_a_unit(name):
    figure = figure_of(name)
    for axis in panels(figure):
        assert axis.get_xlabel().endswith(("[m]", "placements that were tried", "was tried"))
        assert axis.get_ylabel().endswith(("[m]", "[nat]"))
    assert {axis.get_ylabel() for axis in bars(figure)} <= {KL}


@pytest.mark.parametrize("name", FIGURES)
def test_each_entry_of_the_legend_stands_once_and_within_the_figure(name):
    figure = figure_of(name)
    entries = labels(figure)
    assert len(entries) == len(set(entries)) and "best" in entries
    box, frame = figure.legends[0].get_window_extent(), figure.bbox
    assert frame.x0 <= box.x0 and box.x1 <= frame.x1


@pytest.mark.parametrize("name", FIGURES)
def test_nothing_lies_above_the_star(name):
    for axis in panels(figure_of(name)):
        stars = [artist for artist in axis.lines if artist.get_label() == "best"]
        assert len(stars) == 1
        others = [artist for artist in [*axis.lines, *axis.collections] if artist is not stars[0]]
        drawn_later = [artist for artist in others if artist.get_zorder() > stars[0].get_zorder()]
        assert not drawn_later


def test_a_map_shows_its_values_with_the_star_at_the_greatest():
    gains = hill("s1", "a1")
    (axis,) = panels(placement_plots.information(gains))
    mesh = axis.collections[0]
    npt.assert_array_equal(mesh.get_array(), gains["information_gain"].T)
    corners = mesh.get_coordinates()
    npt.assert_allclose([corners[0, 0], corners[-1, -1]], [(0.05, 0.125), (0.95, 0.875)])
    assert axis.get_xlabel() == "position of s1 [m]"
    assert axis.get_ylabel() == "position of a1 [m]"
    npt.assert_allclose(np.ravel(line(axis, "best")), [0.3, 0.65])


def test_places_that_are_as_good_are_marked():
    gains = hill("s1", "a1", error=0.05)
    (axis,) = panels(placement_plots.information(gains))
    x, y = line(axis, "no worse than the best within 2 standard errors")
    assert 0 < len(x) < gains["information_gain"].size - 1
    best = float(gains["information_gain"].max())
    for s1, a1 in zip(x, y, strict=True):
        assert best - float(gains["information_gain"].sel(s1=s1, a1=a1)) < 0.5


@pytest.mark.parametrize("names", [("s1",), ("s1", "a1")])
def test_the_legend_names_no_other_places_where_none_are_as_good(names):
    figure = placement_plots.information(hill(*names, error=0.0))
    assert "best" in labels(figure)
    assert not [label for label in labels(figure) if label.startswith("no worse")]


def test_a_curve_has_its_errors_and_the_star():
    gains = hill("s1", error=0.02)
    (axis,) = panels(placement_plots.information(gains))
    npt.assert_array_equal(line(axis, "information"), [PLACES["s1"], gains["information_gain"]])
    npt.assert_allclose(np.ravel(line(axis, "best")), [0.3, 1.0])
    band = axis.collections[0].get_paths()[0].vertices[:, 1]
    assert band.max() == pytest.approx(
        float((gains["information_gain"] + 2 * gains["information_gain_se"]).max())
    )
    assert {"± 2 standard errors", "information", "best"} <= set(labels(axis.figure))


def test_three_transducers_have_a_panel_for_each_pair_best_over_the_third():
    gains = hill("s1", "a1", "s2")
    axes = panels(placement_plots.information(gains))
    pairs = [("s1", "a1"), ("s1", "s2"), ("a1", "s2")]
    assert len(axes) == 3
    for axis, (across, up) in zip(axes, pairs, strict=True):
        assert axis.get_xlabel() == f"position of {across} [m]"
        assert axis.get_ylabel() == f"position of {up} [m]"
        (other,) = {"s1", "a1", "s2"} - {across, up}
        best = gains["information_gain"].max(other).transpose(up, across)
        npt.assert_array_equal(axis.collections[0].get_array(), best)
        npt.assert_allclose(np.ravel(line(axis, "best")), [TOP[across], TOP[up]])


@pytest.mark.parametrize(("names", "best"), [(("s1",), [4]), (("s1", "a1"), [4, 5])])
def test_places_in_space_are_seen_where_they_differ(names, best):
    gains = in_space(*names)
    axes = panels(placement_plots.information(gains))
    assert len(axes) == len(names)
    for axis, name, number in zip(axes, names, best, strict=True):
        assert (axis.get_xlabel(), axis.get_ylabel()) == (f"x of {name} [m]", f"z of {name} [m]")
        at = [float(gains[f"{name}.{coordinate}"][number]) for coordinate in "xz"]
        npt.assert_allclose(np.ravel(line(axis, "best")), at)
        others = [other for other in names if other != name]
        npt.assert_array_equal(
            axis.collections[0].get_array(), gains["information_gain"].max(others)
        )


@pytest.mark.parametrize("names", [("s1", "a1"), ("s1", "a1", "s2")])
def test_maps_of_all_tolerances_share_their_colours(names):
    result = study(*names)
    axes = panels(placement_plots.tolerances(result))
    assert [axis.get_title() for axis in axes] == [
        "1 times the tolerance",
        "0.5 times the tolerance",
        "0.25 times the tolerance",
    ]
    limits = {axis.collections[0].get_clim() for axis in axes}
    assert limits == {
        (float(result.maps["information_gain"].min()), float(result.maps["information_gain"].max()))
    }
    for number, axis in enumerate(axes):
        kl = result.maps["information_gain"].isel({FACTOR: number})
        kl = kl.max("s2") if len(names) > 2 else kl
        npt.assert_array_equal(axis.collections[0].get_array(), kl.T)
    levels = {tuple(axis.collections[1].levels) for axis in axes}
    assert len(levels) == 1 and len(*levels) == 6


def test_curves_of_all_tolerances_share_their_axis():
    result = study("s1")
    limits = {axis.get_ylim() for axis in panels(placement_plots.tolerances(result))}
    ((low, high),) = limits
    assert low == 0 and high > 1.6


def test_the_best_placements_are_shown_by_rank():
    axis = placement_plots.placements(placement(30)).axes[0]
    assert axis.get_xlabel() == "rank among 30 placements that were tried"
    assert axis.get_ylabel() == KL
    npt.assert_allclose(np.ravel(line(axis, "best")), [1, 2.0])
    points, _, (errors,) = axis.containers[0]
    npt.assert_array_equal(points.get_xdata(), np.arange(1, 21))
    npt.assert_array_equal(
        np.asarray(points.get_ydata(), float), placement(30).table["information_gain"][:20]
    )
    npt.assert_allclose(errors.get_segments()[0][:, 1], [1.96, 2.04])


def test_a_single_placement_has_the_rank_one():
    axis = drawn(placement_plots.placements(placement(1))).axes[0]
    assert [tick for tick in axis.get_xticks() if 0.5 <= tick <= 1.5] == [1]


def test_a_map_of_one_column_is_drawn():
    drawn(placement_plots.information(hill("s1", "a1").isel(a1=[2])))


def test_a_flat_map_is_drawn():
    flat = hill("s1", "a1", height=0.0, error=0.0)
    drawn(placement_plots.information(flat))
