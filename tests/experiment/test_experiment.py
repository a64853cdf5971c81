"""Names by path, the paper's nominal outputs, data that fit, models written by hand."""

import dataclasses
import re

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
import pytest
from numpyro import handlers
from numpyro.infer import MCMC, NUTS
from numpyro.infer.util import log_density
from scipy import stats

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InputError
from bayes_placement.experiment.experiment import MEASURED, RESPONSE

FREQUENCY = (np.arange(10) + 0.5) * 43.3
BAR = bp.beams.bar(
    15, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0, static_correction=False
)
RATIOS = [dist.Uniform(0.02, 0.06), dist.Uniform(0.02, 0.06), 0.04]

# REFERENCE.md, z_nom at (.25, .25), computed by an independent script.
Z_NOM = [
    *(-4.603527, -4.085003, -3.750820, -3.222826, -3.688268),
    *(-4.163680, -3.561972, -2.950245, -3.335920, -3.778451),
]


def experiment(**changes):
    arguments = {
        "structure": bp.Structure(BAR, damping=bp.damping.Modal(RATIOS)),
        "sensors": [bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))],
        "actuators": [bp.Actuator("a1", at=bp.positions.Segment(0.25, within=0.04))],
        "frequency": FREQUENCY,
        "observe": bp.observe.LogAmplitude("velocity"),
        "noise": bp.noise.Gaussian(0.01),
        **changes,
    }
    return bp.Experiment(arguments.pop("structure"), **arguments)


def small(**changes):
    """Two sensors, one actuator, five lines, no unknown but what is changed."""
    beam = bp.beams.beam(
        4, length=1.0, area=1e-3, second_moment=1e-8, youngs_modulus=7e10, density=2700.0
    )
    arguments = {
        "structure": bp.Structure(beam, damping=bp.damping.Modal([0.03, 0.02])),
        "sensors": [bp.Sensor("s1", at=0.4), bp.Sensor("s2", at=0.9)],
        "actuators": [bp.Actuator("a1", at=0.65)],
        "frequency": [5.0, 12.0, 30.0, 55.0, 80.0],
        "observe": bp.observe.Complex("acceleration"),
        "noise": bp.noise.Gaussian(0.05),
        **changes,
    }
    return bp.Experiment(arguments.pop("structure"), **arguments)


@pytest.fixture(scope="module")
def measured():
    """What the small experiment would measure."""
    return small().nominal_measurement()


def test_unknowns_are_named_by_path():
    named = [(unknown.name, unknown.unit) for unknown in experiment().unknowns]
    assert named == [
        ("structure.damping.ratio.1", "1"),
        ("structure.damping.ratio.2", "1"),
        ("sensor.s1.position", "m"),
        ("actuator.a1.position", "m"),
    ]


def test_unknowns_of_every_part_have_a_role():
    beam = bp.beams.beam(
        *(2,), length=dist.Uniform(0.9, 1.1), area=1e-3, second_moment=1e-8,
        youngs_modulus=dist.LogNormal(25.0, 0.1), density=2700.0,
    )  # fmt: skip
    angles = (0.0, dist.Uniform(-0.2, 0.2), 0.0)
    beam_experiment = small(
        structure=bp.Structure(beam, damping=bp.damping.Structural(dist.HalfNormal(0.05))),
        sensors=[bp.Sensor("tip", at=0.85, angles=angles)],
        noise=bp.noise.Gaussian(dist.HalfNormal(0.1)),
    )
    assert [
        (unknown.name, unknown.unit, unknown.role.value) for unknown in beam_experiment.unknowns
    ] == [
        ("structure.modes.length", "m", "parameter"),
        ("structure.modes.youngs_modulus", "Pa", "parameter"),
        ("structure.damping.loss_factor", "1", "parameter"),
        ("sensor.tip.angles.2", "rad", "placement"),
        ("noise.sigma", "unit of z", "output error"),
    ]


def test_nominal_outputs_are_those_of_the_reference():
    nominal = experiment().nominal_measurement()
    assert nominal.quantity == "mobility"
    np.testing.assert_allclose(np.log10(np.abs(nominal.frf[0, 0])), Z_NOM, atol=1e-6)


