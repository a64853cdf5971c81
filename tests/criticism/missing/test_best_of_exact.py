"""Two effects beside a model error: what explains most without one is compared with it too."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp

MASS, STIFFNESS = np.array([42.0, 40.0, 40.0, 33.0]), 1e6 * np.array([3.2, 3.0, 3.0, 2.6])
LINES = np.arange(4.0, 70.0, 0.25)
DAMPING = [0.008, 0.009, 0.011, 0.013]
"""Of each mode; the model has one for all, so that it errs in damping by a fifth."""


def storeys():
    """Stiffness of each storey of a chain of four floors, by name."""
    differences = np.eye(4) - np.eye(4, k=-1)
    parts = zip(STIFFNESS, differences, strict=True)
    return {f"storey {n}": k * np.outer(d, d) for n, (k, d) in enumerate(parts, 1)}


def frf(factors):
    """Acceleration over force [m/s2/N] of the chain, its storeys scaled, by modal superposition."""
    stiffness = sum(f * part for f, part in zip(factors, storeys().values(), strict=True))
    root = np.diag(MASS**-0.5)
    squares, vectors = np.linalg.eigh(root @ stiffness @ root)
    shapes, natural, omega = root @ vectors, np.sqrt(squares), 2 * np.pi * LINES[:, None]
    modal = -(omega**2) / (squares - omega**2 + 2j * np.array(DAMPING) * natural * omega)
    return np.einsum("sm,am,lm->sal", shapes, shapes, modal)


@pytest.mark.long
def test_a_soft_storey_is_named_beside_a_reversed_sensor_and_another_damping():
    """With the reversed sensor alone a model error of the stiffness explains the data as well."""
    clean = frf([1.0, 1.0, 0.8, 1.0])[:, [1, 3]]
    clean[2] *= -1
    parts = np.random.default_rng(4).normal(size=(2, *clean.shape)) / np.sqrt(2)
    noisy = clean + 0.015 * np.abs(clean) * (parts[0] + 1j * parts[1])
    matrices = bp.finite_elements.Matrices(
        stiffness=sum(storeys().values()),
        mass=np.diag(MASS),
        position=[(0, 0, 0.3 * n) for n in range(1, 5)],
        dof=[(n, 1) for n in range(1, 5)],
        regions=storeys(),
    )
    nearest = bp.finite_elements.interpolation.nearest(matrices)
    modulus = dist.Uniform(0.9, 1.1)
    modes = bp.finite_elements.modes(matrices, nearest, up_to=200.0, youngs_modulus=modulus)
    at = [{"at": (0, 0, 0.3 * n), "directions": (1,)} for n in range(1, 5)]
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.003, 0.03))),
        sensors=[bp.Sensor(f"F{n}", **where) for n, where in enumerate(at, 1)],
        actuators=[bp.Actuator(f"H{n}", **at[n - 1]) for n in (2, 4)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Relative(dist.LogUniform(1e-3, 0.1)),
    )
    measured = bp.Measurement.from_arrays(
        noisy,
        LINES,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="acceleration",
    )
    kinds = ["reversed_sensor", "local_stiffness_loss", "point_mass", "gain_error"]
    candidates = bp.effects.library(experiment, kinds)
    ledger = bp.improve(experiment, measured, candidates=candidates)
    assert ledger.verdict == ("local_stiffness_loss", "reversed_sensor")
    assert not any(ledger.standing.doubts.values())
    loss = next(v for n, v in ledger.steps[-1].parameters.items() if n.endswith(".loss"))
    deviation = loss.standard_deviation
    assert deviation < 1e-3 and loss.mean == pytest.approx(0.2, abs=4 * deviation)
    sizes = ledger.steps[-1].model_error
    assert sizes["damping"].mean > 0.05 > 1e-3 > sizes["stiffness_and_mass"].mean
