"""Evidence and PSIS-LOO against closed forms, for any observed quantity."""

import inspect
import warnings

import arviz_stats
import numpy as np
import numpyro.distributions as dist
import pandas as pd
import pytest
import xarray as xr
from scipy.stats import lognorm, multivariate_normal, norm

import bayes_placement as bp
from bayes_placement import observe
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.compare import ModelComparison, compare

LINES = np.linspace(20.0, 300.0, 12)
SHAPE = (2, 1, 12)
OMEGA = 2 * np.pi * LINES
DRAWS = 1000


def lay_out(observation, measured, likelihood, *, evidence=(0.0, 0.1), posterior=None):
    """Lay out an inference of some outputs, likelihoods [draw, *outputs], as `infer` does."""
    part = ("part",) if observation.parts == 2 else ()
    dims = ("sensor", "actuator", *part, "frequency")
    coordinates = {
        "sensor": [f"s{i + 1}" for i in range(measured.shape[0])],
        "actuator": [f"a{i + 1}" for i in range(measured.shape[1])],
        "frequency": LINES[: measured.shape[-1]],
    }
    omega = OMEGA[: measured.shape[-1]]
    observed = {
        "measured": (dims, measured, {"units": observation.label}),
        "receptance": (dims, observation.receptance(measured, omega)),
        "log_jacobian": (dims, observation.log_jacobian(measured, omega)),
    }
    draws = np.zeros(len(likelihood)) if posterior is None else posterior
    groups = {
        "/observed_data": xr.Dataset(observed, coords=coordinates),
        "/log_likelihood": xr.Dataset(
            {"measured": (("chain", "draw", *dims), likelihood[None])}, coords=coordinates
        ),
        "/posterior": xr.Dataset({"structure.h": (("chain", "draw"), draws[None])}),
        "/estimates": xr.Dataset({"log_evidence": evidence[0], "log_evidence_error": evidence[1]}),
    }
    return xr.DataTree.from_dict(groups)


class Linear:
    """A receptance that is linear in Gaussian unknowns, with Gaussian noise known at each line."""

    def __init__(self, unknowns, measured=None, *, seed=5):
        random = np.random.default_rng(seed)
        basis = random.normal(size=(9, *SHAPE)) + 1j * random.normal(size=(9, *SHAPE))
        self.basis = 1e-6 * basis[:unknowns] / (1 + np.arange(12) / 6)
        self.deviation = np.broadcast_to(4e-7 / (1 + np.arange(12) / 6), SHAPE)
        weights = random.normal(size=2)
        noise = random.normal(size=SHAPE) + 1j * random.normal(size=SHAPE)
        clean = np.einsum("h,hsaf->saf", weights, 1e-6 * basis[:2] / (1 + np.arange(12) / 6))
        self.measured = clean + self.deviation * noise if measured is None else measured

    def outputs(self, receptance, observation):
        frf = receptance * (1j * OMEGA) ** observation.derivative
        return np.stack([frf.real, frf.imag], axis=-2)

    def equations(self, observation):
        """Matrix, right side and deviation of the outputs, one row for each, lines last."""
        columns = [self.outputs(shape, observation).ravel() for shape in self.basis]
        scale = self.deviation * OMEGA**observation.derivative
        deviation = np.stack([scale, scale], axis=2)
        return np.array(columns).T, self.outputs(self.measured, observation), deviation

    def evidence(self, observation):
        matrix, z, deviation = self.equations(observation)
        covariance = matrix @ matrix.T + np.diag(deviation.ravel() ** 2)
        scale = deviation.ravel()  # the covariance of raw outputs is badly scaled
        over = multivariate_normal(cov=covariance / np.outer(scale, scale))
        return float(over.logpdf(z.ravel() / scale) - np.log(scale).sum())

    def posterior(self, matrix, z, deviation):
        over = matrix / deviation[:, None]
        covariance = np.linalg.inv(over.T @ over + np.eye(matrix.shape[1]))
        return covariance @ over.T @ (z / deviation), covariance

    def result(self, observation=None, *, seed=0, draws=DRAWS):
        observation = observe.Complex("displacement") if observation is None else observation
        matrix, z, deviation = self.equations(observation)
        mean, covariance = self.posterior(matrix, z.ravel(), deviation.ravel())
        random = np.random.default_rng(seed)
        values = random.multivariate_normal(mean, covariance, size=draws)
        likelihood = norm(0, deviation).logpdf(z - (values @ matrix.T).reshape(draws, *z.shape))
        evidence = (self.evidence(observation), 0.0)
        posterior = values[:, 0]
        return lay_out(observation, z, likelihood, evidence=evidence, posterior=posterior)

    def left_out(self):
        """Exact elpd: refit without each complex value, and predict it."""
        matrix, z, deviation = self.equations(observe.Complex("displacement"))
        z, deviation = z.ravel(), deviation.ravel()
        number = np.arange(np.prod(SHAPE)).reshape(SHAPE)
        place = np.stack([number, number], axis=2).ravel()
        total = 0.0
        for datum in number.ravel():
            out, training = place == datum, place != datum
            mean, covariance = self.posterior(matrix[training], z[training], deviation[training])
            unit = deviation[out][0]
            part = matrix[out] / unit
            predictive = multivariate_normal(part @ mean, part @ covariance @ part.T + np.eye(2))
            total += predictive.logpdf(z[out] / unit) - 2 * np.log(unit)
        return total


