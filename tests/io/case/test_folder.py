"""A case folder becomes an experiment and its measurement, and each wrong field is named."""

import copy
import dataclasses
import inspect
import json
import math
import re
import time

import jax
import numpy as np
import pytest
from numpyro.distributions import LogNormal, Normal, Uniform

import bayes_placement as bp
from bayes_placement.io import _gate, case
from bayes_placement.io.case import folder
from bayes_placement.io.case._json_fields import KNOWN

LINES = np.linspace(20.0, 120.0, 6)
MISSING = object()

BAR = {
    "structure": {
        "type": "axial bar",
        "length_m": 1.0,
        "area_m2": 1e-3,
        "boundary_conditions": "fixed at x=0 and x=L",
        "motion": "axial displacement u(x), direction 1",
        "youngs_modulus_Pa": 1e9,
        "density_kg_m3": 9000,
        "damping": {"model": "modal viscous, the same ratio for every mode", "ratio": 0.04},
    },
    "nominal_fe_model": None,
    "sensors": [
        {
            "id": name,
            "uff_node": node,
            "position_m": [x, 0.0, 0.0],
            "tolerance_m": [0.04, 0.0, 0.0],
            "directions": [direction],
            "angle_tolerance_rad": 0.0,
        }
        for name, node, x, direction in [("s1", 1, 0.6, 1), ("s2", 2, 0.98, -1)]
    ],
    "actuators": [
        {
            "id": "a1",
            "uff_node": 101,
            "position_m": [0.1, 0.0, 0.0],
            "tolerance_m": [0.0, 0.0, 0.0],
            "directions": [-1],
            "angle_tolerance_rad": 0.0,
        }
    ],
    "uncertain_parameters": [
        {"name": "youngs_modulus_Pa", "prior": {"type": "uniform", "low": 9e8, "high": 1.1e9}},
        {"name": "modal_damping_ratio", "prior": {"type": "uniform", "low": 0.02, "high": 0.08}},
    ],
    "frequency": {"band_hz": [20.0, 120.0], "n_lines": 6},
    "measurement": {
        "quantity": "accelerance",
        "units": "(m/s^2)/N",
        "convention": "exp(+i w t)",
        "out_channels": [["s1", 1], ["s2", -1]],
        "in_channels": [["a1", -1]],
        "estimator": "H1",
        "n_averages": 16,
        "sensor_setup": "one sensor roved over the positions, one run per position",
        "force_levels_N": None,
    },
}

BEAM = {
    "type": "Euler-Bernoulli beam, bending",
    "length_m": 1.0,
    "width_m": 0.04,
    "height_m": 0.012,
    "boundary_conditions": "free-free on a soft suspension",
    "suspension": [{"x_m": 0.2, "stiffness_N_per_m": 230.0}, {"x_m": 1, "stiffness_N_per_m": 99}],
    "motion": "transverse displacement w(x) along z, direction 3",
    "youngs_modulus_Pa": 70e9,
    "density_kg_m3": 2700.0,
    "damping": {"model": "modal viscous, the same ratio for every mode", "ratio": 0.004},
}


def beam_case():
    content = copy.deepcopy(BAR) | {"structure": copy.deepcopy(BEAM), "uncertain_parameters": []}
    for side, channels in (("sensors", "out_channels"), ("actuators", "in_channels")):
        for transducer in content[side]:
            transducer["directions"] = [3]
        content["measurement"][channels] = [[transducer["id"], 3] for transducer in content[side]]
    return content


def measured(**changes):
    """A measurement by node numbers, as an analyser that knows no names exports it."""
    rows = np.arange(1.0, 3.0)[:, None, None]
    altered = {
        "frf": rows * np.exp(0.1j * LINES),
        "frequency": LINES,
        "sensors": [bp.Channel("1", 1), bp.Channel("2", -1)],
        "actuators": [bp.Channel("101", -1)],
        "quantity": "accelerance",
        "coherence": np.full((2, 1, LINES.size), 0.9),
        "positions": {"1": (0.6, 0, 0), "2": (0.98, 0, 0), "101": (0.1, 0, 0)},
    } | changes
    return bp.Measurement.from_arrays(**altered)


def turned(**changes):
    """The same along z."""
    channels = {
        "sensors": [bp.Channel("1", 3), bp.Channel("2", 3)],
        "actuators": [bp.Channel("101", 3)],
    }
    return measured(**channels, **changes)


def written(folder, content=BAR, *, text=None, **files):
    """Write a case folder; files are measurements by the stem of their name."""
    (folder / "case.json").write_text(json.dumps(content) if text is None else text, "utf-8")
    for stem, measurement in ({"measured": measured()} | files).items():
        bp.io.uff.write(folder / f"{stem}.uff", measurement)
    return folder


def changed(path, value, content=BAR):
    """The case with one field set, or left out, by its dotted path."""
    altered = copy.deepcopy(content)
    *way, last = [int(word) if word.isdigit() else word for word in re.findall(r"\w+", path)]
    place = altered
    for word in way:
        place = place[word]
    if value is MISSING:
        del place[last]
    else:
        place[last] = value
    return altered


@pytest.fixture(scope="module")
def bar(tmp_path_factory):
    return case.read(written(tmp_path_factory.mktemp("bar")))


