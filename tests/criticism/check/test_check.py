"""Check of a fitted model: correct models pass at the stated level, and wrong ones are located."""

from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from scipy import stats

import bayes_placement as bp
from bayes_placement.criticism.check._residuals import residuals
from bayes_placement.criticism.check._statistics import Statistics
from bayes_placement.criticism.check.check import check, verdict
from bayes_placement.criticism.check.misfit import Verdict
from bayes_placement.criticism.noise_needed import NoiseNeeded

SEEDS = range(100)


def bump(frequency=(10, 500), lines=60, at=300.0, width=15.0):
    places = np.linspace(*frequency, lines)
    return np.exp(-0.5 * ((places - at) / width) ** 2)


def statistics(tree, sensor=slice(None)):
    data = residuals(tree)
    group = np.zeros(data.residual.shape[:3], bool)
    group[sensor] = True
    return Statistics(data).of(group)


SETTINGS = {
    "usual": {"shape": (2, 2, 2, 40), "draws": 100},
    "vague and many": {"shape": (2, 2, 2, 16), "unknowns": 10, "prior": 0.1},
    "one channel of logarithms": {"shape": (1, 1, 1, 40), "unknowns": 4},
}


SHORT, *LONG = SETTINGS


@pytest.fixture(
    scope="module", params=[SHORT, *(pytest.param(name, marks=pytest.mark.long) for name in LONG)]
)
def samples(request, correct_model):
    """Statistics of many correct models, of all their data and of the first sensor alone."""
    trees = [correct_model(seed, **SETTINGS[request.param]) for seed in SEEDS]
    rows = [(statistics(tree), statistics(tree, 0)) for tree in trees]
    return [xr.Dataset({n: ("seed", [r[i][n] for r in rows]) for n in rows[0][0]}) for i in (0, 1)]


@pytest.mark.parametrize("group", [0, 1], ids=["all data", "one sensor"])
@pytest.mark.parametrize("name", ["p_value", "whiteness"])
def test_p_values_of_correct_models_are_uniform(samples, name, group):
    values = samples[group][name].values
    assert stats.kstest(values, "uniform").pvalue > 1e-3
    assert np.mean(values < 0.05) < 0.05 + 4 * np.sqrt(0.05 * 0.95 / len(SEEDS))


@pytest.mark.parametrize("group", [0, 1], ids=["all data", "one sensor"])
def test_chi2_of_correct_models_has_the_expected_mean_and_spread(samples, group):
    sampled = samples[group]
    excess = (sampled["chi2_per_datum"] - sampled["expected"]) / sampled["spread"]
    assert abs(float(excess.mean())) < 5 / np.sqrt(len(SEEDS))
    # A variance of n normal numbers has a relative error of sqrt(2 / n).
    assert abs(float(excess.var()) - 1) < 5 * np.sqrt(2 / len(SEEDS))


def test_predictive_p_values_of_correct_models_are_not_extreme(samples):
    values = samples[0]["predictive"].values
    assert np.mean(values < 0.05) < 0.15
    assert abs(values.mean() - 0.5) < 5 / np.sqrt(12 * len(SEEDS))


def test_predictive_chi2_is_in_deviations_of_each_datum(correct_model):
    data = residuals(correct_model(1))
    measured, deviation = np.zeros_like(data.measured), np.ones_like(data.measured)
    replicates = np.zeros_like(data.draws)
    measured[0, 0, 0, 0], replicates[:, 0, 0, 1, 0], deviation[0, 0, 1, 0] = 2.0, 7.0, 10.0
    data = replace(
        data,
        measured=measured,
        draws=np.zeros_like(data.draws),
        replicates=replicates,
        deviation=deviation,
    )
    # 7 / 10 of a deviation is less than 2, in all draws.
    assert Statistics(data).predictive(np.ones(measured.shape[:3], bool)) == 0.0


def test_the_fitted_parameters_are_counted_as_least_squares_does(correct_model):
    # A flat prior: p parameters of 2 N numbers, by the law of least squares.
    row = statistics(correct_model(0, unknowns=8, prior=1e3, draws=4000))
    numbers = 3 * 2 * 2 * 60
    assert row["data"] == numbers / 2
    assert row["expected"] == pytest.approx(1 - 8 / numbers, abs=5 * np.sqrt(16 / 4000) / numbers)
    assert row["spread"] == pytest.approx(np.sqrt(2 * (numbers - 8)) / numbers, rel=1e-3)


def test_parameters_that_the_data_do_not_move_are_not_counted(correct_model):
    row = statistics(correct_model(0, unknowns=8, prior=1e-4))
    assert row["expected"] == pytest.approx(1, abs=1e-4)