def test_fixed_outputs_are_those_of_the_reference():
    ratios = {"structure.damping.ratio.1": 0.04, "structure.damping.ratio.2": 0.04}
    places = {"sensor.s1.position": 0.25, "actuator.a1.position": 0.25}
    outputs = jax.jit(lambda: experiment().fix(ratios | places).predict())()
    np.testing.assert_allclose(outputs[0, 0], Z_NOM, atol=1e-6)


def test_the_nominal_experiment_sits_where_it_was_recorded():
    # Clipped at the end of the bar, the mean of the distribution is not the recorded position.
    sensor = bp.Sensor("s1", at=bp.positions.Segment(0.99, within=0.04))
    nominal = experiment(sensors=[sensor]).nominal()
    assert nominal.sensor["s1"].position == 0.99
    np.testing.assert_allclose(nominal.structure.damping.ratio, (0.04, 0.04, 0.04))
    assert nominal.unknowns == []


def test_printing_lays_out_every_prior():
    lines = str(experiment()).splitlines()
    assert lines[0] == (
        "Experiment: 1 sensor x 1 actuator channels, 10 lines from 21.65 to 411.35 Hz, "
        "z = log10 of velocity per force [(m/s)/N]"
    )
    rows = [line.split() for line in lines[1:]]
    assert rows == [
        ["unknown", "prior", "unit", "role"],
        ["structure.damping.ratio.1", "Uniform(0.02,", "0.06)", "1", "parameter"],
        ["structure.damping.ratio.2", "Uniform(0.02,", "0.06)", "1", "parameter"],
        ["sensor.s1.position", "Uniform(0.21,", "0.29)", "m", "placement"],
        ["actuator.a1.position", "Uniform(0.21,", "0.29)", "m", "placement"],
    ]
    assert len({line.index("Uniform") for line in lines[2:]}) == 1  # in one column


@pytest.mark.parametrize(
    ("prior", "words"),
    [
        (dist.Uniform(0.01, 0.05).expand((4,)).to_event(1), "4 Uniform(0.01, 0.05)"),
        (dist.Uniform(jnp.array([0.01, 0.02]), 0.05), "Uniform([0.01, 0.02], 0.05)"),
        (
            dist.LogUniform(jnp.linspace(0.01, 0.04, 5), jnp.full(5, 0.1)).to_event(1),
            "LogUniform([0.01, ..., 0.04], 0.1)",
        ),
    ],
)
def test_priors_of_several_numbers_are_written_in_short(prior, words):
    damped = small(structure=bp.Structure(BAR, damping=bp.damping.Modal(prior)))
    assert words in str(damped)


def test_more_than_ten_sensors_keep_their_order():
    places = np.linspace(0.1, 0.9, 12)
    names = [f"s{number}" for number in range(1, 13)]
    twelve = small(
        sensors=[bp.Sensor(n, at=p) for n, p in zip(names, places.tolist(), strict=True)]
    )
    assert [channel.name for channel in twelve.sensor_channels] == names
    # Through JAX too, which sorts the keys of a plain dictionary: s10 before s2.
    passed = jax.tree_util.tree_map(lambda leaf: leaf, twelve)
    assert [channel.name for channel in passed.sensor_channels] == names
    frf = compiled(bp.Experiment.frf)(twelve)
    single = compiled(bp.Experiment.frf)(small(sensors=[bp.Sensor("s2", at=places.tolist()[1])]))
    np.testing.assert_allclose(frf[1:2], single, rtol=1e-12)
    uncertain = small(sensors=[bp.Sensor(n, at=dist.Uniform(0.1, 0.9)) for n in names])
    assert [unknown.name for unknown in uncertain.unknowns] == [
        f"sensor.{name}.position" for name in names
    ]


def test_rows_are_sensors_and_columns_are_actuators():
    # Different numbers of each, or a swap would go unseen.
    actuators = [bp.Actuator("a1", at=0.65), bp.Actuator("a2", at=0.2), bp.Actuator("a3", at=1.0)]
    frf = compiled(bp.Experiment.frf)(small(actuators=actuators))
    assert frf.shape == (2, 3, 5)
    swapped = small(
        sensors=[bp.Sensor("s1", at=0.2)],
        actuators=[bp.Actuator("a1", at=0.4), bp.Actuator("a2", at=0.9)],
    )
    reciprocal = compiled(bp.Experiment.frf)(swapped)
    np.testing.assert_allclose(reciprocal[0], frf[:, 1], rtol=1e-12)  # reciprocity