def test_modes_that_take_longer_than_reading_are_waited_for(tmp_path, monkeypatch):
    given, make = written(tmp_path), folder.nominal_structure

    def made_slowly(content):
        until = time.process_time() + 2 * _gate.SECONDS
        while time.process_time() < until:
            pass
        return make(content)

    monkeypatch.setattr(_gate, "SECONDS", 0.5)
    monkeypatch.setattr(folder, "nominal_structure", made_slowly)
    case.read(given)


def test_priors_sit_at_the_leaves_of_what_they_are_for(bar):
    loaded = {
        unknown.name: (float(unknown.distribution.low), float(unknown.distribution.high))
        for unknown in bar.experiment.unknowns
    }
    assert loaded == {
        "structure.modes.youngs_modulus": (9e8, 1.1e9),
        "structure.damping.ratio": (0.02, 0.08),
        "sensor.s1.position": (0.6 - 0.04, 0.6 + 0.04),
        "sensor.s2.position": (0.98 - 0.04, 1.0),  # the bar ends there
    }


def test_what_has_no_tolerance_is_a_number(bar):
    actuator = bar.experiment.actuator["a1"]
    assert (actuator.position, actuator.angles, actuator.directions) == (0.1, None, (-1,))


def test_nodes_become_names_and_the_case_knows_the_averages(bar):
    assert isinstance(bar.measurement, bp.Measurement)
    assert [channel.label for channel in bar.measurement.sensors] == ["s1+x", "s2-x"]
    assert [channel.label for channel in bar.measurement.actuators] == ["a1-x"]
    assert bar.measurement.averages == 16
    assert bar.measurement.positions == {"s1": (0.6, 0, 0), "s2": (0.98, 0, 0), "a1": (0.1, 0, 0)}
    assert (bar.engine, bar.truth, bar.experiment.force_levels) == (None, {}, None)


def test_the_noise_is_the_one_of_the_coherence(bar):
    expected = np.abs(bar.measurement.frf) ** 2 * (1 - 0.9) / (16 * 0.9)
    deviation = np.asarray(bar.experiment.data(bar.measurement).deviation)
    np.testing.assert_allclose(2 * deviation[:, :, 0] ** 2, expected, rtol=1e-12)
    np.testing.assert_allclose(bar.experiment.frequency, LINES)


def test_the_drawn_bar_is_the_one_built_by_hand(bar):
    modes = bp.beams.bar(20, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    by_hand = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.05)),
        sensors=[bp.Sensor("s1", at=0.6), bp.Sensor("s2", at=0.98, directions=(-1,))],
        actuators=[bp.Actuator("a1", at=0.1, directions=(-1,))],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )
    frf, expected = jax.jit(lambda: (bar.experiment.nominal().frf(), by_hand.frf()))()
    np.testing.assert_allclose(frf, expected, rtol=1e-12)


def test_a_suspended_beam_hangs_on_its_springs(tmp_path):
    experiment = case.read(written(tmp_path, beam_case(), measured=turned())).experiment
    modes = experiment.structure.modes
    assert (modes.area, modes.rigid_body_modes, modes.axes) == (0.04 * 0.012, 2, (3,))
    assert modes.second_moment == pytest.approx(0.04 * 0.012**3 / 12)
    mounts = experiment.structure.effects
    assert [
        (name, float(mount.at), mount.law.parts[0].stiffness) for name, mount in mounts.items()
    ] == [
        ("suspension_1", 0.2, 230.0),
        ("suspension_2", 1.0, 99.0),
    ]


def test_the_suspension_damps_the_bounce_as_the_other_modes(tmp_path):
    experiment = case.read(written(tmp_path, beam_case(), measured=turned())).experiment
    springs, dashpots = zip(
        *(mount.law.parts for mount in experiment.structure.effects.values()), strict=True
    )
    mass = 2700.0 * 0.04 * 0.012
    natural = np.sqrt(sum(spring.stiffness for spring in springs) / mass)
    viscosity = sum(dashpot.viscosity for dashpot in dashpots)
    assert viscosity / (2 * mass * natural) == pytest.approx(0.004)


def test_modes_are_kept_up_to_six_times_the_band(tmp_path):
    # The bar has a natural frequency every 166.67 Hz, 45 of them below 6 x 1251 Hz.
    high = changed("frequency.band_hz", [1250.0, 1251.0])
    high["frequency"]["n_lines"] = 2
    file = measured(
        frf=np.ones((2, 1, 2), complex),
        frequency=[1250.0, 1251.0],
        coherence=np.full((2, 1, 2), 0.9),
    )
    modes = case.read(written(tmp_path, high, measured=file)).experiment.structure.modes
    assert len(modes.wave_numbers) == 45


def test_no_fewer_than_twenty_modes_are_kept(bar):
    assert len(bar.experiment.structure.modes.wave_numbers) == 20


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("roving", "one sensor roved over the positions, one run per position"),
        ("fixed", "all sensors mounted all the time"),
    ],
)
def test_how_the_sensors_were_mounted_is_kept(tmp_path, name, words):
    folder = written(tmp_path, changed("measurement.sensor_setup", words))
    assert case.read(folder).experiment.sensors_mounted == name


