"""The 95 % interval of a law as measured holds it at 95 % of lines, whatever else is unknown."""

import dataclasses

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.reach._as_measured import as_measured
from bayes_placement.criticism.reach._at_port import ReachOfPort, rows_of
from bayes_placement.criticism.reach._free_law import FreeLaw
from bayes_placement.criticism.reach._named_laws import _in_full
from bayes_placement.criticism.reach._ports import ports_of
from bayes_placement.inference.residuals import Problem
from bayes_placement.laws.rows import DECADES, NUMBERS
from tests.criticism.reach import cantilever
from tests.simulator import fine_beams

LINES = np.geomspace(8.0, 900.0, 16)
OMEGA = 2 * np.pi * LINES
NOISE = 1e-4
REPLICATES = 16
STEP = fine_beams.SIZE

MIDDLE = np.sqrt(OMEGA[0] * OMEGA[-1])

# Kind of port, the law [N/m] or [N m/rad], its network, and how stiff its elements are at MIDDLE.
HIDDEN = {
    "displacement": (cantilever.maxwell, ["-", "c", "k"], [6.0 * MIDDLE, 4e3]),
    "rotation": (cantilever.spring_on_slope, "k", [40.0]),
    "cut": (lambda omega: 700.0 * (1 + 0.1j) + 0.0 * omega, "h", [700.0]),
}


def setup():
    known = cantilever.experiment()
    loss = bp.damping.Structural(dist.LogUniform(0.003, 0.03))
    return bp.Experiment(
        dataclasses.replace(known.structure, damping=loss),
        sensors=[*known.sensor.values()],
        actuators=[*known.actuator.values()],
        frequency=LINES,
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(NOISE),
    )


def truth(random):
    """Everything that is unknown, places at nodes of the mesh."""
    moved = STEP * random.integers(-3, 4, 4)
    sensors = [recorded for recorded, _ in cantilever.SENSORS.values()]
    recorded = STEP * np.round(np.array([*sensors, cantilever.DRIVEN[0]]) / STEP)
    return {
        "places": list(recorded + moved),
        "at": STEP * random.integers(60, 180),
        "modulus": random.uniform(0.95, 1.05),
        "loss": 0.003 * 10 ** random.uniform(0.1, 0.9),
    }


def mobility(kind, law, true):
    """FRFs of a mesh with noise."""
    stiffness, _ = fine_beams.matrices()
    elastic = true["modulus"] * (1 + 1j * true["loss"]) - 1
    if kind == "cut":
        # The mesh is softer by a factor that is put on the law and on the response.
        stretched = np.sqrt(1 + elastic)
        receptance = fine_beams.cut_open(
            true["places"], OMEGA / stretched, true["at"], lambda w: law(w) / (1 + elastic), 1
        ) / (1 + elastic)
    else:
        port = fine_beams.outer(fine_beams.row(true["at"], slope=kind == "rotation"))
        receptance = fine_beams.receptance(
            true["places"], OMEGA, lambda w: elastic * stiffness + law(w) * port
        )
    return 1j * OMEGA * receptance[:-1, -1:]


def fitted(kind, true, frf):
    """The network at the port, fitted from where it is."""
    experiment = setup()
    _, tree, stiff = HIDDEN[kind]
    port = next(port for port in ports_of(experiment) if port.acts_on == kind)
    measured = bp.Measurement.from_arrays(
        frf,
        LINES,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="mobility",
    )
    problem = Problem(experiment, experiment.data(measured)).with_effect(port.effect)
    free = FreeLaw(problem)
    rows = rows_of(port, free)
    values = {
        "structure.modes.youngs_modulus": true["modulus"] * fine_beams.STIFFNESS,
        "structure.damping.loss_factor": true["loss"],
        f"structure.effects.{port.effect.name}.at": true["at"],
    }
    names = [*(f"sensor.{name}.position" for name in cantilever.SENSORS), "actuator.a1.position"]
    values |= dict(zip(names, true["places"], strict=True))
    start = np.array(problem.coordinates.vector(values))
    numbers = np.zeros(NUMBERS)
    numbers[: len(stiff)] = np.log10(np.array(stiff) / rows.size) / DECADES
    law = np.concatenate([start, numbers, [rows.trees.index(tree)]])
    (named,) = _in_full(ReachOfPort(port, free, *[None] * 4), rows, law[None], 1)
    return named, problem


def deviations(kind):
    """How far the true law is from what is read, in deviations [replicate, part, line]."""
    law, *_ = HIDDEN[kind]
    exact = law(OMEGA) if kind != "cut" else 1 / law(OMEGA)
    random = np.random.default_rng(0)
    rows = []
    for _ in range(REPLICATES):
        true = truth(random)
        frf = mobility(kind, law, true)
        frf = frf + NOISE * (random.standard_normal((*frf.shape, 2)) @ [1, 1j])
        named, problem = fitted(kind, true, frf)
        assert named.fit.squares < problem.count + 5 * np.sqrt(2 * problem.count), true
        table = as_measured(named, FreeLaw(problem))
        rows.append(
            [
                (table[part] - of_law) / table[f"deviation_{part}"]
                for part, of_law in (("real", exact.real), ("imaginary", exact.imag))
            ]
        )
    return np.array(rows)


@pytest.mark.parametrize(
    "kind",
    [
        "displacement",
        pytest.param("cut", marks=pytest.mark.long),
        pytest.param("rotation", marks=[pytest.mark.long, pytest.mark.longest]),
    ],
)
def test_the_interval_at_a_line_holds_the_law_at_95_percent_of_lines(kind):
    inside = np.abs(deviations(kind)) < 1.96
    # Lines share the unknowns, replicates share nothing.
    shares = inside.mean(axis=(1, 2))
    error = np.hypot(shares.std() / np.sqrt(REPLICATES), 0.005)
    # A line has a part in what the unknowns are known by: where lines are few, more are inside.
    assert 0.95 - 3 * error < shares.mean() < 0.99, (shares.mean(), error)