def test_two_answers_that_both_misfit_are_no_fit(correct_model):
    # A posterior of two modes far apart has a large spread; it must not excuse the misfit.
    tree = correct_model(0, missing=3.0)
    response = tree["posterior_predictive"]["response"]
    response[:, ::2] += 5.0
    response[:, 1::2] -= 5.0
    assert statistics(tree)["expected"] > 0.98


@pytest.fixture(scope="module")
def wrong(correct_model):
    """A model that misses 5 noise deviations around 300 Hz, on the second sensor alone."""
    missing = np.zeros((3, 1, 1, 60))
    missing[1, 0, 0] = 5 * bump()
    return check(correct_model(1, missing=missing))


@pytest.fixture(scope="module")
def right(correct_model):
    return check(correct_model(2))


@pytest.fixture(scope="module")
def unknown_noise(correct_model):
    """The same of a model whose noise level is not known, with two force levels."""
    missing = np.zeros((3, 1, 1, 120))
    missing[1, 0, 0, :60] = 5 * bump(width=25)
    return check(correct_model(3, missing=missing, known=False, levels=2))


def test_a_correct_model_passes_and_a_wrong_one_does_not(right, wrong):
    assert right.passed
    assert right.words() == [right.words()[0]]
    assert right.words()[0].startswith("The model explains the data: reduced chi-square is ")
    assert not wrong.passed
    assert wrong.p_value < 1e-8


def test_where_it_fails_is_named(wrong):
    assert wrong.worst("sensor")["sensor"] == "s2"
    band = wrong.worst("band")
    assert band["low"] <= 300 <= band["high"]
    assert wrong.worst("channel")["sensor"] == "s2"
    words = wrong.words()
    assert words[0].startswith("The model fails: reduced chi-square is ")
    assert any(line.startswith("1 of 3 sensors fails, s2: ") for line in words)
    assert any("smooth discrepancy" in line and "sensor s2" in line for line in words)


def test_groups_partition_the_data(wrong):
    for table in wrong.groups.values():
        assert table["data"].sum() == wrong.overall["data"]
        mean = (table["chi2_per_datum"] * table["data"]).sum() / table["data"].sum()
        assert float(mean) == pytest.approx(float(wrong.overall["chi2_per_datum"]))


def test_chi2_is_the_mean_over_complex_data(correct_model):
    tree = correct_model(1)
    observed = tree["observed_data"]["measured"] - tree["posterior_predictive"]["response"].mean(
        ("chain", "draw")
    )
    variance = 2 * tree["observed_data"]["deviation"].isel(part=0) ** 2
    expected = ((observed**2).sum("part") / variance).mean()
    assert statistics(tree)["chi2_per_datum"] == pytest.approx(float(expected))


def test_without_a_noise_level_whiteness_decides(unknown_noise, correct_model):
    assert not unknown_noise.passed
    assert np.isnan(unknown_noise.overall["chi2_per_datum"])
    assert unknown_noise.worst("sensor")["sensor"] == "s2"
    assert "The noise level is not known" in unknown_noise.words()[0]
    assert check(correct_model(4, known=False)).passed


def test_force_levels_are_told_apart(unknown_noise):
    table = unknown_noise.groups["force_level"]
    np.testing.assert_array_equal(table["force_level"], [2.0, 4.0])
    assert table["corrected"][0] < 1e-6 < 0.01 < table["corrected"][1]
    assert any(
        line.startswith("1 of 2 force levels fails, 2 N: ") for line in unknown_noise.words()
    )
    assert list(unknown_noise.discrepancy["force_level"]) == [2.0, 4.0]


def test_lines_of_two_force_levels_are_no_neighbours(correct_model):
    # Each level ends far off, with opposite sign to the start of the next: no trend within one.
    data = residuals(correct_model(0, levels=2))
    pairs = Statistics(data)._pairs(1)[1]
    assert np.all(pairs[:, :, 59] == 0)
    assert np.all(pairs[:, :, [58, 60]] != 0)


def test_lines_in_any_order_give_the_same(correct_model):
    tree = correct_model(5, missing=bump())
    order = np.random.default_rng(0).permutation(60)
    shuffled = xr.DataTree.from_dict(
        {
            path: group.to_dataset().isel(frequency=order, missing_dims="ignore")
            for path, group in tree.children.items()
        }
    )
    first, second = statistics(tree), statistics(shuffled)
    assert first == pytest.approx(second, nan_ok=True)


def test_what_was_not_measured_does_not_count(correct_model):
    tree = correct_model(6)
    complete = check(tree)
    tree["observed_data"]["measured"][0, 0, :, :30] = np.nan
    tree["posterior_predictive"]["response"][..., 0, 0, :, :30] += 1e3
    gap = check(tree)
    assert float(gap.overall["data"]) == float(complete.overall["data"]) - 30
    assert gap.passed
    assert np.isnan(gap.response["residual"][0, 0, :30]).all()
    np.testing.assert_allclose(gap.response["residual"][1], complete.response["residual"][1])