@pytest.mark.parametrize(
    ("quantity", "units", "motion"),
    [("receptance", "m/N", "displacement"), ("mobility", "(m/s)/N", "velocity")],
)
def test_the_measured_quantity_is_the_observed_one(tmp_path, quantity, units, motion):
    content = changed("measurement.quantity", quantity)
    content["measurement"]["units"] = units
    study = case.read(written(tmp_path, content, measured=measured(quantity=quantity)))
    assert study.experiment.observe == bp.observe.Complex(motion)
    assert study.measurement.quantity == quantity


def distribution_of_density(folder, prior):
    uncertain = [{"name": "density_kg_m3", "prior": prior}]
    read = case.read(written(folder, changed("uncertain_parameters", uncertain)))
    return read.experiment.structure.modes.density


def test_a_normal_prior(tmp_path):
    distribution = distribution_of_density(
        tmp_path, {"type": "normal", "mean": 8900, "standard_deviation": 90}
    )
    assert isinstance(distribution, Normal)
    assert (float(distribution.loc), float(distribution.scale)) == (8900, 90)


def test_a_lognormal_prior(tmp_path):
    prior = {"type": "lognormal", "median": 8900, "log_standard_deviation": 0.1}
    distribution = distribution_of_density(tmp_path, prior)
    assert isinstance(distribution, LogNormal)
    assert (float(distribution.loc), float(distribution.scale)) == (
        pytest.approx(math.log(8900)),
        0.1,
    )


@pytest.mark.parametrize(("content", "roll"), [(BAR, 0), (beam_case(), 2)], ids=["bar", "beam"])
def test_a_tilted_sensor_has_the_two_angles_that_its_channel_sees(tmp_path, content, roll):
    file = measured() if content is BAR else turned()
    tilted = changed("sensors[0].angle_tolerance_rad", 0.2, content)
    experiment = case.read(written(tmp_path, tilted, measured=file)).experiment
    angles = experiment.sensor["s1"].angles
    assert experiment.sensor["s2"].angles is None
    assert angles[roll] == 0.0
    for about in {0, 1, 2} - {roll}:
        assert isinstance(angles[about], Uniform)
        assert (float(angles[about].low), float(angles[about].high)) == (-0.2, 0.2)


@pytest.mark.parametrize("axis", [1, 3])
def test_a_roll_about_its_own_axis_is_not_seen(axis):
    gain = jax.jit(lambda angles: bp.positions.vectors.rotation(angles)[axis - 1, axis - 1])
    axis_vector = np.eye(3)[axis - 1]
    assert float(gain(0.7 * axis_vector)) == 1.0
    tilt = 0.1 * (1 - axis_vector)
    np.testing.assert_allclose(gain(tilt + 0.7 * axis_vector), gain(tilt), rtol=1e-15)
    assert float(gain(tilt)) < 0.995


LEVELS = changed("measurement.force_levels_N", [0.02, 0.06])


def test_each_force_level_is_a_measurement(tmp_path):
    file = measured(frf=2 * measured().frf)
    study = case.read(written(tmp_path, LEVELS, measured_level2=file))
    assert study.experiment.force_levels == (0.02, 0.06)
    assert [measurement.force_level for measurement in study.measurement] == [0.02, 0.06]
    assert study.experiment.data(study.measurement).z.shape == (2, 1, 2, 2, 6)
    np.testing.assert_allclose(study.measurement[1].frf, 2 * study.measurement[0].frf)


def test_one_force_level_is_a_level(tmp_path):
    study = case.read(written(tmp_path, changed("measurement.force_levels_N", [0.5])))
    assert (study.experiment.force_levels, len(study.measurement)) == ((0.5,), 1)


def test_a_driving_point_shares_its_node(tmp_path):
    content = changed("actuators[0].uff_node", 1)
    content["actuators"][0]["position_m"] = [0.6, 0.0, 0.0]
    study = case.read(
        written(tmp_path, content, measured=measured(actuators=[bp.Channel("1", -1)]))
    )
    assert study.measurement.sensors[0].name == "s1"
    assert study.measurement.actuators[0].name == "a1"


def test_channels_come_in_the_order_of_the_case(tmp_path):
    file = measured(sensors=[bp.Channel("2", -1), bp.Channel("1", 1)])
    study = case.read(written(tmp_path, measured=file))
    assert [channel.name for channel in study.measurement.sensors] == ["s1", "s2"]
    np.testing.assert_allclose(study.measurement.frf[1], file.frf[0])


def test_channels_that_the_case_does_not_name_are_left_out(tmp_path):
    file = measured(
        frf=np.ones((3, 1, 6), complex),
        coherence=np.full((3, 1, 6), 0.9),
        sensors=[bp.Channel("7", 1), *measured().sensors],
    )
    study = case.read(written(tmp_path, measured=file))
    assert [channel.name for channel in study.measurement.sensors] == ["s1", "s2"]


def test_only_the_lines_of_the_band_are_used(tmp_path):
    content = changed("frequency", {"band_hz": [40.0, 100.0], "n_lines": 4})
    study = case.read(written(tmp_path, content))
    np.testing.assert_allclose(study.experiment.frequency, [40, 60, 80, 100])
    assert study.measurement.frequency.size == 4


