"""Figures of a posterior: values, units and legends."""

import functools
import io
import itertools

import numpy as np
import pytest
import xarray as xr

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.inference.bands import phase_band
from bayes_placement.plots import _marginal_panels

methods = bp.plots.posterior.methods
FREQUENCY = np.array([10.0, 20.0, 40.0, 80.0])
RNG = np.random.default_rng(3)
RATIO, POSITION = "structure.damping.ratio", "sensor.s1.position"


NOWHERE = {"role": "parameter", "owner": "damping", "field": "ratio", "component": ""}
ON_A_LINE = {"role": "placement", "owner": "sensor s1", "field": "position", "component": ""}


def draws(values, unit="1", **overrides):
    attributes = NOWHERE | {"units": unit} | overrides
    return ("chain", "draw"), np.asarray(values).reshape(1, -1), attributes


def outputs(values, leading=("chain", "draw"), parts=False, sensors=2):
    part = ["part"] if parts else []
    unit = "velocity per force [(m/s)/N]"
    return xr.Dataset(
        {
            "measured": (
                (*leading, "sensor", "actuator", *part, "frequency"),
                values,
                {"units": unit if parts else f"log10 of {unit}"},
            )
        },
        coords={
            "sensor": [f"s{n + 1}+x" for n in range(sensors)],
            "actuator": ["a1+x"],
            "frequency": ("frequency", FREQUENCY, {"units": "Hz"}),
        },
    )


def result(ratio=None, place=None, parts=False):
    """Result of an inference of a damping ratio and a position, with two sensors."""
    shape = (2, 1, 2, 4) if parts else (2, 1, 4)
    ratio = RNG.normal(0.04, 0.004, 500) if ratio is None else ratio
    place = RNG.normal(0.3, 0.01, 500) if place is None else place
    prior = {
        RATIO: draws(RNG.uniform(0.02, 0.06, 400)),
        POSITION: draws(RNG.uniform(0, 1, 400), "m", **ON_A_LINE),
    }
    observed = RNG.normal(size=shape)
    return xr.DataTree.from_dict(
        {
            "/posterior": xr.Dataset(
                {RATIO: draws(ratio), POSITION: draws(place, "m", **ON_A_LINE)}
            ),
            "/prior": xr.Dataset(prior),
            "/posterior_predictive": outputs(
                observed + RNG.normal(size=(1, 200, *shape)), parts=parts
            ),
            "/observed_data": outputs(observed, (), parts=parts),
            "/estimates": xr.Dataset(),
        }
    )


SPATIAL = {
    "sensor.s1.position.x": ("m", "sensor s1", "position", "x"),
    "sensor.s1.position.y": ("m", "sensor s1", "position", "y"),
    "sensor.s1.angles.1": ("rad", "sensor s1", "angles", "1"),
    "sensor.s1.angles.3": ("rad", "sensor s1", "angles", "3"),
    "actuator.a1.position.along": ("m", "actuator a1", "position", "along"),
}


def result_in_space():
    """Result of an inference of places in space and of angles."""

    def group(count):
        return xr.Dataset(
            {
                name: draws(
                    RNG.uniform(size=count),
                    unit,
                    role="placement",
                    owner=owner,
                    field=field,
                    component=component,
                )
                for name, (unit, owner, field, component) in SPATIAL.items()
            }
        )

    return xr.DataTree.from_dict(
        {"/posterior": group(500), "/prior": group(400), "/estimates": xr.Dataset()}
    )


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()] if figure.legends else []


def line(axis, label):
    (curve,) = [line for line in axis.lines if line.get_label() == label]
    return curve.get_ydata()


def steps(axis, label):
    (histogram,) = [patch for patch in axis.patches if patch.get_label() == label]
    return histogram.get_data()


def drawn(figure):
    """Draw a figure; a warning of the layout or of a missing value is an error in this suite."""
    figure.savefig(io.BytesIO())
    return figure


