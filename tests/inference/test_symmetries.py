"""Moves between placements undo themselves, keep volume, and fit the experiment."""

import jax
import jax.numpy as jnp
import numpy as np

import bayes_placement as bp
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
    expected = experiment.fix(VALUES).predict()
    for values in moved:
        np.testing.assert_allclose(experiment.fix(values).predict(), expected, rtol=1e-9)


def test_only_a_single_pair_is_exchanged():
    assert len(symmetries(free_free_beam.experiment)) == 1


def test_known_positions_have_no_moves():
    assert symmetries(bar.placed(0.25, 0.30, None).fix(VALUES)) == ()


def test_other_unknowns_are_left_alone():
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.1))
    values = VALUES | {"structure.damping.ratio.1": 0.03}
    assert all(move(values)["structure.damping.ratio.1"] == 0.03 for move in symmetries(experiment))