def test_a_file_that_knows_less_is_enough(tmp_path):
    file = measured(positions={}, sensors=[bp.Channel("1"), bp.Channel("2")])
    study = case.read(written(tmp_path, measured=file))
    assert [channel.label for channel in study.measurement.sensors] == ["s1+x", "s2-x"]


def test_hints_and_notes_may_say_anything(tmp_path):
    content = changed("hints", {"n_modes_recommended": 200})
    content["sensors"][0]["note"] = "serial number 17"
    assert case.read(written(tmp_path, content)).experiment.sensor["s1"].name == "s1"


@pytest.mark.parametrize(
    ("path", "nearest"),
    [
        ("nominal_fe_modell", "nominal_fe_model"),
        ("structure.lenght_m", "length_m"),
        ("structure.damping.ratoi", "ratio"),
        ("measurement.force_level_N", "force_levels_N"),
        ("measurement.noise_levels", "noise_level"),
    ],
)
def test_fields_that_are_not_known_are_refused_with_the_nearest_known_one(tmp_path, path, nearest):
    message = rf'case\.json: the field {path} is not known; the nearest known one is "{nearest}"'
    with pytest.raises(case.CaseError, match=message):
        case.read(written(tmp_path, changed(path, None)))


def test_fields_of_listed_objects_must_be_known(tmp_path):
    content = changed("hints", {})
    content["sensors"][0]["tolerance"] = [0.01, 0.0, 0.0]
    with pytest.raises(case.CaseError, match=r'sensors\[0\]\.tolerance of "s1" is not known.*_m"'):
        case.read(written(tmp_path, content))


NUMBER_M = r"a positive number \[m\] is needed"
THREE = "three coordinates .* with x from 0 to 1, is needed"
PRIOR = "uncertain_parameters[0].prior"
SETUP = '"one sensor roved over .* or "all sensors mounted all the time" is needed'

WRONG = [
    ("structure", 3, r"the field structure is 3; an object"),
    ("structure.type", "plate", '"plate"; "axial bar" or "Euler-Bernoulli beam, bending" is'),
    ("structure.type", ["axial bar"], r'\["axial bar"\]; "axial bar" or '),
    ("structure.length_m", "1 m", f'is "1 m"; {NUMBER_M}.* write "length_m": 1.0'),
    ("structure.length_m", True, f"is true; {NUMBER_M}"),
    ("structure.length_m", 0, f"is 0; {NUMBER_M}"),
    ("structure.length_m", float("nan"), f"is NaN; {NUMBER_M}"),
    ("structure.area_m2", -1.0, r"is -1.0; a positive number \[m2\]"),
    ("structure.boundary_conditions", "free", '"free"; "fixed at x=0 and x=L" is needed'),
    ("structure.motion", "direction 3", 'begins with "axial displacement'),
    ("structure.youngs_modulus_Pa", None, r"is null; a positive number \[Pa\]"),
    ("structure.density_kg_m3", [1], r"is \[1\]; a positive number \[kg/m3\]"),
    ("structure.damping.model", "Rayleigh", '"Rayleigh"; "modal viscous, the same ratio'),
    ("structure.damping.ratio", 4.0, r"is 4.0; a positive number \[1\] below 1"),
    ("structure.suspension", [], r"is \[\]; a list .* with at least 1 entry"),
    ("sensors", [], r"the field sensors is \[\]; a list .* at least 1 entry"),
    ("sensors", [3], r"is \[3\]; a list \[\{...\}\] of objects"),
    ("sensors[0].id", "s1+x", 'is "s1.x"; a name without'),
    ("sensors[0].id", "", "a name without"),
    ("sensors[0].id", 1, "is 1; a name without"),
    ("sensors[1].id", "s1", r'sensors\[0\]\.id of "s1" and sensors\[1\]\.id of "s1" are both'),
    ("sensors[1].uff_node", 1, r'uff_node of "s1" and sensors.*of "s2" are both 1; each needs'),
    ("actuators[0].id", "s1", r'and actuators\[0\]\.id of "s1" are both "s1"'),
    ("sensors[1].uff_node", 2.0, 'of "s2" is 2.0; a whole number of at least 1'),
    ("sensors[1].uff_node", True, "is true; a whole number"),
    ("sensors[1].position_m", [1.2, 0, 0], f'sensors.1..position_m of "s2" is .*{THREE}'),
    ("sensors[1].position_m", [0.5, 0.1, 0], THREE),
    ("sensors[1].position_m", [0.5], THREE),
    ("sensors[1].position_m", 0.5, THREE),
    ("sensors[1].tolerance_m", [-0.01, 0, 0], 'of "s2" is .*; three tolerances'),
    ("sensors[1].tolerance_m", [0.01, 0.01, 0], "the last two 0 on a line along x, is needed"),
    ("sensors[1].tolerance_m", 0.01, "three tolerances"),
    ("sensors[1].directions", [3], r"is \[3\]; the direction in which .* \[1\] or \[-1\], is"),
    ("sensors[1].directions", [1, -1], "the direction in which the structure moves"),
    ("sensors[1].angle_tolerance_rad", 5.0, r"is 5.0; a number \[rad\] from 0 to 1.5708"),
    ("uncertain_parameters[0].name", "mass", '"mass"; "youngs_modulus_Pa" or "density_kg_m3" or'),
    ("uncertain_parameters[1].name", "youngs_modulus_Pa", "are both .*or leave it out"),
    (f"{PRIOR}.type", "beta", '"beta"; "uniform" or "normal" or "lognormal" is needed'),
    (f"{PRIOR}.low", -1, r"prior.low is -1; a positive number \[Pa\], not above the nominal"),
    (f"{PRIOR}.low", 1.05e9, r"not above the nominal value 1e\+09 in `structure`, is needed"),
    (f"{PRIOR}.high", 1.1, r"is 1.1; a positive number \[Pa\], above `low` and not below the nom"),
    ("frequency.band_hz", [120, 20], r"the first and the last line \[Hz\], positive and incr"),
    ("frequency.band_hz", [0, 120], "positive and increasing"),
    ("frequency.n_lines", 6.5, "is 6.5; a whole number of at least 1"),
    ("measurement.quantity", "apparent mass", '"accelerance" or "mobility" or "receptance" is'),
    ("measurement.units", "g/N", r'units is "g/N"; "\(m/s\^2\)/N" is needed'),
    ("measurement.convention", "exp(-i w t)", r'"exp\(\+i w t\)" is needed'),
    ("measurement.estimator", "H2", '"H2"; "H1" is needed'),
    ("measurement.n_averages", 0, "is 0; a whole number of at least 1"),
    ("measurement.out_channels", [["s1", 1]], r'"s1", 1\]\]; each channel of `sensors` once'),
    ("measurement.out_channels", 2, "is 2; each channel of `sensors` once"),
    ("measurement.in_channels", [["a1", 1]], "each channel of `actuators` once.*a1., -1"),
    ("measurement.sensor_setup", "roving", f'"roving"; {SETUP}'),
    ("measurement.force_levels_N", [0.1, 0.1], r"null, or a list of positive amplitudes \[N\]"),
    ("measurement.force_levels_N", [0.0], "null, or a list of positive"),
    ("measurement.force_levels_N", [], "null, or a list of positive"),
    ("measurement.force_levels_N", ["1 N"], "null, or a list of positive"),
    ("measurement.force_levels_N", 0.1, "is 0.1; null, or a list of positive"),
]