FIGURES = {
    "measured_against_band": lambda: bp.plots.posterior.measured_against_band(result()),
    "measured_against_band of complex outputs": lambda: bp.plots.posterior.measured_against_band(
        result(parts=True)
    ),
    "parameters": lambda: bp.plots.posterior.parameters(result(), truth={RATIO: 0.04}),
    "placement": lambda: bp.plots.posterior.placement(result(), truth={POSITION: 0.3}),
    "placement in space": lambda: bp.plots.posterior.placement(result_in_space()),
    "pair": lambda: bp.plots.posterior.pair(result(), first=RATIO, second=POSITION),
    "intervals": lambda: bp.plots.posterior.intervals(result(), truth={RATIO: 0.04}),
    "methods": lambda: bp.plots.posterior.methods({"one": result(), "two": result()}),
}


@functools.cache
def figure_of(name):
    return drawn(FIGURES[name]())


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_bears_a_name_and_a_unit(name):
    for axis in figure_of(name).axes:
        is_phase = axis.get_ylabel().startswith("phase")  # it belongs to the panel above
        has_unit_in_label = not axis.get_xlabel() and axis.get_ylabel().endswith(("[%]", "[mm]"))
        is_above = axis.get_ylabel().startswith("magnitude")  # the frequency stands below
        assert axis.get_xlabel().endswith("]") is not (is_phase or has_unit_in_label or is_above)
        assert any(word in axis.get_ylabel() for word in ("[", "density", "ratio"))


@pytest.mark.parametrize("name", FIGURES)
def test_one_legend_stands_above_the_panels(name):
    figure = figure_of(name)
    (legend,) = figure.legends
    bottom = legend.get_window_extent().y0
    assert all(axis.get_tightbbox().y1 <= bottom for axis in figure.axes)
    assert len(labels(figure)) == len(set(labels(figure))) >= 2


def test_each_transducer_in_space_has_a_row_and_angles_say_about_what():
    figure = drawn(bp.plots.posterior.placement(result_in_space()))
    positions = {axis.get_xlabel(): axis.get_subplotspec() for axis in figure.axes}
    assert {
        label.replace(".\n", ".").replace("\n", " "): (cell.rowspan.start, cell.colspan.start)
        for label, cell in positions.items()
    } == {
        "sensor.s1.position.x [mm]": (0, 0),
        "sensor.s1.position.y [mm]": (0, 1),
        "sensor.s1.angles.1 about x [°]": (0, 2),
        "sensor.s1.angles.3 about z [°]": (0, 3),
        "actuator.a1.position.along [mm]": (1, 0),
    }
    assert figure.axes[2].get_ylabel() == "probability density [1/°]"


def test_measured_points_are_drawn_on_the_band_and_less_its_mean():
    tree = result()
    tree["observed_data"]["measured"][1, 0, 2] = np.nan  # a gap is left out
    figure = bp.plots.posterior.measured_against_band(tree)
    assert len(figure.axes) == 4
    for sensor in range(2):
        measured = tree["observed_data"]["measured"][sensor, 0]
        mean = tree["posterior_predictive"]["measured"][..., sensor, 0, :].mean(("chain", "draw"))
        upper, lower = figure.axes[2 * sensor : 2 * sensor + 2]
        np.testing.assert_allclose(line(upper, "measured"), 20 * measured)
        np.testing.assert_allclose(line(upper, "posterior predictive, mean"), 20 * mean)
        np.testing.assert_allclose(line(lower, "measured"), 20 * (measured - mean))
        centre = line(lower, "posterior predictive, mean")
        np.testing.assert_allclose(centre, np.zeros(FREQUENCY.size), atol=1e-12)
        assert f"s{sensor + 1}+x" in upper.get_title()
    drawn(figure)


