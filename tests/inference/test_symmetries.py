"""Moves between placements undo themselves, keep volume, and fit the experiment."""

import jax
import jax.numpy as jnp
import numpy as np

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.inference.symmetries import symmetries
from models import bar, free_free_beam

VALUES = {"sensor.s1.position": jnp.asarray(0.23), "actuator.a1.position": jnp.asarray(0.31)}


def test_the_bar_has_a_mirror_and_an_exchange():
    mirror, exchange = symmetries(bar.placed(0.25, 0.30, None))
    assert {n: round(float(v), 9) for n, v in mirror(VALUES).items()} == {
        "sensor.s1.position": 0.77,
        "actuator.a1.position": 0.69,
    }
    assert exchange(VALUES)["sensor.s1.position"] == VALUES["actuator.a1.position"]


def predicted(experiment, values):
    return compiled(bp.Experiment.predict)(experiment.fix(values))


def test_every_move_undoes_itself_and_keeps_volume():
    for move in symmetries(bar.placed(0.25, 0.30, None)):
        again = move(move(VALUES))
        for name, value in VALUES.items():
            np.testing.assert_allclose(again[name], value)
        jacobian = jax.jacobian(lambda v, move=move: jnp.stack(list(move(v).values())))(VALUES)
        matrix = np.array([jacobian[name] for name in VALUES])
        np.testing.assert_allclose(abs(np.linalg.det(matrix)), 1.0)


def test_both_moves_change_no_response_of_the_bar():
    experiment = bar.placed(0.25, 0.30, None, structure=bar.bar(0.03, 0.05))
    moved = [values | move(values) for values in [VALUES] for move in symmetries(experiment)]
    expected = predicted(experiment, VALUES)
    for values in moved:
        np.testing.assert_allclose(predicted(experiment, values), expected, rtol=1e-9)


def test_only_a_single_pair_is_exchanged():
    assert len(symmetries(free_free_beam.experiment)) == 1


def test_known_positions_have_no_moves():
    assert symmetries(bar.placed(0.25, 0.30, None).fix(VALUES)) == ()


def test_other_unknowns_are_left_alone():
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.1))
    values = VALUES | {"structure.damping.ratio.1": 0.03}
    assert all(move(values)["structure.damping.ratio.1"] == 0.03 for move in symmetries(experiment))


def with_errors(experiment, seed):
    """The experiment with a model error of each kind, and values of all that is unknown."""
    erroneous = experiment.with_model_error(
        bp.model_error.Embedded(
            frequency=0.02, damping=0.2, shape=0.1, gain=0.05, stiffness_and_mass=0.1
        )
    )
    random = np.random.default_rng(seed)
    values = {
        unknown.name: jnp.asarray(random.normal(size=unknown.distribution.shape()))
        for unknown in erroneous.unknowns
    }
    return erroneous, values | {
        unknown.name: jnp.asarray(random.uniform(0.1, 0.45))
        for unknown in erroneous.unknowns
        if unknown.is_placement
    }


def test_errors_of_the_model_are_mirrored_and_exchanged_with_the_places():
    beam = bp.beams.beam(
        8,
        length=1.0,
        area=1.0,
        radius_of_gyration=1.0,
        youngs_modulus=200.0,
        density=1.0,
        ends="free-free",
        direction=1,
    )
    anywhere = bp.positions.Segment(0.5, within=0.5)
    plain = bp.Experiment(
        bp.Structure(beam, damping=bp.damping.Modal(0.01)),
        sensors=[bp.Sensor("s1", at=anywhere)],
        actuators=[bp.Actuator("a1", at=anywhere)],
        frequency=np.linspace(20.0, 300.0, 8),
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )
    experiment, values = with_errors(plain, 1)
    expected = predicted(experiment, values)
    moves = symmetries(experiment)
    assert len(moves) == 2
    for move in moves:
        moved = move(values)
        np.testing.assert_allclose(predicted(experiment, moved), expected, rtol=1e-7)
        again = move(moved)
        assert all(np.allclose(again[name], value) for name, value in values.items())