def test_few_lines_of_each_channel_are_judged_together(correct_model):
    """No channel has pairs of neighbouring lines enough, all of them have."""
    assert 0 < float(check(correct_model(3, shape=(3, 2, 2, 8))).overall["whiteness"]) <= 1


def test_whiteness_sees_a_smooth_misfit_below_the_noise(correct_model):
    # Less than a noise deviation over a third of the band, which chi2 hardly sees.
    rows = [statistics(correct_model(seed, missing=0.8 * bump(width=50))) for seed in range(20)]
    assert sum(row["whiteness"] < 0.01 for row in rows) >= 16
    assert sum(row["p_value"] < 0.01 for row in rows) < 10


def test_noise_that_is_stated_too_large_is_said(correct_model):
    tree = correct_model(7)
    tree["observed_data"]["deviation"] *= 1.5
    misfit = check(tree)
    assert misfit.passed
    assert misfit.words()[0].endswith("the stated noise is too large.")


def test_a_misfit_that_scatters_fails_by_the_scatter_of_the_record(correct_model):
    tree = correct_model(4, known=False)
    assert check(tree).passed
    observed = tree["observed_data"].to_dataset()
    constants = xr.Dataset({"scatter": xr.full_like(observed["measured"], 1e-12)})
    misfit = check(tree.assign({"constant_data": xr.DataTree(constants)}))
    assert not misfit.passed
    assert misfit.overall["over_scatter"] > 10
    assert misfit.verdict().startswith(
        "The model fails: its noise exceeds the scatter of neighbouring lines (p < "
    )


def test_lines_that_tell_no_noise_are_no_explanation():
    overall, noise = {"whiteness": 0.5}, NoiseNeeded(0.1, 0.97, 0.6, is_misfit_alike=True)
    passed = Verdict(overall, 0.01, False, noise, False)
    assert passed.passed
    assert passed.sentence().startswith("Whether the model explains the data cannot be told (p = ")
    assert "needs noise of 10 % of the amplitude" in passed.sentence()
    assert passed.sentence().endswith("take more lines (without --lines), or state the noise.")
    failed = passed._replace(overall={"whiteness": 1e-6})
    assert failed.sentence().startswith("The model fails: residuals of neighbouring lines are cor")
    assert "more lines" not in failed.sentence()


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"missing": 3 * bump()},
        {"known": False},
        {"known": False, "missing": 3 * bump()},
        {"shape": (1, 1, 1, 6), "unknowns": 2, "known": False, "noise": False},
    ],
    ids=["right", "wrong", "unknown noise", "wrong, unknown noise", "too few lines"],
)
def test_the_verdict_alone_is_that_of_the_check(correct_model, settings):
    tree = correct_model(4, **settings)
    misfit, alone = check(tree), verdict(tree)
    assert alone.sentence() == misfit.verdict()
    assert alone.passed == misfit.passed
    assert alone.failed == (misfit.p_value < misfit.level)
    assert alone.failed == ("missing" in settings)


def test_too_few_lines_without_noise_cannot_be_judged(correct_model):
    misfit = check(correct_model(8, shape=(1, 1, 1, 6), unknowns=2, known=False, noise=False))
    assert not misfit.passed
    assert "cannot be decided" in misfit.words()[0]
    assert "too few lines" in misfit.words()[0]
    assert np.isnan(misfit.overall["predictive"])


def test_as_many_unknowns_as_data_cannot_be_judged(correct_model):
    tree = correct_model(9, shape=(1, 1, 2, 2), unknowns=4, prior=1e3)
    tree["posterior_predictive"]["response"] *= 1.001  # as sampling error may leave it
    misfit = check(tree)
    assert not misfit.passed
    assert "as many unknowns as data" in misfit.words()[0]


def test_a_smooth_misfit_below_the_noise_is_said(correct_model):
    misfit = check(correct_model(7, missing=0.7 * bump(width=50)))
    assert misfit.passed
    assert misfit.words()[1].startswith(
        "However, residuals of neighbouring lines are correlated (p"
    )


def piled(at):
    random = np.random.default_rng(0)
    return random.beta(*at, size=(1, 500))