def test_the_band_holds_nine_draws_in_ten():
    tree = result()
    axis = bp.plots.posterior.measured_against_band(tree).axes[0]
    corners = axis.collections[0].get_paths()[0].vertices
    predicted = tree["posterior_predictive"]["measured"][0, :, 0, 0]
    at_first = corners[corners[:, 0] == FREQUENCY[0], 1]
    expected = 20 * predicted[:, 0].quantile([0.05, 0.95])
    np.testing.assert_allclose([at_first.min(), at_first.max()], expected)


def test_complex_outputs_are_drawn_in_decibels_and_by_their_phase():
    tree = result(parts=True)
    upper, phase, _ = bp.plots.posterior.measured_against_band(tree).axes[:3]
    real, imaginary = tree["observed_data"]["measured"].values[0, 0]
    np.testing.assert_allclose(line(upper, "measured"), 20 * np.log10(np.hypot(real, imaginary)))
    assert upper.get_ylabel() == "magnitude\n[dB re 1 (m/s)/N]"
    measured = phase.lines[-1].get_ydata()
    np.testing.assert_allclose(measured, np.rad2deg(np.arctan2(imaginary, real)))
    assert phase.get_ylabel() == "phase [°]"


def test_the_band_of_a_phase_is_narrow_also_where_the_phase_jumps():
    """Draws about half a turn lie at both ends of the axis; their mean is not zero."""
    turned = np.deg2rad(180.0 + 5.0 * RNG.normal(size=(1, 2000, 1, 1, 4)))
    values = np.stack([np.cos(turned), np.sin(turned)], axis=-2)
    tree = xr.DataTree.from_dict({"/posterior_predictive": outputs(values, parts=True, sensors=1)})
    band = phase_band(tree)
    np.testing.assert_allclose(np.abs(band["mean"]), 180.0, atol=1.0)
    np.testing.assert_allclose(band["high"] - band["low"], 2 * 1.645 * 5.0, rtol=0.15)
    assert phase_band(result()) is None


def simulated(sensors=2, parts=False):
    """Simulated outputs of some sensors, and a reference of the same shape."""
    values = RNG.normal(size=(1, 50, sensors, 1, *([2] if parts else []), 4))
    dataset = outputs(values, parts=parts, sensors=sensors).rename(measured="response")
    reference = RNG.normal(size=values.shape[2:])
    return xr.DataTree.from_dict({"/prior_predictive": dataset}), reference


@pytest.mark.parametrize("parts", [False, True])
def test_the_nominal_response_is_drawn_along_with_the_simulated_band(parts):
    tree, reference = simulated(parts=parts)
    figure = bp.plots.posterior.response_band(tree, reference=reference)
    expected = np.log10(np.hypot(*reference[1, 0])) if parts else reference[1, 0]
    np.testing.assert_allclose(line(figure.axes[1], "as recorded"), expected)
    values = tree["prior_predictive"]["response"].values[0, :, 1, 0]
    drawn_by = np.log10(np.hypot(values[:, 0], values[:, 1])) if parts else values
    np.testing.assert_allclose(line(figure.axes[1], "random draws, mean"), drawn_by.mean(axis=0))
    assert labels(drawn(figure)) == [
        "random draws, 90 % band",
        "random draws, mean",
        "as recorded",
    ]


def test_outputs_of_simulate_are_what_the_band_is_drawn_of():
    experiment = bp.Experiment(
        bp.Structure(
            bp.beams.bar(1, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0),
            damping=bp.damping.Modal([0.04]),
        ),
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=FREQUENCY,
        observe=bp.observe.Complex("velocity"),
        noise=None,
    )
    reference = compiled(bp.Experiment.predict)(experiment.nominal())
    figure = bp.plots.posterior.response_band(bp.simulate(experiment, draws=5), reference=reference)
    frf = np.asarray(compiled(bp.Experiment.frf)(experiment.nominal()))[0, 0]
    np.testing.assert_allclose(line(figure.axes[0], "as recorded"), np.log10(np.abs(frf)))


def test_many_channels_have_a_panel_each():
    figure = bp.plots.posterior.response_band(simulated(sensors=6)[0])
    assert len(drawn(figure).axes) == 6
    assert len(labels(figure)) == 2