@pytest.mark.parametrize(
    ("path", "value", "message"), WRONG, ids=[f"{path}={value}" for path, value, _ in WRONG]
)
def test_a_wrong_field_is_named_with_its_file_and_what_is_allowed(tmp_path, path, value, message):
    folder = written(tmp_path, changed(path, value))
    with pytest.raises(case.CaseError, match=message) as caught:
        case.read(folder)
    assert str(folder / "case.json") in str(caught.value)
    assert path.removesuffix(".id") in str(caught.value)


REQUIRED = [
    *("structure", "sensors", "actuators", "uncertain_parameters", "frequency", "measurement"),
    *(f"structure.{name}" for name in BAR["structure"]),
    *("structure.damping.model", "structure.damping.ratio"),
    *(f"sensors[1].{name}" for name in BAR["sensors"][1]),
    *("uncertain_parameters[0].name", PRIOR),
    *(f"{PRIOR}.{name}" for name in ("type", "low", "high")),
    *(f"frequency.{name}" for name in BAR["frequency"]),
    *(f"measurement.{name}" for name in BAR["measurement"]),
]


@pytest.mark.parametrize("path", REQUIRED)
def test_a_missing_field_is_named_with_its_file_and_what_is_needed(tmp_path, path):
    name = path.split(".")[-1]
    pattern = rf'has no field {re.escape(path)}.*; .* is needed there\. .*Write "{name}": '
    with pytest.raises(case.CaseError, match=pattern) as caught:
        case.read(written(tmp_path, changed(path, MISSING)))
    assert str(tmp_path / "case.json") in str(caught.value)


def test_a_misspelt_field_is_recognised(tmp_path):
    content = changed("structure.length_m", MISSING)
    content["structure"]["lenght_m"] = 1.0
    with pytest.raises(case.CaseError, match=r'structure\.lenght_m is not known; .* "length_m"'):
        case.read(written(tmp_path, content))


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("structure.width_m", MISSING, r"no field structure\.width_m; a positive number \[m\]"),
        ("structure.height_m", 0.0, r"height_m is 0\.0; a positive number \[m\]"),
        ("structure.suspension", MISSING, r"no field structure\.suspension; a list"),
        (
            "structure.suspension[1].x_m",
            1.5,
            r"suspension\[1\]\.x_m is 1\.5; a number \[m\] from 0 to 1 is needed",
        ),
        (
            "structure.suspension[0].stiffness_N_per_m",
            -1,
            r"stiffness_N_per_m is -1; a positive number \[N/m\]",
        ),
        (
            "structure.suspension[0].stiffness_N_per_m",
            10**40,
            r"stiffness_N_per_m is 10+; numbers up to 1e\+30 are needed there, since no quantity",
        ),
        (
            "measurement.force_levels_N",
            [1e300, 0.06],
            r"force_levels_N is \[1e\+300, 0\.06\]; numbers up to 1e\+30 are needed there",
        ),
        ("structure.motion", "direction 2", 'begins with "transverse displacement'),
        (
            "structure.boundary_conditions",
            "clamped",
            r'"clamped at x=0 \(w=0, dw/dx=0\), free at x=L" or "free-free on a soft suspension"',
        ),
    ],
)
def test_a_wrong_field_of_a_beam_is_named(tmp_path, path, value, message):
    folder = written(tmp_path, changed(path, value, beam_case()), measured=turned())
    with pytest.raises(case.CaseError, match=message):
        case.read(folder)


