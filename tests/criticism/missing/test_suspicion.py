"""Score test: places of the candidates, and scores of effects that are missing or not."""

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.stats import chi2, norm

import bayes_placement as bp
from bayes_placement import effects, positions
from bayes_placement._shared.compiled import compiled
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._scanned_candidates import scanned
from bayes_placement.criticism.missing._suspicion import suspicion
from tests.criticism import small
from tests.in_space import Linear

COLUMNS = ["kind", "variant", "setting", "at", "x", "y", "z", "score", "p_value"]
SEEDS = range(4)


def table(experiment, measurement, candidates):
    null = null_hypothesis(experiment, experiment.data(measurement))
    return suspicion(
        null, list(scanned([(null, candidate) for candidate in candidates], lambda: None))
    )


def greatest(rows):
    return rows.loc[rows["score"].abs().idxmax()]


@pytest.fixture(scope="module")
def on_a_line():
    """Suspect a bar with a hidden mass."""
    experiment = small.experiment()
    candidates = [*effects.library(experiment, ["point_mass", "gain_error"]).effects]
    return table(experiment, small.measured(small.MASS), candidates)


def test_on_a_line_x_is_the_place_along_it(on_a_line):
    assert list(on_a_line.columns) == COLUMNS
    mass = on_a_line.query("kind == 'point_mass'")
    assert len(mass) == 2 * 41  # added and removed
    mass = mass[mass["variant"] == mass["variant"].min()]
    np.testing.assert_array_equal(mass["x"], mass["at"])
    assert mass["x"].is_monotonic_increasing
    assert 0 < mass["x"].min() < 0.05 < 0.95 < mass["x"].max() < 1
    assert on_a_line[["y", "z"]].isna().all(axis=None)


def test_a_hidden_mass_is_most_suspect_where_it_sits(on_a_line):
    row = greatest(on_a_line)
    assert row["kind"] == "point_mass"
    assert row["p_value"] < 1e-12
    assert row["x"] == pytest.approx(small.MASS.at, abs=0.05)


def test_an_instrument_is_suspected_where_it_was_recorded(on_a_line):
    gain = on_a_line.query("kind == 'gain_error'")
    assert gain["at"].isna().all()
    assert list(zip(gain["setting"], gain["x"], strict=True)) == [
        ("sensor s1", 0.24),
        ("sensor s2", 0.61),
        ("actuator a1", 0.40),
    ]


def with_noise(prior):
    noise = bp.noise.FromCoherence(prior)
    return eqx.tree_at(lambda tree: tree.noise, small.experiment(), noise)


def test_noise_that_is_not_known_hides_no_suspicion():
    experiment = with_noise(dist.LogUniform(0.2, 50.0))
    candidates = [*effects.library(experiment, ["point_mass", "gain_error"]).effects]
    row = greatest(table(experiment, small.measured(small.MASS), candidates))
    assert row["kind"] == "point_mass"
    assert row["p_value"] < 1e-12
    assert row["x"] == pytest.approx(small.MASS.at, abs=0.05)


def test_scores_are_those_of_the_noise_that_is_inferred():
    """At the level of noise at which they are inferred, scores are the same where it is known."""
    unknown = with_noise(dist.LogUniform(0.9, 1.1))
    known = with_noise(1.0)
    gains = [*effects.library(known, ["gain_error"]).effects]
    scores = [
        table(experiment, small.measured(seed=1), gains)["score"] for experiment in (unknown, known)
    ]
    np.testing.assert_allclose(*scores, rtol=0.1)


def test_an_effect_that_the_model_absorbs_has_no_score():
    """The gain of the only sensor is a common factor, as an unknown area is."""
    known = small.experiment()
    bar = bp.beams.bar(
        12, length=1.0, area=dist.LogUniform(5e-4, 2e-3), youngs_modulus=1e9, density=9000.0
    )
    experiment = bp.Experiment(
        bp.Structure(bar, damping=bp.damping.Modal(dist.Uniform(0.02, 0.06))),
        sensors=[known.sensor["s1"]],
        actuators=[known.actuator["a1"]],
        frequency=small.LINES,
        observe=known.observe,
        noise=known.noise,
    )
    of_sensor, of_actuator = (
        effects.gain_error(name, dist.Uniform(-0.5, 0.5)) for name in ("s1", "a1")
    )
    assert table(experiment, small.measured(), [of_sensor, of_actuator]).empty
    delay = effects.time_delay(dist.Uniform(-1e-4, 1e-4))
    assert not table(experiment, small.measured(), [delay]).empty


PLACE, RECORDED = (0.7, 0.5, 0.2), {"s1": (0.3, 0.6, 0.1), "s2": (0.8, 0.2, 0.5)}