def test_each_force_level_has_panels_of_its_own():
    tree = result()
    for group in ("posterior_predictive", "observed_data"):
        first = tree[group].to_dataset()
        second = first.isel(frequency=slice(None, None, -1)).assign_coords(
            frequency=first["frequency"]
        )
        runs = [run.assign_coords(force_level=n) for run, n in ((first, 0.5), (second, 2.0))]
        tree[group] = xr.DataTree(xr.concat(runs, "force_level"))
    figure = bp.plots.posterior.measured_against_band(tree)
    pairs = [f"sensor s{n}+x, actuator a1+x" for n in (1, 2)]
    upper = [*figure.axes[:2], *figure.axes[4:6]]  # the others belong to those above
    titles = [f"{pair}, {level} N" for pair in pairs for level in ("0.5", "2")]
    assert [axis.get_title() for axis in upper] == titles
    measured = tree["observed_data"]["measured"].sel(force_level=2.0)[1, 0]
    np.testing.assert_allclose(line(figure.axes[5], "measured"), 20 * measured)


@pytest.mark.parametrize("group", ["prior", "posterior"])
def test_histograms_hold_all_draws(group):
    density, edges, _ = steps(bp.plots.posterior.parameters(result()).axes[0], group)
    assert np.sum(density * np.diff(edges)) == pytest.approx(1.0)


def test_nodes_of_a_grid_leave_no_gaps():
    node = 0.04 + 0.004 * np.linspace(-3, 3, 15) ** 3 / 9
    share = np.exp(-0.5 * ((node - 0.04) / 0.004) ** 2) * np.gradient(node)
    ratio = np.repeat(node, np.rint(1000 * share / share.sum()).astype(int))
    tree = result(ratio, place=np.full(ratio.size, 0.3))
    density, _, _ = steps(bp.plots.posterior.parameters(tree).axes[0], "posterior")
    assert density.min() > 0
    # The nodes crowd in the middle; the density must not show it.
    middle = 100 * np.unique(ratio)  # in percent, as it is told
    exact = np.exp(-0.5 * ((middle - 4.0) / 0.4) ** 2) / (0.4 * np.sqrt(2 * np.pi))
    np.testing.assert_allclose(density, exact, atol=0.2 * exact.max())


def test_a_posterior_of_a_single_value_is_drawn():
    drawn(bp.plots.posterior.placement(result(place=np.full(500, 0.3))))


def test_a_posterior_far_narrower_than_the_prior_is_shown_enlarged():
    wide, narrow = RNG.uniform(0.02, 0.06, 500), RNG.uniform(0.0400, 0.0402, 500)
    first, second = (bp.plots.posterior.parameters(result(ratio=r)).axes[0] for r in (wide, narrow))
    assert first.get_xlim()[0] < 2.1
    assert 3.98 < second.get_xlim()[0] < second.get_xlim()[1] < 4.04


def test_an_axis_of_an_unknown_has_at_least_three_numbers():
    for ratio in (RNG.uniform(0.02, 0.06, 500), RNG.uniform(0.02605, 0.02658, 500)):
        axis = drawn(bp.plots.posterior.parameters(result(ratio=ratio))).axes[0]
        low, high = axis.get_xlim()
        assert sum(low <= tick <= high for tick in axis.get_xticks()) >= 3


def test_unknowns_are_told_in_the_units_of_people_without_an_offset():
    tree = result()
    modulus = {"field": "youngs_modulus", "units": "Pa", "role": "parameter", "owner": "modes"}
    for group, spread in (("prior", 1e10), ("posterior", 1e6)):
        draws_of = np.random.default_rng(1).normal(2.1e11, spread, (1, 400))
        fresh = {"structure.modes.youngs_modulus": (("chain", "other"), draws_of, modulus)}
        tree[group] = xr.DataTree(tree[group].to_dataset().assign(fresh))
    figure = drawn(bp.plots.posterior.parameters(tree))
    labels_of = [axis.get_xlabel() for axis in figure.axes]
    assert labels_of == [f"{RATIO} [%]", "structure.modes.youngs_modulus [GPa]"]
    axis = figure.axes[1]
    assert axis.get_ylabel() == "probability density [1/GPa]"
    assert 209 < axis.get_xlim()[0] < axis.get_xlim()[1] < 211
    assert not axis.xaxis.get_major_formatter().get_offset()