@pytest.mark.parametrize(
    ("prior", "message"),
    [
        ({"type": "normal", "mean": 0}, r"prior\.mean is 0; a positive number \[kg/m3\]"),
        (
            {"type": "normal", "mean": 9000, "standard_deviation": 3000},
            r"is 3000; a positive number \[in the unit of the mean\] below 1800",
        ),
        ({"type": "lognormal", "median": -1}, r"prior\.median is -1; a positive"),
        (
            {"type": "lognormal", "median": 9000, "log_standard_deviation": 0},
            r"log_standard_deviation is 0; a positive number \[1\]",
        ),
    ],
)
def test_a_wrong_prior_is_named(tmp_path, prior, message):
    with pytest.raises(case.CaseError, match=message):
        distribution_of_density(tmp_path, prior)


def test_a_structure_in_other_units_is_told(tmp_path):
    content = changed("structure.youngs_modulus_Pa", 1.0)  # GPa
    content["uncertain_parameters"] = []
    message = r"more than 400 natural frequencies below 720 Hz.*SI is assumed.*Check the units"
    with pytest.raises(case.CaseError, match=message):
        case.read(written(tmp_path, content))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{\n "structure": {,}\n}', r"case\.json is not JSON: .* in line 2, column 16\. Correct"),
        ("[1]", r"holds \[1\]; one object .* with the fields of a case is needed"),
        ('{"sensors": [], "sensors": []}', 'the field "sensors" occurs twice in one object'),
    ],
)
def test_what_is_no_case_is_refused(tmp_path, text, message):
    with pytest.raises(case.CaseError, match=message):
        case.read(written(tmp_path, text=text))


def test_a_file_in_another_encoding_is_refused(tmp_path):
    folder = written(tmp_path)
    (folder / "case.json").write_bytes('{"case": "Träger"}'.encode("latin-1"))
    with pytest.raises(case.CaseError, match=r"case\.json cannot be read: .*UTF-8"):
        case.read(folder)


def test_a_folder_without_a_case_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no file .*case\.json.*give that folder"):
        case.read(tmp_path / "nowhere")


def test_a_missing_measurement_is_named_with_the_field_that_asks_for_it(tmp_path):
    message = (
        r"no file .*measured_level2\.uff, and measurement\.force_levels_N in .*case\.json asks for "
        "one file for each of 2 force levels"
    )
    with pytest.raises(FileNotFoundError, match=message):
        case.read(written(tmp_path, LEVELS))


def test_a_missing_only_measurement_is_named(tmp_path):
    (written(tmp_path) / "measured.uff").unlink()
    with pytest.raises(FileNotFoundError, match=r"measured\.uff, and .* asks for one file: "):
        case.read(tmp_path)


OTHER_POSITIONS = {"1": (0.61, 0, 0), "2": (0.98, 0, 0), "101": (0.1, 0, 0)}

CONTRADICTIONS = {
    "quantity": (
        measured(quantity="mobility"),
        r"holds mobility, but the field measurement\.quantity in .* says accelerance",
    ),
    "missing channel": (
        measured(sensors=[bp.Channel("1", 1), bp.Channel("3", 1)]),
        r'has the channels s1\+x, node 3\+x, but .*directions of "s2" in .* says s2-x at node 2',
    ),
    "opposite direction": (
        measured(actuators=[bp.Channel("101", 1)]),
        r"has the channels a1\+x, but the field actuators\[0\]\.directions .* says a1-x at node",
    ),
    "position": (
        measured(positions=OTHER_POSITIONS),
        r"places node 1 at \(0\.61, 0, 0\) m, but .*sensors\[0\]\.position_m of \"s1\" in",
    ),
    "averages": (
        measured(averages=8),
        r"records 8 averages, but the field measurement\.n_averages in .* says 16",
    ),
    "force": (
        measured(force_level=0.5),
        r"records a force of 0\.5 N, but the field measurement\.force_levels_N in .* says none",
    ),
    "band": (
        measured(frequency=LINES + 20),
        r"has 6 lines from 40 to 140 Hz, 5 of them in the band, but the field frequency in",
    ),
    "spacing": (
        measured(frequency=[10, 30, 50, 70, 90, 110]),
        r"has .*5 of them in the band, but the field frequency",
    ),
}