@pytest.mark.parametrize(
    ("at", "side"),
    [
        ((1, 40), "lower"),
        ((40, 1), "upper"),
        ((5, 5), None),
        ((4925, 75), None),  # 0.985: within the edge, and clear of the bound
    ],
)
def test_what_is_piled_up_at_the_edge_of_its_prior_is_named(correct_model, at, side):
    tree = correct_model(10)
    tree["posterior"] = xr.DataTree(
        xr.Dataset({"sensor.s1.position": (("chain", "draw"), piled(at))})
    )
    prior = np.random.default_rng(1).uniform(size=(1, 1000))
    tree["prior"] = xr.DataTree(xr.Dataset({"sensor.s1.position": (("chain", "draw"), prior)}))
    misfit = check(tree)
    named = [line for line in misfit.words() if "piled up" in line]
    assert len(named) == (side is not None)
    if side is not None:
        # 1 - 0.975**40: the closed form of the beta law, its quantile from 1000 draws of a prior.
        row = misfit.edges.sel(unknown="sensor.s1.position", side=side)
        assert float(row["share"]) == pytest.approx(1 - 0.975**40, abs=0.12)
        assert float(row["prior_share"]) == pytest.approx(0.025, abs=0.001)
        assert named[0].startswith(f"sensor.s1.position is piled up at the {side} edge")


def test_the_table_has_a_row_for_all_data_and_each_group(wrong):
    table = wrong.table()
    assert list(table.index[:6]) == [
        "all data",
        "sensor s1",
        "sensor s2",
        "sensor s3",
        "actuator a1",
        "actuator a2",
    ]
    assert len(table) == 6 + 8
    text = str(wrong)
    assert "reduced chi-square" in text
    assert f"- {wrong.words()[0]}" in text


def test_correlations_lie_in_their_band(wrong):
    correlation = wrong.correlation
    assert np.all(correlation["frac_low"] <= correlation["frac"])
    assert np.all(correlation["frac"] <= correlation["frac_high"])
    assert correlation["fdac"].dims == ("measured_line", "computed_line")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"level": 1.5}, "level=1.5 was given; a probability between 0 and 1"),
        ({"bands": 0}, "bands=0 was given; at least 1 is needed"),
    ],
)
def test_settings_out_of_range_are_refused(correct_model, change, message):
    with pytest.raises(ValueError, match=message):
        check(correct_model(0), **change)


def test_what_is_no_result_of_an_inference_is_refused(correct_model):
    tree = correct_model(0)
    del tree["observed_data"]
    with pytest.raises(ValueError, match="without the group observed_data was given"):
        check(tree)
    single = correct_model(0)
    predicted = single["posterior_predictive"].to_dataset().isel(draw=[0])
    single["posterior_predictive"] = xr.DataTree(predicted)
    with pytest.raises(ValueError, match="holds one draw of the response; at least two"):
        check(single)


ENGINE = bp.engines.MAP(starts=2, draws=60)


def simulated_bar(stiffer=1.0):
    """A bar with one unknown damping ratio, and its measurement with noise, perhaps of another."""
    lines = np.linspace(20, 430, 30)
    places = {
        "sensors": [bp.Sensor("s1", at=0.25), bp.Sensor("s2", at=0.4)],
        "actuators": [bp.Actuator("a1", at=0.3)],
    }

    def experiment(modulus):
        modes = bp.beams.bar(6, length=1.0, area=1e-3, youngs_modulus=modulus, density=9000.0)
        return bp.Experiment(
            bp.Structure(modes, damping=bp.damping.Modal([dist.Uniform(0.02, 0.06), 0.04])),
            **places,
            frequency=lines,
            observe=bp.observe.Complex("velocity"),
            noise=bp.noise.FromCoherence(),
        )

    clean = experiment(1e9 * stiffer).nominal_measurement()
    random = np.random.default_rng(0)
    frf = np.asarray(clean.frf)
    coherence = np.full(frf.shape, 1 / (1 + 10 * 0.02**2))
    noise = 0.02 * np.abs(frf) / np.sqrt(2)
    noisy = frf + noise * (random.normal(size=frf.shape) + 1j * random.normal(size=frf.shape))
    measurement = bp.Measurement.from_arrays(
        noisy,
        lines,
        sensors=clean.sensors,
        actuators=clean.actuators,
        quantity="mobility",
        coherence=coherence,
        averages=10,
    )
    return bp.infer(experiment(1e9), measurement, engine=ENGINE, key=0)


@pytest.mark.parametrize("stiffer", [1.0, 1.02])
def test_an_inference_is_checked_from_end_to_end(stiffer):
    misfit = check(simulated_bar(stiffer))
    assert misfit.noise_known
    assert misfit.passed == (stiffer == 1.0)
    assert float(misfit.overall["data"]) == 60
    assert float(misfit.overall["expected"]) == pytest.approx(1 - 1 / 120, rel=0.005)


def test_a_misfit_is_short_in_a_prompt_and_a_table_in_a_notebook(correct_model):
    misfit = check(correct_model(0))
    assert repr(misfit).startswith("Misfit: The model explains the data")
    assert len(repr(misfit)) < 250
    assert "<table" in misfit._repr_html_()