@pytest.fixture(scope="module")
def right():
    return Linear(2)


@pytest.fixture(scope="module")
def wide(right):
    return Linear(6, right.measured)


@pytest.fixture(scope="module")
def poor(right):
    return Linear(1, right.measured)


def test_log_bayes_factors_are_those_of_the_closed_form(right, wide, poor):
    models = {"poor": poor, "right": right, "wide": wide}
    table = compare({name: model.result() for name, model in models.items()}).table
    observation = observe.Complex("displacement")
    for name, model in models.items():
        expected = model.evidence(observation) - right.evidence(observation)
        assert table.loc[name, "log_bayes_factor"] == pytest.approx(expected, abs=1e-9)
        assert table.loc[name, "log_evidence"] == pytest.approx(model.evidence(observation))
    assert table.loc["wide", "log_bayes_factor"] < -3
    assert table.loc["poor", "log_bayes_factor"] < -10


def test_elpd_is_that_of_refitting_without_each_datum(right, wide):
    elpd = []
    for seed in range(8):
        results = {"right": right.result(seed=seed), "wide": wide.result(seed=seed + 100)}
        elpd.append(compare(results).table["elpd_loo"])
    elpd = pd.DataFrame(elpd)
    for name, model in [("right", right), ("wide", wide)]:
        error = elpd[name].std(ddof=1) / np.sqrt(8)
        assert abs(elpd[name].mean() - model.left_out()) < 5 * error
        assert error < 0.1


IS_ROUNDED = "round_to" in inspect.signature(arviz_stats.compare).parameters
UNROUNDED = {"round_to": "none"} if IS_ROUNDED else {}  # arviz 1.x shows few digits


def test_figures_are_those_of_arviz(right, wide):
    results = {"wide": wide.result(), "right": right.result()}
    table = compare(results).table
    loo = {}
    for name, result in results.items():
        likelihood = result["log_likelihood"]["measured"].sum("part")
        together = xr.Dataset({"measured": likelihood.drop_vars(list(likelihood.coords))})
        groups = {"/posterior": result["posterior"].to_dataset(), "/log_likelihood": together}
        loo[name] = arviz_stats.loo(xr.DataTree.from_dict(groups), pointwise=True)
    with warnings.catch_warnings():  # its pandas is an older one
        warnings.simplefilter("ignore", pd.errors.Pandas4Warning)
        reference = arviz_stats.compare(loo, method="pseudo-BMA", **UNROUNDED)
    assert reference.index[0] == table["elpd_loo"].idxmax()
    behind = reference.index[1]
    distance = abs(reference["elpd_diff"].iloc[1])  # arviz 1.x counts it downwards
    np.testing.assert_allclose(table.loc[behind, "elpd_difference"], -distance)
    np.testing.assert_allclose(table.loc[behind, "elpd_difference_error"], reference["dse"].iloc[1])
    for name, expected in reference.iterrows():
        np.testing.assert_allclose(table.loc[name, "p_loo"], expected["p"])
        np.testing.assert_allclose(table.loc[name, "elpd_loo_error"], expected["se"])
        largest = float(loo[name].pareto_k.max())
        assert table.loc[name, "pareto_k"] == pytest.approx(largest)


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_another_observed_quantity_changes_nothing(right, quantity):
    other = observe.Complex(quantity)
    table = compare({"displacement": right.result(), quantity: right.result(other)}).table
    first, second = table.to_dict("records")
    for name, value in first.items():
        assert second[name] == pytest.approx(value, rel=1e-9, abs=1e-8), name
    # The densities themselves are far apart.
    assert abs(right.evidence(other) - first["log_evidence"]) > 100