def test_intervals_stand_on_those_of_the_priors_each_on_an_axis_of_its_own():
    tree = result()
    ratio, place = drawn(bp.plots.posterior.intervals(tree, truth={POSITION: 0.31})).axes
    assert [axis.get_ylabel() for axis in (ratio, place)] == [f"{RATIO} [%]", f"{POSITION} [mm]"]
    (before,) = place.patches
    ends = before.get_x(), before.get_x() + before.get_width()
    np.testing.assert_allclose(ends, 1e3 * np.percentile(tree["prior"][POSITION], [2.5, 97.5]))
    after = 1e3 * tree["posterior"][POSITION].values
    np.testing.assert_allclose(place.lines[0].get_xdata(), np.percentile(after, [2.5, 97.5]))
    np.testing.assert_allclose(place.lines[1].get_xdata(), after.mean())
    assert place.lines[2].get_xdata()[0] == pytest.approx(310.0)


def test_intervals_of_many_unknowns_stand_beside_each_other_on_a_page():
    tree = result()
    for group in ("prior", "posterior"):
        masses = RNG.normal(size=(1, 100, 30)), NOWHERE | {"units": "kg"}
        fresh = xr.Dataset({"structure.mass": (("chain", "draw", "i"), *masses)})
        tree[group] = xr.DataTree(fresh)
    figure = drawn(bp.plots.posterior.intervals(tree))
    assert len(figure.axes) == 30 and figure.get_figheight() <= 11.0
    assert len({axis.get_subplotspec().colspan.start for axis in figure.axes}) == 2


def many_parameters(count):
    """A result of so many masses."""
    tree = result()
    for group in ("prior", "posterior"):
        masses = RNG.normal(size=(1, 100, count)), NOWHERE | {"units": "kg"}
        fresh = xr.Dataset({"structure.mass": (("chain", "draw", "i"), *masses)})
        tree[group] = xr.DataTree(fresh)
    return tree


def many_places(owners, words=("position",)):
    """A result of places of so many sensors."""
    tree = result()
    for group in ("prior", "posterior"):
        places = {
            f"sensor.s{number}.{word}": draws(
                RNG.uniform(size=100), "m", **ON_A_LINE | {"owner": f"sensor s{number}"}
            )
            for number in range(owners)
            for word in words
        }
        tree[group] = xr.DataTree(xr.Dataset(places))
    return tree


@pytest.mark.long
@pytest.mark.parametrize(
    ("draw", "count"), [(bp.plots.posterior.parameters, 61), (lambda t: methods({"one": t}), 23)]
)
def test_densities_of_many_parameters_are_no_higher_than_a_page(draw, count):
    figure = drawn(draw(many_parameters(count)))
    assert len(figure.axes) == count and figure.get_figheight() <= 11.0


def test_places_of_many_sensors_are_no_higher_than_a_page():
    figure = drawn(bp.plots.posterior.placement(many_places(19)))
    assert len(figure.axes) == 19 and figure.get_figheight() <= 11.0
    names = {axis.get_xlabel() for axis in figure.axes}
    assert names == {f"sensor.s{number}.position [mm]" for number in range(19)}


