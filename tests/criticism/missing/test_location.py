"""Locations of effects: as declared, or of the part or sensor that the effect acts on."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from skfem import Basis, ElementQuadBFS

import bayes_placement as bp
from bayes_placement import effects, finite_elements, positions
from bayes_placement.criticism.locations import effect_locations, ends, locations
from bayes_placement.criticism.missing._claims import _entry
from bayes_placement.criticism.missing._fitted_candidates import extended
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing.fitted_model import fitted_model
from bayes_placement.modes.finite_elements import interpolation, modes_from_shapes, soft_supports
from bayes_placement.positions import places
from tests.small_models import Plate

MIDDLES = {"left half": (0.25, 0.3, 0.0), "right half": (0.75, 0.4, 0.0), "strut": (0.1, 0.2, 0.6)}
RECORDED = {"s1": (0.2, 0.7, 0.1), "s2": (0.9, 0.1, 0.3)}
COUNT = 4
POINTS = np.arange(COUNT)


def in_space():
    random = np.random.default_rng(0)
    position = np.vstack([np.zeros(3), np.ones(3), random.uniform(size=(10, 3))])
    model = bp.finite_elements.ModalModel.from_arrays(
        position=position,
        shape=random.normal(size=(12, 3, 2)),
        natural_frequency=[30.0, 80.0],
        modal_mass=1.0,
    )
    modes = modes_from_shapes(
        model,
        interpolation.scattered(model),
        regions={"left half": np.eye(2), "right half": np.eye(2), "nowhere": np.eye(2)},
        members={"strut": np.eye(2)},
        centres=MIDDLES,
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor(name, at=at) for name, at in RECORDED.items()],
        actuators=[bp.Actuator("a1", at=(0.5, 0.5, 0.5))],
        frequency=[20.0, 50.0],
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )


def on_a_line():
    return bp.Experiment(
        bp.Structure(
            bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0),
            damping=bp.damping.Modal(0.02),
        ),
        sensors=[bp.Sensor("s1", at=0.2), bp.Sensor("s2", at=positions.Segment(0.7, within=0.1))],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=[150.0],
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )


SPACE, LINE = in_space(), on_a_line()


def at(effect, experiment=SPACE, **values):
    """Places of an effect added to an experiment, given values of fields of its place."""
    extended = experiment + effect
    (added,) = extended.effects
    where = "instrument_effects" if extended.instrument_effects else "structure.effects"
    named = {f"{where}.{added.name}.{field}": value for field, value in values.items()}
    return locations(added, extended, named, COUNT)


def test_a_place_is_where_its_coordinates_say():
    support = positions.Box((0.5, 0.25, 0.125), within=(0.25, 0.0, 0.125))
    x, z = 0.3 + 0.1 * POINTS, 0.05 * POINTS
    located = at(effects.point_mass(support, 0.1), **{"at.x": x, "at.z": z})
    np.testing.assert_allclose(located, np.stack([x, np.full(COUNT, 0.25), z], axis=1))


def test_a_place_on_a_member_lies_along_it():
    start, end = np.array([0.1, 0.2, 0.3]), np.array([0.7, 0.2, 1.1 - 0.05])
    along = np.linspace(0.0, np.linalg.norm(end - start), COUNT)
    located = at(effects.point_mass(positions.Member(start, end), 0.1), **{"at.along": along})
    np.testing.assert_allclose(located, np.linspace(start, end, COUNT), atol=1e-12)


def test_any_other_place_says_itself_where_it_is():
    ball = positions.Ball((0.5, 0.5, 0.5), 0.2)
    shares = {f"at.share.{axis}": np.linspace(0.1, 0.9, COUNT) for axis in (1, 2, 3)}
    located = at(effects.point_mass(ball, 0.1), **shares)
    distribution = (SPACE + effects.point_mass(ball, 0.1)).structure.effects["point_mass"].at
    coordinates = jax.jit(
        lambda *share: places.InBall(
            share, distribution.centre, distribution.radius, distribution.bounds
        ).coordinates()
    )
    for place, share in zip(located, zip(*shares.values(), strict=True), strict=True):
        np.testing.assert_allclose(place, coordinates(*share))
    assert np.all(np.linalg.norm(located - 0.5, axis=1) < 0.2)


@pytest.mark.parametrize(
    ("effect", "place"),
    [
        (effects.point_mass((0.1, 0.9, 0.4), dist.Uniform(0, 1)), (0.1, 0.9, 0.4)),
        (effects.region_stiffness_loss("right half", 0.1), MIDDLES["right half"]),
        (effects.member_preload("strut", 10.0), MIDDLES["strut"]),
        (effects.gain_error("s2", 0.1), RECORDED["s2"]),
        (effects.reversed_sensor("s1"), RECORDED["s1"]),
    ],
    ids=lambda effect: getattr(effect, "name", None),
)
def test_what_has_no_place_of_its_own_sits_where_its_part_or_sensor_does(effect, place):
    np.testing.assert_allclose(at(effect), [place] * COUNT)


@pytest.mark.parametrize(
    ("name", "words"), [("left", "region left"), ("region left", "region left")]
)
def test_what_a_part_is_is_told_once(monkeypatch, name, words):
    loss = effects.region_stiffness_loss(name, 0.1)
    monkeypatch.setattr(type(loss), "names", staticmethod(lambda _: (name,)))
    assert loss.setting(SPACE.structure.modes, SPACE.instruments) == words


@pytest.mark.parametrize(
    "effect",
    [
        effects.time_delay(1e-4),
        effects.sensor_mass(0.1),
        effects.hysteretic_damping(0.1),
        effects.region_stiffness_loss("nowhere", 0.1),
    ],
    ids=lambda effect: effect.name,
)
def test_nothing_is_made_up_for_what_has_no_known_place(effect):
    assert np.isnan(at(effect)).all()


def test_regions_and_supports_of_matrices_sit_in_their_middle():
    plate = Plate(cells=(4, 2), size=(0.4, 0.3))
    left = plate.part(lambda x, y: x < 0.2)
    matrices = bp.finite_elements.Matrices(
        **plate.model(), regions={"left": left, "nothing": 0 * left}
    )
    edge = soft_supports.edge(matrices, np.array([0.4, 0, 0]), np.array([0.4, 0.3, 0]))
    basis = Basis(plate.mesh, ElementQuadBFS())
    modes = finite_elements.modes(
        matrices,
        interpolation.scikit_fem(basis, axes=(3,)),
        up_to=500.0,
        soft={"right edge": edge},
    )
    middles = dict(modes.centres)
    assert set(middles) == {"left", "right edge"}
    np.testing.assert_allclose(middles["left"], (0.1, 0.15, 0.0))
    np.testing.assert_allclose(middles["right edge"], (0.4, 0.15, 0.0))
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=(0.1, 0.1, 0.0))],
        actuators=[bp.Actuator("a1", at=(0.3, 0.1, 0.0))],
        frequency=[20.0, 50.0],
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )
    soft = at(effects.soft_support("right edge", 1e-6), experiment)
    np.testing.assert_allclose(soft, [(0.4, 0.15, 0.0)] * COUNT)


def test_on_a_line_there_is_x_alone():
    nothing = np.full(COUNT, np.nan)
    mass = at(effects.point_mass(dist.Uniform(0, 1), 0.1), LINE, at=0.1 * POINTS)
    np.testing.assert_array_equal(mass, np.stack([0.1 * POINTS, nothing, nothing], axis=1))
    gain = at(effects.gain_error("s2", 0.1), LINE)
    np.testing.assert_array_equal(gain[:, 0], 0.7)
    assert np.isnan(gain[:, 1:]).all()


def test_no_other_field_is_taken_for_a_coordinate():
    delay = at(effects.tuned_absorber((0.2, 0.3, 0.4), 0.1, 50.0, 0.1), **{"attenuation.x": POINTS})
    np.testing.assert_allclose(delay, [(0.2, 0.3, 0.4)] * COUNT)


def test_places_found_are_those_at_the_means():
    support = positions.Box((0.5, 0.25, 0.125), within=(0.25, 0.0, 0.125))
    extended = SPACE + effects.point_mass(support, 0.1) + effects.time_delay(1e-4)
    extended = extended + effects.member_preload("strut", 10.0)
    means = {"at.x": 0.31, "at.z": 0.2}
    means = {f"structure.effects.point_mass.{name}": value for name, value in means.items()}
    located = effect_locations(extended, means | {"sensor.s1.position": 0.1})
    assert located == {"point_mass": (0.31, 0.25, 0.2), "axial_preload": MIDDLES["strut"]}


def test_places_found_on_a_line_are_numbers():
    extended = LINE + effects.point_mass(dist.Uniform(0, 1), 0.1)
    assert effect_locations(extended, {"structure.effects.point_mass.at": 0.42}) == {
        "point_mass": 0.42
    }


@pytest.fixture(scope="module")
def chain():
    """Three masses, of which the motion is known at these alone."""
    matrices = finite_elements.Matrices(
        stiffness=np.diag([2.0, 2.0, 1.0]) - np.eye(3, k=1) - np.eye(3, k=-1),
        mass=np.eye(3),
        position=[(0.2 * node, 0.0, 0.0) for node in (1, 2, 3)],
        dof=[(node, 1) for node in (1, 2, 3)],
    )
    modes = finite_elements.modes(matrices, interpolation.nearest(matrices), up_to=10.0)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=(0.2, 0.0, 0.0))],
        actuators=[bp.Actuator("a1", at=(0.4, 0.0, 0.0))],
        frequency=np.linspace(0.02, 0.35, 40),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Relative(0.01, 0.0),
    )


def test_headline_table_claim_and_place_tell_the_node_of_the_best_fit(chain):
    """Between nodes the data say nothing of a place, so that its mean is none."""
    heavier = chain + effects.point_mass((0.6, 0.0, 0.0), 0.2)
    somewhere = positions.Cartesian(dist.Uniform(0.2, 0.6), 0.0, 0.0)
    candidate = effects.point_mass(somewhere, dist.LogUniform(0.02, 2.0))
    null = null_hypothesis(chain, chain.data(heavier.nominal_measurement()))
    (found,) = extended([[(null, candidate)]], lambda: None)
    model = fitted_model(found, {})
    (effect,) = found.problem.experiment.effects
    entry = _entry(effect, found, model.parameters, 1.0, 1.0)
    assert effect_locations(found.problem.experiment, model.values) == {
        "point_mass": pytest.approx((0.6, 0.0, 0.0))
    }
    assert model.in_words("point_mass").endswith(" at x 600 mm")
    assert model.description().startswith("at x 600 mm")
    np.testing.assert_allclose(entry["place_m"], [(0.6, 0.0, 0.0)])


def test_where_the_motion_is_known_at_nodes_alone_a_place_is_told_as_its_node(chain):
    """A strut whose ends lie on either side of the edge between two nodes joins these."""
    strut = effects.strut((0.4999, 0.0, 0.0), (0.5001, 0.0, 0.0), bp.effects.Spring(9.0))
    joined = chain + strut
    told = ends(*joined.effects, joined, {}, 1)
    np.testing.assert_allclose(np.concatenate(told)[:, 0], [0.4, 0.6])