class Amplitude(observe.Observation):
    """The amplitude itself: an observation of a user's own."""

    quantity: str
    parts = 1

    def output(self, frf):
        return abs(frf)

    def deviation(self, frf, variance):
        return (variance / 2) ** 0.5

    def relative(self, outputs):
        return abs(outputs) / 2**0.5

    def receptance(self, measured, omega):
        return measured / omega**self.derivative

    def log_jacobian(self, measured, omega):
        return np.log(omega**self.derivative) + 0.0 * measured

    @property
    def label(self):
        return "amplitude"


def test_an_amplitude_and_its_logarithm_are_comparable():
    random = np.random.default_rng(3)
    receptance, shift = (
        10 ** random.uniform(-7, -5, SHAPE),
        0.05 * random.normal(size=(300, 1, 1, 1)),
    )
    logarithm, plain = observe.LogAmplitude("velocity"), Amplitude("acceleration")
    z, a = np.log10(receptance * OMEGA), receptance * OMEGA**2
    centre = z + 0.03 * random.normal(size=SHAPE) + shift
    in_z = norm(centre, 0.05).logpdf(z)
    in_a = lognorm(0.05 * np.log(10), scale=10**centre * OMEGA).logpdf(a)
    evidences = [np.log(np.mean(np.exp(x.sum((1, 2, 3))))) for x in (in_z, in_a + np.log(a))]
    results = {
        "logarithm": lay_out(logarithm, z, in_z, evidence=(evidences[0], 0.0)),
        "plain": lay_out(plain, a, in_a, evidence=(evidences[1] - np.log(a).sum(), 0.0)),
    }
    first, second = compare(results).table.to_dict("records")
    for name, value in first.items():
        assert second[name] == pytest.approx(value, rel=1e-9, abs=1e-8), name


def test_channels_may_stand_in_another_order_and_some_be_absent(right):
    result = right.result()
    result["observed_data"]["measured"][1, 0, :, 3] = np.nan
    result["log_likelihood"]["measured"][:, :, 1, 0, :, 3] = 0.0
    turned = xr.DataTree.from_dict(
        {
            f"/{name}": group.to_dataset().isel(sensor=[1, 0])
            if "sensor" in group.dims
            else group.to_dataset()
            for name, group in result.children.items()
        }
    )
    table = compare({"one": result, "turned": turned, "whole": result}).table
    np.testing.assert_allclose(table["elpd_loo"], table["elpd_loo"].iloc[0])
    np.testing.assert_array_equal(table["elpd_difference_error"], 0.0)
    complete = compare({"one": right.result(), "other": right.result()}).table
    assert table["elpd_loo"].iloc[0] != pytest.approx(complete["elpd_loo"].iloc[0])


def changed(result, **variables):
    observed = result["observed_data"].to_dataset().assign(**variables)
    groups = {f"/{name}": group.to_dataset() for name, group in result.children.items()}
    return xr.DataTree.from_dict(groups | {"/observed_data": observed})


@pytest.fixture(scope="module")
def bars():
    """The same bar, observed as displacement and as acceleration, inferred exactly."""
    modes = bp.beams.bar(4, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    bar = bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.02, 0.06)))
    lines = np.arange(100.0, 500.0, 50.0)
    random = np.random.default_rng(1)
    results, measurement = {}, None
    for quantity in ("displacement", "acceleration"):
        experiment = bp.Experiment(
            bar,
            sensors=[bp.Sensor("s1", at=0.3)],
            actuators=[bp.Actuator("a1", at=0.2)],
            frequency=lines,
            observe=observe.Complex(quantity),
            noise=bp.noise.FromCoherence(),
        )
        if measurement is None:
            clean = experiment.nominal_measurement().frf
            error = random.normal(size=clean.shape) + 1j * random.normal(size=clean.shape)
            measurement = bp.Measurement.from_arrays(
                clean * (1 + 0.02 * error),
                lines,
                sensors=experiment.sensor_channels,
                actuators=experiment.actuator_channels,
                quantity="receptance",
                coherence=np.full(clean.shape, 1 / (1 + 8 * 2 * 0.02**2)),
                averages=8,
            )
        engine = bp.engines.Grid(nodes=400)
        results[quantity] = bp.infer(experiment, measurement, engine=engine, key=0)
    return results


@pytest.mark.long
def test_inferences_of_two_quantities_are_one_and_the_same(bars):
    comparison = compare(bars)
    first, second = comparison.table.to_dict("records")
    for name in ("log_evidence", "elpd_loo", "p_loo", "pareto_k"):
        assert second[name] == pytest.approx(first[name], rel=1e-6), name
    assert 'PSIS-LOO does not separate "' in str(comparison)
    raw = [float(result["estimates"]["log_evidence"]) for result in bars.values()]
    assert raw[0] == first["log_evidence"]
    assert abs(raw[1] - raw[0]) > 50