def in_space():
    return bp.Experiment(
        bp.Structure(Linear(), damping=bp.damping.Modal(dist.Uniform(0.02, 0.06))),
        sensors=[
            bp.Sensor(name, at=at, directions=(direction,))
            for (name, at), direction in zip(RECORDED.items(), (1, 3), strict=True)
        ],
        actuators=[bp.Actuator("a1", at=(0.1, 0.4, 0.3), directions=(2,))],
        frequency=np.linspace(20.0, 160.0, 40),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(1e-3),
    )


@pytest.fixture(scope="module")
def spatial():
    """Suspect a structure in space with a hidden mass."""
    experiment = in_space()
    hidden = experiment.fix({"structure.damping.ratio": 0.04})
    hidden = hidden + effects.point_mass(PLACE, 1e-3)
    surface = positions.Box((0.5, 0.4, 0.2), within=(0.5, 0.4, 0.0))
    candidates = [
        effects.point_mass(surface, dist.LogUniform(1e-4, 0.1)),
        effects.gain_error("s2", dist.Uniform(-0.5, 0.5)),
        effects.time_delay(dist.Uniform(-1e-4, 1e-4)),
    ]
    exact = np.asarray(compiled(bp.Experiment.frf)(hidden))
    measurement = bp.Measurement.from_arrays(
        exact,
        experiment.frequency,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="accelerance",
    )
    return table(experiment, measurement, candidates)


def test_in_space_each_point_of_a_surface_has_its_coordinates(spatial):
    mass = spatial.query("kind == 'point_mass'")
    assert mass[["x", "y"]].drop_duplicates().shape == (289, 2)
    assert (mass["z"] == 0.2).all()
    assert mass["at"].isna().all()
    for name, high in (("x", 1.0), ("y", 0.8)):
        np.testing.assert_allclose(mass[name].unique(), (np.arange(17) + 0.5) / 17 * high)


def test_in_space_a_hidden_mass_is_most_suspect_where_it_sits(spatial):
    row = greatest(spatial)
    assert row["kind"] == "point_mass"
    assert row["p_value"] < 1e-12
    np.testing.assert_allclose(row[["x", "y"]].astype(float), PLACE[:2], atol=0.06)


def test_in_space_an_instrument_is_suspected_where_it_was_recorded(spatial):
    (gain,) = spatial.query("kind == 'gain_error'")[["x", "y", "z"]].to_numpy()
    np.testing.assert_array_equal(gain, RECORDED["s2"])
    assert spatial.query("kind == 'time_delay'")[["x", "y", "z"]].isna().all(axis=None)


@pytest.fixture(scope="module")
def chance():
    """Scores and probabilities where nothing is missing, over several seeds."""
    experiment = small.experiment()
    candidates = [*effects.library(experiment, ["gain_error", "point_mass"]).effects]
    return [table(experiment, small.measured(seed=seed), candidates) for seed in SEEDS]


def test_a_score_is_standard_normal_where_nothing_is_missing(chance):
    # The gains of two sensors, whose signatures hardly overlap.
    scores = np.concatenate([rows.query("kind == 'gain_error'")["score"] for rows in chance])
    assert 1e-3 < chi2.cdf(np.sum(scores**2), scores.size) < 1 - 1e-3


def test_having_looked_in_many_places_is_corrected_for(chance):
    p_values = [rows.query("kind == 'point_mass'")["p_value"].iloc[0] for rows in chance]
    sizes = [rows.query("kind == 'point_mass'")["score"].abs().max() for rows in chance]
    assert min(p_values) > 0.01 / len(SEEDS)
    # Forty-one places along the bar count as many more than two, and as fewer than they are.
    alone_by_chance = 2 * norm.sf(sizes)
    assert np.all(np.array(p_values) > -np.expm1(2 * np.log1p(-alone_by_chance)))
    assert np.all(np.array(p_values) < -np.expm1(41 * np.log1p(-alone_by_chance)))


def test_a_score_has_unit_variance_where_the_model_absorbs_much_of_the_effect():
    """A gain beside a gain of which little is known besides, over data of many true models."""
    known = small.experiment()
    where = bp.positions.Segment(0.61, within=0.02)
    experiment = bp.Experiment(
        known.structure,
        sensors=[known.sensor["s1"], bp.Sensor("s2", at=where, gain=dist.Normal(1.0, 4e-4))],
        actuators=[known.actuator["a1"]],
        frequency=small.LINES,
        observe=known.observe,
        noise=known.noise,
    )
    candidate = effects.gain_error("s2", dist.Uniform(-0.5, 0.5))
    scores = []
    for seed in range(24):
        gain = 1.0 + 4e-4 * np.random.default_rng(100 + seed).standard_normal()
        true = effects.gain_error("s2", gain - 1.0)
        rows = table(experiment, small.measured(true, seed=seed), [candidate])
        scores.append(rows["score"].abs().max())
    assert 1e-3 < chi2.cdf(np.sum(np.square(scores)), len(scores)) < 1 - 1e-3