@pytest.mark.parametrize(("file", "message"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_a_file_that_contradicts_the_case_is_named_with_it(tmp_path, file, message):
    with pytest.raises(case.CaseError, match=rf"measured\.uff {message}") as caught:
        case.read(written(tmp_path, measured=file))
    assert str(tmp_path / "case.json") in str(caught.value)
    assert "Correct the one that is wrong." in str(caught.value)


@pytest.mark.parametrize(
    ("band", "lines", "loaded"),
    [([20.0, 121.0], 6, 6), ([20.0, 120.0], 5, 6), ([200.0, 300.0], 6, 0)],
    ids=["ends between lines", "another number of lines", "elsewhere"],
)
def test_another_band_contradicts_the_file(tmp_path, band, lines, loaded):
    content = changed("frequency", {"band_hz": band, "n_lines": lines})
    with pytest.raises(case.CaseError, match=f"{loaded} of them in the band, but .* {lines} lines"):
        case.read(written(tmp_path, content))


def test_a_recorded_force_of_another_level_is_told(tmp_path):
    with pytest.raises(case.CaseError, match=r"force of 0\.1 N, .* says 0\.06 N for this file"):
        case.read(written(tmp_path, LEVELS, measured_level2=measured(force_level=0.1)))


def test_force_levels_share_their_lines(tmp_path):
    shifted = LINES.copy()
    shifted[2] += 1.0
    file = measured(frequency=shifted)
    with pytest.raises(case.CaseError, match=r"level2\.uff and .*measured\.uff have other lines"):
        case.read(written(tmp_path, LEVELS, measured_level2=file))


def test_without_coherence_the_noise_is_unknown(tmp_path):
    study = case.read(written(tmp_path, measured=measured(coherence=None)))
    noise = study.experiment.noise
    assert noise.coherence is None
    assert (noise.ratio.low, noise.ratio.high) == (1e-3, 0.3)
    assert noise.floor.high == pytest.approx(0.3 * 1.5)  # the median amplitude of channels 1 and 2
    assert "The level of the noise is not known" in str(study.experiment)
    assert "noise is not known" not in str(case.read(written(tmp_path)).experiment)


def test_without_coherence_the_lines_of_a_whole_record_tell_the_noise(tmp_path):
    lines, random = np.linspace(10.0, 100.0, 91), np.random.default_rng(5)
    error = 0.05 * random.standard_normal((2, 2, 1, lines.size))
    frf = np.array([1.0, 2.0])[:, None, None] * np.exp(0.1j * lines) + error[0] + 1j * error[1]
    run = measured(coherence=None, frequency=lines, frf=frf)
    content = changed("frequency", {"band_hz": [10.0, 100.0], "n_lines": 91})
    study = case.read(written(tmp_path, content, measured=run))
    assert isinstance(study.experiment.noise, bp.noise.FromScatter)
    deviation = study.experiment.data(study.measurement).deviation
    assert deviation.shape[-1] == 91
    np.testing.assert_allclose(np.median(deviation), 0.05, rtol=0.1)


def test_a_variance_in_every_file_is_the_noise(tmp_path):
    stated = measured()
    variance = 0.01 * np.abs(stated.frf) ** 2
    study = case.read(written(tmp_path, measured=dataclasses.replace(stated, variance=variance)))
    assert isinstance(study.experiment.noise, bp.noise.FromVariance)
    deviation = np.asarray(study.experiment.data(study.measurement).deviation)
    expected = 0.01 * np.abs(study.measurement.frf) ** 2
    np.testing.assert_allclose(2 * deviation[:, :, 0] ** 2, expected, rtol=1e-9)


def test_levels_with_coherence_and_without_are_refused(tmp_path):
    message = (
        r"level2\.uff does not state its noise: .* no coherence.*coherence of every FRF .*none"
    )
    files = {"measured_level2": measured(coherence=None)}
    with pytest.raises(case.CaseError, match=message):
        case.read(written(tmp_path, LEVELS, **files))


STATES = [{"label": "new", "files": ["new.uff"]}, {"label": "worn", "files": ["measured.uff"]}]


def test_states_are_read_in_their_order(tmp_path):
    content = changed("measurement.states", STATES)
    study = case.read(written(tmp_path, content, new=measured(frf=np.ones((2, 1, LINES.size)))))
    assert list(study.states) == ["new", "worn"]
    assert np.all(study.states["new"].frf == 1)
    np.testing.assert_array_equal(study.states["worn"].frf, study.measurement.frf)


@pytest.mark.parametrize(
    ("states", "words"),
    [
        (STATES[:1], r"measurement.states is .*a list .* of objects with at least 2 entr"),
        ([STATES[0], STATES[0]], r"states\[0\].label .* are both .*new"),
        ([{"label": "", "files": []}, STATES[0]], r"states\[0\].label.* is \"\"; a text"),
        (
            [{"label": "a\x1b[2J", "files": []}, STATES[0]],
            r"at most 100 letters that can be",
        ),
        ([{"label": "new", "files": []}, STATES[1]], r'"new", names 0 universal files, but 1 are'),
    ],
)
def test_states_that_are_none_are_refused(tmp_path, states, words):
    with pytest.raises(case.CaseError, match=words):
        case.read(written(tmp_path, changed("measurement.states", states), new=measured()))


def test_states_beside_a_baseline_are_refused(tmp_path):
    content = changed("measurement.states", STATES)
    content["measurement"]["baseline_files"] = ["new.uff"]
    with pytest.raises(case.CaseError, match=r"Leave measurement.baseline_files out"):
        case.read(written(tmp_path, content, new=measured()))


def test_a_file_of_a_state_that_is_missing_is_named(tmp_path):
    content = changed("measurement.states", STATES)
    with pytest.raises(FileNotFoundError, match=r'new.uff, and measurement.states, "new", in'):
        case.read(written(tmp_path, content))


def test_what_is_no_universal_file_is_refused(tmp_path):
    folder = written(tmp_path)
    (folder / "measured.uff").write_text("nothing")
    with pytest.raises(case.CaseError, match=r"measured\.uff cannot be used: .*not a universal"):
        case.read(folder)


def sides(study):
    first = study.measurement[0] if isinstance(study.measurement, tuple) else study.measurement
    return len(first.sensors), len(first.actuators), first.frequency.size


@pytest.mark.parametrize(
    ("name", "first", "size", "levels", "mounted", "unknowns"),
    [
        ("01_bar-01", 166.666667, (3, 1, 317), None, "roving", 6),
        ("03_cantilever-01", 13.925277, (3, 1, 680), (0.02, 0.06, 0.12), "roving", 7),
        ("05_freebeam-01", 62.806943, (3, 1, 680), (0.2, 0.6, 1.2), "roving", 6),
        ("06_bar-02", 166.666667, (4, 1, 396), None, "roving", 7),
        ("07_cantilever-02", 13.925277, (3, 1, 500), None, "roving", 7),
        ("09_freebeam-02", 62.806943, (5, 1, 700), None, "roving", 8),
        ("11_cantilever-03", 13.925277, (4, 1, 500), None, "fixed", 8),
        ("12_bar-03", 166.666667, (3, 2, 317), None, "roving", 7),
    ],
)
def test_shared_cases(shared_data, name, first, size, levels, mounted, unknowns):
    study = case.read(shared_data / "cases" / name)
    experiment = study.experiment
    assert (sides(study), experiment.force_levels) == (size, levels)
    assert (experiment.sensors_mounted, len(experiment.unknowns)) == (mounted, unknowns)
    modes = experiment.nominal().structure.modes
    natural = np.asarray(jax.jit(lambda: modes.angular_frequency())()) / (2 * np.pi)
    assert natural[modes.rigid_body_modes] == pytest.approx(first, rel=1e-5)
    assert natural[-1] > 3.9 * experiment.frequency[-1]
    springs = ["suspension_1", "suspension_2"] if "freebeam" in name else []
    assert list(experiment.structure.effects) == springs
    runs = () if levels is None else (len(levels),)
    assert experiment.data(study.measurement).z.shape == (*size[:2], *runs, 2, size[2])


def test_a_case_without_coherence_states_its_noise(tmp_path):
    stated = {"ratio": [1e-3, 0.1], "floor": 1e-4}
    content = changed("measurement.noise_level", stated)
    study = case.read(written(tmp_path, content, measured=measured(coherence=None)))
    noise = study.experiment.noise
    assert (noise.ratio.low, noise.ratio.high, noise.floor) == (1e-3, 0.1, 1e-4)
    assert noise.coherence is None
    assert study.experiment.data(study.measurement).relative is not None


def test_a_factor_on_the_coherence_may_be_stated_alone_and_beside_a_ratio(tmp_path):
    content = changed("measurement.noise_level", {"coherence_factor": [0.5, 5.0]})
    noise = case.read(written(tmp_path, content)).experiment.noise
    assert isinstance(noise, bp.noise.FromCoherence)
    assert (noise.factor.low, noise.factor.high) == (0.5, 5.0)
    content = changed("measurement.noise_level", {"ratio": 0.01, "coherence_factor": 2})
    noise = case.read(written(tmp_path, content)).experiment.noise
    assert (noise.ratio, noise.coherence, noise.floor) == (0.01, 2.0, 0.0)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        (
            {"floor": 1.0},
            r"has neither measurement.noise_level.ratio nor measurement.noise_level.coherence_f",
        ),
        ({"ratio": -0.1}, r"measurement.noise_level.ratio is -0.1; a positive number"),
        (
            {"ratio": [0.1, 0.01]},
            r"measurement.noise_level.ratio is \[0.1, 0.01\]; a positive number",
        ),
        (3, r"measurement.noise_level is 3; an object"),
    ],
)
def test_noise_that_is_none_is_refused(tmp_path, stated, words):
    with pytest.raises(case.CaseError, match=words):
        case.read(written(tmp_path, changed("measurement.noise_level", stated)))


def names_of(known):
    """Names of fields, and of the fields of their objects."""
    for name, inner in known.items():
        yield name
        yield from names_of(inner) if isinstance(inner, dict) else ()


def test_every_field_that_the_reader_documents_is_known():
    bullets = inspect.getdoc(case.read).split("\n- ", 1)[1].split("Parameters\n")[0]
    documented = {word for word in re.findall(r"`([a-z]+(?:_\w+)+)`", bullets)}
    values = {"modal_damping_ratio", "youngs_modulus_Pa", "density_kg_m3"}
    assert len(documented) > 25
    assert documented - values <= set(names_of(KNOWN))


def test_a_file_of_a_level_that_the_case_does_not_name_is_refused(tmp_path):
    folder = written(tmp_path, measured_level2=measured())
    with pytest.raises(
        case.CaseError, match=r"level2\.uff is there, but measurement\.force_levels_N"
    ):
        case.read(folder)


@pytest.mark.parametrize("within", [1e-300, 1e29])
def test_an_error_of_a_place_names_the_file(tmp_path, within):
    content = changed("sensors.0.tolerance_m.0", within)
    with pytest.raises(ValueError, match=r"case\.json: .*Segment"):
        case.read(written(tmp_path, content))