def row(evidence=(10.0, 0.1), factor=(0.0, 0.0), elpd=(0.0, 0.0), pareto=(0.4, 0.0)):
    names = ["log_evidence", "log_bayes_factor", "elpd_difference"]
    pairs = dict(zip(names, (evidence, factor, elpd), strict=True))
    columns = {n: v for n, (v, _) in pairs.items()} | {
        f"{n}_error": e for n, (_, e) in pairs.items()
    }
    columns |= {"elpd_loo": 100 + elpd[0], "elpd_loo_error": 5.0, "p_loo": 3.0}
    return columns | {"pareto_k": pareto[0], "pareto_k_bad": pareto[1]}


def words(**rows):
    return ModelComparison(pd.DataFrame.from_dict(rows, orient="index")).words()


@pytest.mark.parametrize(
    ("gap", "strength"),
    [
        (0.9, "not worth more than a bare mention"),
        (2.9, "positive"),
        (4.9, "strong"),
        (5.1, "very strong"),
    ],
)
def test_words_name_the_strength_of_the_evidence(gap, strength):
    sentences = words(a=row(), b=row((10 - gap, 0.1), (-gap, 0.14)))
    assert (
        f'The evidence prefers "a" to "b": log Bayes factor {gap:.1f} ± 0.14, {strength} on the '
        "scale of Kass and Raftery."
    ) in sentences


def test_words_do_not_rank_within_the_sampling_error():
    sentences = words(a=row(), b=row((9.0, 0.5), (-1.0, 0.55)))
    assert any(line.startswith('The evidence does not separate "a" and "b"') for line in sentences)


def test_equal_evidences_differ_by_zero():
    sentences = words(a=row(), b=row((10.0, 0.0), (0.0, 0.0)))
    assert any("log Bayes factor 0," in line for line in sentences)


@pytest.mark.parametrize(
    ("elpd", "begins"),
    [
        ((-20.0, 5.0), 'PSIS-LOO prefers "a" to "b": elpd is larger by 20.0 ± 5, 4 standard'),
        ((-20.0, 12.0), 'PSIS-LOO does not separate "a" and "b"'),
        ((-3.0, 0.1), 'PSIS-LOO does not separate "a" and "b"'),
    ],
)
def test_words_say_what_loo_prefers(elpd, begins):
    sentences = words(a=row(), b=row((5.0, 0.1), (-5.0, 0.14), elpd))
    assert any(line.startswith(begins) for line in sentences)


def test_words_say_where_evidence_and_loo_disagree():
    sentence = 'Evidence and PSIS-LOO disagree: evidence prefers "a", PSIS-LOO prefers "b"'
    sentences = words(a=row(elpd=(-20.0, 5.0)), b=row((5.0, 0.1), (-5.0, 0.14)))
    assert any(line.startswith(sentence) for line in sentences)
    weak = words(a=row(elpd=(-3.0, 5.0)), b=row((5.0, 0.1), (-5.0, 0.14)))
    assert not any("disagree" in line for line in weak)
    unsure = words(a=row(elpd=(-20.0, 5.0)), b=row((5.0, 3.0), (-5.0, 4.0)))
    assert not any("disagree" in line for line in unsure)
    agreed = words(a=row(), b=row((5.0, 0.1), (-5.0, 0.14), (-20.0, 5.0)))
    assert not any("disagree" in line for line in agreed)


def test_words_name_whose_loo_is_not_to_be_trusted():
    sentences = words(a=row(), b=row((5.0, 0.1), (-5.0, 0.14), pareto=(1.25, 0.125)))
    (line,) = [line for line in sentences if "Pareto k" in line]
    assert line.startswith('PSIS-LOO of "b" is unreliable: 12 % of its data have a Pareto k')
    assert "(largest 1.25)" in line


def test_a_datum_that_moves_the_posterior_has_a_large_pareto_k(right):
    result = right.result()
    # One datum whose likelihood alone spreads over many orders of magnitude.
    result["log_likelihood"]["measured"][0, :, 0, 0, 0, 5] = np.linspace(-80.0, 0.0, DRAWS) ** 3
    comparison = compare({"spoilt": result, "right": right.result()})
    assert comparison.table.loc["spoilt", "pareto_k_bad"] == pytest.approx(1 / np.prod(SHAPE))
    assert any('PSIS-LOO of "spoilt" is unreliable' in line for line in comparison.words())