def relabelled(measured, sensors):
    return bp.Measurement.from_arrays(
        measured.frf,
        measured.frequency,
        sensors=sensors,
        actuators=measured.actuators,
        quantity=measured.quantity,
    )


def test_data_recorded_in_the_opposite_direction_are_flipped(measured):
    z = small().data(measured).z
    flipped = small().data(relabelled(measured, ["s1-z", "s2+z"])).z
    np.testing.assert_allclose(flipped[0], -z[0], rtol=1e-14)
    np.testing.assert_allclose(flipped[1], z[1], rtol=1e-14)


def test_data_are_picked_by_name_not_by_place(measured):
    z = small().data(measured).z
    exchanged = small().data(relabelled(measured, ["s2+z", "s1+z"])).z
    np.testing.assert_allclose(exchanged, z[::-1], rtol=1e-14)


@pytest.mark.parametrize("quantity", ["receptance", "mobility"])
def test_data_are_converted_to_what_is_observed(measured, quantity):
    z = small().data(measured.converted(quantity)).z
    np.testing.assert_allclose(z, small().data(measured).z, rtol=1e-12)


def test_a_line_that_was_not_measured_is_refused(measured):
    with pytest.raises(ValueError, match=r"1 of the frequencies given were not measured: 31 Hz"):
        small(frequency=[5.0, 31.0]).data(measured)


def test_the_line_that_takes_measured_lines_is_told_where_others_are_asked_for(measured):
    with pytest.raises(InputError) as refusal:
        small(frequency=np.linspace(3.0, 21.3, 40)).data(measured)
    said, lines = str(refusal.value), measured.frequency
    assert f"measured were {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz" in said
    band = re.search(r"The (\d+) of them in the band asked for: frequency=(.+)\.$", said)
    chosen = eval(band[2], {"measurement": measured})
    assert chosen.size == int(band[1])
    small(frequency=chosen).data(measured)


def test_lines_of_another_band_are_answered_by_all_that_were_measured(measured):
    words = r"None of them lies in the band.*: frequency=measurement\.frequency takes all\.$"
    with pytest.raises(InputError, match=words):
        small(frequency=measured.frequency[-1] * np.array([2.0, 3.0])).data(measured)


def test_a_sensor_that_was_not_measured_is_refused(measured):
    third = small(sensors=[bp.Sensor("s3", at=0.5)])
    with pytest.raises(ValueError, match=r"sensor channel s3\+z was requested, but only s1\+z"):
        third.data(measured)


def joint(declared, data, values=None):
    density = jax.jit(lambda parameters: log_density(declared.model, (data,), {}, parameters)[0])
    return density(values or {})


def test_the_likelihood_is_gaussian_around_the_outputs(measured):
    declared = small(structure=small().structure, noise=bp.noise.Gaussian(0.05))
    z = np.asarray(declared.data(measured).z)
    shifted = bp.noise.Data(jnp.asarray(z + 0.02), np.ones(z.shape, dtype=bool))
    expected = stats.norm.logpdf(0.02, 0.0, 0.05) * z.size
    np.testing.assert_allclose(joint(declared, shifted), expected, rtol=1e-10)


def test_the_model_takes_a_measurement_or_its_outputs(measured):
    assert joint(small(), measured) == joint(small(), small().data(measured))


def test_the_prior_of_the_model_is_that_of_its_leaves():
    declared = experiment()
    values = {"structure.damping.ratio.1": 0.03, "structure.damping.ratio.2": 0.05}
    values |= {"sensor.s1.position": 0.27, "actuator.a1.position": 0.22}
    prior = 2 * np.log(1 / 0.04) + 2 * np.log(1 / 0.08)
    z = declared.data(declared.nominal_measurement()).z
    predicted = compiled(bp.Experiment.predict)(declared.fix(values))
    likelihood = stats.norm.logpdf(z, predicted, 0.01).sum()
    density = joint(declared, declared.nominal_measurement(), values)
    np.testing.assert_allclose(density, prior + likelihood, rtol=1e-10)