PAGES = {
    "intervals": (_marginal_panels.intervals, many_parameters(40), [18, 18, 4]),
    "parameters": (_marginal_panels.parameters, many_parameters(26), [24, 2]),
    "few parameters": (_marginal_panels.parameters, many_parameters(2), [2]),
    "placement": (_marginal_panels.placement, many_places(10), [8, 2]),
    "placement in space": (_marginal_panels.placement, many_places(5, "xyzabc"), [24, 6]),
    "methods": (
        lambda tree, truth: _marginal_panels.methods({"one": tree, "two": tree}, truth),
        many_parameters(26),
        [24, 2],
    ),
}


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    ["intervals", "placement in space"]
    + [
        pytest.param(name, marks=pytest.mark.longest)
        for name in ("parameters", "few parameters", "placement", "methods")
    ],
)
def test_a_command_draws_many_unknowns_on_pages(name):
    draw, tree, counts = PAGES[name]
    pages = draw(tree, {})
    assert [len(drawn(page).axes) for page in pages] == counts
    assert max(page.get_figheight() for page in pages) <= 11.0
    assert max(page.get_figwidth() for page in pages) <= 13.0
    assert all(page.legends for page in pages)
    for page in pages:
        names = [axis.yaxis.label.get_window_extent() for axis in page.axes]
        overlapping = [one.overlaps(other) for one, other in itertools.combinations(names, 2)]
        assert not any(overlapping)


def test_a_page_of_nothing_says_so():
    (page,) = _marginal_panels.placement(many_parameters(2), {})
    assert drawn(page).axes[0].texts[0].get_text() == "nothing of this kind is unknown"