def test_the_text_holds_table_warnings_and_words(right, wide):
    results = {"right": right.result(), "wide": wide.result()}
    results["wide"].attrs["warnings"] = ["The populations disagree."]
    text = str(compare(results))
    assert "log Bayes factor" in text
    assert "share of Pareto k > 0.7" in text
    assert "- wide: The populations disagree." in text
    assert '- The evidence prefers "right" to "wide"' in text


def test_a_model_without_evidence_is_compared_by_loo_alone(right, poor):
    results = {"right": right.result(), "poor": poor.result()}
    results["poor"]["estimates"]["log_evidence"] = np.nan
    sentences = compare(results).words()
    assert '"poor" has no evidence; engines.SMC() computes it.' in sentences
    assert any(line.startswith('PSIS-LOO prefers "right" to "poor"') for line in sentences)
    assert not any("The evidence" in line for line in sentences)


def test_a_model_without_likelihoods_of_each_datum_is_compared_by_evidence_alone(right, poor):
    results = {"right": right.result(), "poor": poor.result()}
    total = results["poor"]["log_likelihood"]["measured"].sum(
        ("sensor", "actuator", "part", "frequency")
    )
    results["poor"]["log_likelihood"] = xr.Dataset({"measured": total})
    sentences = compare(results).words()
    assert any(
        line.startswith('"poor" has no PSIS-LOO, which needs 100 distinct draws')
        for line in sentences
    )
    assert any(line.startswith('The evidence prefers "right" to "poor"') for line in sentences)
    assert not any("PSIS-LOO prefers" in line for line in sentences)


def test_without_either_figure_nothing_is_compared(right):
    results = {"a": right.result(draws=20), "b": right.result(draws=20)}
    for result in results.values():
        result["estimates"]["log_evidence"] = np.nan
    with pytest.raises(ValueError, match=r"No two of these models have an evidence.*engines.SMC"):
        compare(results)


def test_one_model_is_refused(right):
    with pytest.raises(ValueError, match="compare was given 1 model; two or more are needed"):
        compare({"only": right.result()})


def test_what_is_no_inference_is_refused(right):
    tree = xr.DataTree.from_dict({"/prior_predictive": xr.Dataset()})
    with pytest.raises(
        ValueError, match='"b" holds no observed data, so it is no result of an inference'
    ):
        compare({"a": right.result(), "b": tree})


def refused(right, other, message):
    with pytest.raises(ValueError, match=message):
        compare({"a": right.result(), "b": other})


def test_amplitudes_are_not_compared_with_complex_outputs(right):
    z = np.log10(np.abs(right.measured))
    other = lay_out(observe.LogAmplitude("displacement"), z, np.zeros((DRAWS, *SHAPE)))
    refused(right, other, r'"a" and "b" describe different data.*does not determine the phase')


def test_force_levels_are_not_compared_with_a_result_without_them(right):
    levels = right.result().map_over_datasets(lambda dataset: dataset.expand_dims(force_level=2))
    words = r'different data: "{}" has force levels and "{}" has none.*force_levels=\[0.1, 1.0\]'
    with pytest.raises(InputError, match=words.format("b", "a")):
        compare({"a": right.result(), "b": levels})
    with pytest.raises(InputError, match=words.format("a", "b")):
        compare({"a": levels, "b": right.result()})


def test_other_channels_are_refused(right):
    other = changed(right.result(), sensor=["s1", "s7"])
    refused(right, other, "different data: the sensor channels s1, s2 and s1, s7. Densities of")


def test_other_lines_are_refused(right):
    other = changed(right.result(), frequency=LINES + 1)
    refused(right, other, "different data: 12 lines from 20 to 300 Hz and 12 lines from 21 to 301")
    fewer = right.result().isel(frequency=slice(4))
    refused(right, fewer, "12 lines from 20 to 300 Hz and 4 lines")


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
def test_other_measured_values_are_refused(right, quantity):
    measured = right.measured.copy()
    measured[1, 0, 3] *= 1 + 1e-6j
    other = Linear(2, measured).result(observe.Complex(quantity))
    refused(right, other, "different data: 2 of 48 measured values are not the same")


def test_values_measured_elsewhere_are_refused(right):
    other = right.result()
    other["observed_data"]["measured"][0, 0, :, 2] = np.nan
    refused(right, other, "the first has 48 measured outputs and the second 46")


def test_a_result_without_its_jacobian_is_refused(right):
    other = right.result(observe.Complex("velocity"))
    bare = other["observed_data"].to_dataset().drop_vars("log_jacobian")
    other["observed_data"] = xr.DataTree(bare)
    refused(
        right, other, '"b" observes "velocity per force.*result lacks "receptance" and "log_jac'
    )