@pytest.mark.parametrize("observe", [bp.observe.Complex, bp.observe.LogAmplitude])
def test_pairs_that_were_not_measured_do_not_count(measured, observe):
    declared = small(observe=observe("acceleration"), noise=bp.noise.Gaussian(dist.HalfNormal(0.1)))
    frf = np.array(measured.frf) * 1.1
    complete = bp.Measurement.from_arrays(
        frf[:1], measured.frequency, sensors=["s1"], actuators=["a1"], quantity="accelerance"
    )
    frf[1] = np.nan
    gap = bp.Measurement.from_arrays(
        frf, measured.frequency, sensors=["s1", "s2"], actuators=["a1"], quantity="accelerance"
    )
    single = small(
        sensors=[bp.Sensor("s1", at=0.4)], observe=declared.observe, noise=declared.noise
    )
    level = {"noise.sigma": 0.07}
    np.testing.assert_allclose(
        joint(declared, gap, level), joint(single, complete, level), rtol=1e-12
    )

    def density(sigma):
        return log_density(declared.model, (gap,), {}, {"noise.sigma": sigma})[0]

    assert np.isfinite(jax.jit(jax.grad(density))(0.07))


def test_coherence_and_averages_give_the_level_of_each_datum(measured):
    coherence = np.random.default_rng(1).uniform(0.8, 0.99, measured.frf.shape)
    estimated = bp.Measurement.from_arrays(
        measured.frf,
        measured.frequency,
        sensors=measured.sensors,
        actuators=measured.actuators,
        quantity="accelerance",
        coherence=coherence,
        averages=8,
    )
    data = small(noise=bp.noise.FromCoherence()).data(estimated)
    variance = np.abs(measured.frf) ** 2 * (1 - coherence) / (8 * coherence)
    for part in (0, 1):
        np.testing.assert_allclose(data.deviation[:, :, part], np.sqrt(variance / 2), rtol=1e-12)
    assert small().data(estimated).deviation is None  # a stated level needs no coherence


def sites_of(declared):
    with handlers.trace() as sites, handlers.seed(rng_seed=0):
        jax.eval_shape(declared.model)  # names need no values, so nothing is compiled
    return sites


@pytest.mark.parametrize("observe", [bp.observe.Complex, bp.observe.LogAmplitude])
def test_gaps_leave_the_gradient_in_the_level_finite(measured, observe):
    frf, coherence = np.array(measured.frf) * 1.1, np.full(measured.frf.shape, 0.9)
    frf[1] = coherence[1] = np.nan
    gap = bp.Measurement.from_arrays(
        frf,
        measured.frequency,
        sensors=["s1", "s2"],
        actuators=["a1"],
        quantity="accelerance",
        coherence=coherence,
        averages=8,
    )
    level = bp.noise.FromCoherence(dist.LogNormal(0.0, 0.5))
    declared = small(observe=observe("acceleration"), noise=level)

    def density(factor):
        return log_density(declared.model, (gap,), {}, {"noise.factor": factor})[0]

    assert np.all(np.isfinite(jax.jit(jax.value_and_grad(density))(1.2)))


def test_a_simulation_has_a_response_and_a_measured_site():
    sites = sites_of(small())
    assert list(sites) == [RESPONSE, MEASURED]
    assert not sites[MEASURED]["is_observed"]


def test_without_noise_a_simulation_ends_at_the_response():
    assert list(sites_of(small(noise=None))) == [RESPONSE]


def test_without_noise_data_have_no_density(measured):
    with pytest.raises(ValueError, match=r"noise=None, so no measured value has a density"):
        jax.eval_shape(lambda: small(noise=None).model(measured))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"sensors": [bp.Sensor("s1", at=0.2), bp.Sensor("s1", at=0.3)]},
            r'Two transducers are called "s1".*given once',
        ),
        ({"actuators": []}, r"needs at least one sensor and one actuator"),
        (
            {"actuators": [bp.Actuator("a2", at=1.03)]},
            r'Actuator "a2": position 1.03 m lies outside the structure \(0 to 1 m\)',
        ),
        ({"frequency": [0.0, 5.0]}, r"observe.Complex needs \|U\| > 0, but frequency 0 Hz"),
        ({"frequency": []}, r"frequency of shape \(0,\) was given; a list of lines"),
        ({"frequency": [[5.0]]}, r"frequency of shape \(1, 1\) was given"),
        ({"frequency": [5.0, np.nan]}, r"finite and not negative, is needed"),
        ({"frequency": [-5.0]}, r"finite and not negative, is needed"),
    ],
)
def test_what_cannot_be_an_experiment_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        small(**changes)