def test_sensors_of_a_band_stand_on_pages_no_longer_than_a4():
    tree = result(parts=True)
    for group in ("posterior_predictive", "observed_data"):
        dataset = tree[group].to_dataset()
        names = [f"s{number}" for number in range(8)]
        many = xr.concat([dataset] * 4, "sensor").assign_coords(sensor=names)
        tree[group] = xr.DataTree(many)
    pages = bp.plots.posterior.measured_against_band_pages(tree)
    assert [len(drawn(page).axes) // 3 for page in pages] == [3, 3, 2]
    assert max(page.get_figheight() for page in pages) <= 11.0
    assert pages[1].axes[0].get_title() == "sensor s3, actuator a1+x"


FROM_NUMPYRO = {
    "parameters": bp.plots.posterior.parameters,
    "placement": bp.plots.posterior.placement,
    "measured_against_band": bp.plots.posterior.measured_against_band,
    "measured_against_band_pages": bp.plots.posterior.measured_against_band_pages,
    "intervals": bp.plots.posterior.intervals,
    "pair": lambda tree: bp.plots.posterior.pair(tree, first=RATIO, second=POSITION),
    "methods": lambda tree: bp.plots.posterior.methods({"result": tree}),
}


@pytest.mark.parametrize("name", FROM_NUMPYRO)
def test_a_tree_of_another_program_is_refused(name):
    values = xr.Dataset({RATIO: (("chain", "draw"), np.full((1, 10), 0.04))})
    tree = xr.DataTree.from_dict({"/posterior": values, "/observed_data": values})
    words = f'"result" holds no group "estimates".*arviz.from_numpyro.*posterior.{name}'
    with pytest.raises(ValueError, match=words):
        FROM_NUMPYRO[name](tree)


def test_true_values_are_marked_where_they_are_known():
    figure = bp.plots.posterior.placement(result(), truth={POSITION: 0.31, "another": 1.0})
    assert line(figure.axes[0], "true value") is not None
    assert figure.axes[0].lines[0].get_xdata()[0] == pytest.approx(310.0)
    assert labels(figure) == ["prior", "posterior", "true value"]
    assert labels(bp.plots.posterior.placement(result())) == ["prior", "posterior"]


def test_each_element_of_an_array_has_a_panel():
    tree = result()
    for group in ("prior", "posterior"):
        dataset = tree[group].to_dataset()
        masses = (("chain", "draw", "i"), RNG.normal(size=(1, 100, 3)), NOWHERE | {"units": "kg"})
        fresh = xr.Dataset({"structure.mass": masses, POSITION: dataset[POSITION][:, :100]})
        tree[group] = xr.DataTree(fresh)
    figure = drawn(bp.plots.posterior.parameters(tree))
    names = [f"structure.mass[{n}] [kg]" for n in range(3)]
    assert [axis.get_xlabel() for axis in figure.axes] == names


def test_each_method_is_drawn_once_by_its_name():
    figure = bp.plots.posterior.methods({"one": result(), "two": result()}, truth={RATIO: 0.04})
    assert labels(drawn(figure)) == ["one", "two", "true value"]
    lines = [patch.get_linestyle() for patch in figure.axes[0].patches]
    assert len(set(lines)) == 2  # told apart without colour


def test_a_figure_of_nothing_says_so():
    only = result()
    for group in ("prior", "posterior"):
        only[group] = xr.DataTree(only[group].to_dataset()[[POSITION]])
    for figure in (bp.plots.posterior.parameters(only), bp.plots.posterior.methods({"one": only})):
        drawn(figure)
        assert figure.axes[0].texts[0].get_text() == "nothing of this kind is unknown"


def channels_of(dataset, sensors, actuators):
    """The first channel pair of some outputs, so many times."""
    return dataset.isel(sensor=[0] * sensors, actuator=[0] * actuators).assign_coords(
        sensor=[f"s{number + 1}" for number in range(sensors)],
        actuator=[f"a{number + 1}" for number in range(actuators)],
    )


def many_channels(sensors, actuators, *groups, of):
    tree = of.copy()
    for group in groups:
        tree[group] = xr.DataTree(channels_of(tree[group].to_dataset(), sensors, actuators))
    return tree


def measured_of(sensors, actuators):
    groups = "posterior_predictive", "observed_data"
    return many_channels(sensors, actuators, *groups, of=result(parts=True))


def simulated_of(sensors, actuators):
    return many_channels(sensors, actuators, "prior_predictive", of=simulated(parts=True)[0])


OF_CHANNELS = {
    "measured_against_band": (bp.plots.posterior.measured_against_band, measured_of, 3),
    "response_band": (bp.plots.posterior.response_band, simulated_of, 1),
}


@pytest.mark.parametrize(
    ("name", "sensors", "actuators", "columns"),
    [
        ("response_band", 9, 1, 3),
        ("response_band", 3, 3, 3),
        ("measured_against_band", 4, 1, 2),
        pytest.param("measured_against_band", 9, 1, 3, marks=pytest.mark.long),
    ],
)
def test_one_figure_of_many_channels_is_no_higher_than_a_page(name, sensors, actuators, columns):
    draw, of, rows = OF_CHANNELS[name]
    figure = drawn(draw(of(sensors, actuators)))
    assert figure.get_figheight() <= 11.0
    assert len(figure.axes) == sensors * actuators * rows
    cells = {axis.get_title(): axis.get_subplotspec() for axis in figure.axes if axis.get_title()}
    assert len({cell.colspan.start for cell in cells.values()}) == columns
    first, last = cells["sensor s1, actuator a1"], cells[f"sensor s{sensors}, actuator a1"]
    assert (first.rowspan.start, first.colspan.start) == (0, 0)
    assert last.colspan.start == (columns - 1 if actuators == 1 else 0)


@pytest.mark.long
def test_pages_of_simulated_outputs_hold_all_channels():
    tree = simulated_of(9, 7)
    reference = RNG.normal(size=tree["prior_predictive"]["response"].shape[2:])
    pages = bp.plots.posterior.response_band_pages(tree, reference=reference)
    assert max(drawn(page).get_figheight() for page in pages) <= 11.0
    assert max(page.get_figwidth() for page in pages) <= 13.0
    titles = [axis.get_title() for page in pages for axis in page.axes]
    assert len(titles) == len(set(titles)) == 63
    assert titles[9] == "sensor s1, actuator a4"
    expected = np.log10(np.hypot(*reference[0, 3]))
    np.testing.assert_allclose(line(pages[1].axes[0], "as recorded"), expected)