def test_a_sensor_and_an_actuator_may_share_a_name():
    collocated = small(sensors=[bp.Sensor("p1", at=0.4)], actuators=[bp.Actuator("p1", at=0.4)])
    assert collocated.sensor_channels == collocated.actuator_channels


@pytest.mark.parametrize("name", ["structure.damping.ratio.3", "sensor.s2.position", "ratio"])
def test_what_is_not_unknown_cannot_be_fixed(name):
    with pytest.raises(ValueError, match=rf"There is no unknown '{name}'.*sensor.s1.position"):
        experiment().fix({name: 0.04})


def test_only_what_was_fixed_is_known():
    fixed = experiment().fix({"sensor.s1.position": 0.26})
    assert [unknown.name for unknown in fixed.unknowns] == [
        "structure.damping.ratio.1",
        "structure.damping.ratio.2",
        "actuator.a1.position",
    ]
    assert fixed.sensor["s1"].recorded == 0.25


@pytest.mark.long
def test_a_hand_written_hierarchical_model_calls_the_public_pieces():
    # Ratios of a family of modes scatter around a common one, which no single leaf can say.
    modes = bp.beams.bar(4, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    lines = np.array([60.0, 166.0, 250.0, 333.0, 500.0, 666.0])
    place = bp.positions.Segment(0.3, within=0.04)

    def declared(ratio):
        return bp.Experiment(
            bp.Structure(modes, damping=bp.damping.Modal(ratio)),
            sensors=[bp.Sensor("s1", at=place)],
            actuators=[bp.Actuator("a1", at=0.15)],
            frequency=lines,
            observe=bp.observe.LogAmplitude("velocity"),
            noise=bp.noise.Gaussian(0.02),
        )

    def model(data):
        centre = numpyro.sample("centre", dist.LogNormal(np.log(0.04), 0.5))
        spread = numpyro.sample("spread", dist.HalfNormal(0.5))
        with numpyro.plate("mode", 4):
            ratio = numpyro.sample("ratio", dist.LogNormal(jnp.log(centre), spread))
        declared(ratio).model(data)

    truth = declared(jnp.array([0.03, 0.05, 0.04, 0.06]))
    data = truth.data(truth.nominal_measurement())
    kernel = NUTS(model, max_tree_depth=5)
    mcmc = MCMC(kernel, num_warmup=100, num_samples=100, progress_bar=False)

    def sample(key):  # compiled as one, which halves the time
        mcmc.run(key, data)
        return mcmc.get_samples()

    draws = jax.jit(sample)(jax.random.PRNGKey(0))
    assert set(draws) == {"centre", "spread", "ratio", "sensor.s1.position"}
    assert draws["ratio"].shape == (100, 4)
    ratio = np.asarray(draws["ratio"])
    # Rough, as a hundred draws are, but the data tell the least ratio from the greatest.
    assert np.mean(ratio[:, 3] > ratio[:, 0]) > 0.9
    assert np.all((draws["sensor.s1.position"] > 0.26) & (draws["sensor.s1.position"] < 0.34))


# --------------------------------------------------------------------------- force levels


LEVELS = [0.5, 2.0]


def test_force_levels_are_a_dimension_of_the_outputs():
    two_levels = small(force_levels=LEVELS)
    channels = (len(two_levels.sensor_channels), len(two_levels.actuator_channels))
    z = compiled(bp.Experiment.predict)(two_levels.nominal())
    assert z.shape == (*channels, 2, 2, 5)
    no_level = compiled(bp.Experiment.predict)(small().nominal())
    assert no_level.shape == (*channels, 2, 5)
    for level in range(2):  # a linear structure does not feel the force
        np.testing.assert_allclose(z[:, :, level], no_level, rtol=1e-12)


def test_each_force_level_has_its_measurement_in_any_order():
    spring = bp.effects.cubic_stiffness(0.9, 1e7)
    two_levels = small(force_levels=LEVELS) + spring
    measurements = two_levels.nominal_measurement()
    assert [measurement.force_level for measurement in measurements] == LEVELS
    single = (small(force_levels=[2.0]) + spring).nominal_measurement()
    np.testing.assert_allclose(measurements[1].frf, single[0].frf, rtol=1e-10)
    assert np.abs(measurements[0].frf / measurements[1].frf - 1).max() > 1e-3
    data = two_levels.data(measurements[::-1])
    outputs = compiled(bp.Experiment.predict)(two_levels)
    np.testing.assert_allclose(data.z, outputs, rtol=1e-10)
    assert data.measured.shape == outputs.shape == (2, 1, 2, 2, 5)


def test_levels_that_do_not_fit_are_refused(measured):
    two_levels = small(force_levels=LEVELS)
    with pytest.raises(ValueError, match=r"force level 0.5 N, but .* none stated"):
        two_levels.data(measured)
    first = two_levels.nominal_measurement()[0]
    with pytest.raises(ValueError, match=r"level 2 N, but .* have 0.5 N. Give one .*force_level=2"):
        two_levels.data([first])
    with pytest.raises(ValueError, match=r"2 measurements were given .* without force levels"):
        small().data([measured, measured])


@pytest.mark.parametrize("levels", [[], [0.0], [1.0, 1.0], [np.inf]])
def test_force_levels_are_positive_and_each_once(levels):
    with pytest.raises(ValueError, match=r"force_levels=\(.*force amplitudes \[N\] are needed"):
        small(force_levels=levels)


def test_sensors_are_roving_or_fixed():
    with pytest.raises(ValueError, match=r"sensors_mounted='loose' .* 'roving'.*'fixed'"):
        small(sensors_mounted="loose")
    mass = bp.effects.sensor_mass(0.05)
    frf = {
        word: np.asarray(compiled(bp.Experiment.frf)(declared))
        for word, declared in (
            ("roving", small() + mass),
            ("fixed", small(sensors_mounted="fixed") + mass),
            ("alone", small(sensors=[bp.Sensor("s2", at=0.9)]) + mass),
        )
    }
    np.testing.assert_allclose(frf["roving"][1:], frf["alone"], rtol=1e-10)
    assert np.abs(frf["fixed"] / frf["roving"] - 1).max() > 1e-2


def test_a_line_at_zero_is_refused_where_the_structure_is_free():
    free = bp.beams.bar(4, length=1.0, area=1e-3, youngs_modulus=1e9, density=9e3, ends="free-free")
    with pytest.raises(ValueError, match=r"0 Hz.*1 rigid-body.*frequency\[frequency > 0\]"):
        bp.Experiment(
            bp.Structure(free, damping=bp.damping.Modal(0.02)),
            sensors=[bp.Sensor("s1", at=0.3)],
            actuators=[bp.Actuator("a1", at=0.7)],
            frequency=[0.0, 10.0],
            observe=bp.observe.Complex("displacement"),
            noise=None,
        )


def test_a_stated_variance_reaches_the_noise_in_the_quantity_that_is_observed(measured):
    variance = 0.01 * np.abs(measured.frf) ** 2 * np.arange(1.0, 6.0)
    stated = dataclasses.replace(measured, variance=variance)
    for quantity in ("acceleration", "displacement"):
        chosen = small(observe=bp.observe.Complex(quantity), noise=bp.noise.FromVariance(2.0))
        level = np.asarray(chosen.noise.deviation(chosen.data(stated)))
        expected = 2 * np.sqrt(stated.converted(quantity).variance / 2)
        np.testing.assert_allclose(level, np.stack([expected] * 2, axis=2), rtol=1e-12)


def test_noise_from_variance_needs_a_measurement_that_states_one(measured):
    with pytest.raises(ValueError, match="states no variance of its FRFs"):
        small(noise=bp.noise.FromVariance()).data(measured)
