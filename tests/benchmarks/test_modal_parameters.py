"""Benchmark: hidden effects of open line cases from the first six modes alone.

Run with `python -m pytest tests/benchmarks/test_modal_parameters.py -n 0 -s -m long`.

Modal parameters are those of fine elements with the truth of the case and errors of stated
deviations: poles by a state space of all modes of the mesh, shapes at the true places.
"""

import json
import time

import numpy as np
import pytest
from scipy.linalg import eig

import bayes_placement as bp
from bayes_placement.io import case
from tests.simulator.fine_elements import NOTHING, Line, effect, plant

MODES = 6
FREQUENCY, DAMPING, SHAPE = 5e-4, 0.02, 0.01
"""Relative deviations of natural frequencies, damping ratios, and of shapes to their greatest."""

ENDS = {"bar": "fixed-fixed", "cantilever": "fixed-free"}


def line_of(case_file, truth):
    """The true structure."""
    nominal, true = case_file["structure"], truth["h_true"]
    is_bar = truth["structure"] == "bar"
    width, height = (0.0, 0.0) if is_bar else (nominal["width_m"], nominal["height_m"])
    return Line(
        kind="bar" if is_bar else "beam",
        ends=ENDS[truth["structure"]],
        length=nominal["length_m"],
        area=nominal["area_m2"] if is_bar else width * height,
        youngs_modulus=true["youngs_modulus_Pa"],
        density=true.get("density_kg_m3", nominal["density_kg_m3"]),
        damping_ratio=true["modal_damping_ratio"],
        second_moment=width * height**3 / 12,
    )


def hidden_in(truth, line):
    """The structural part of the truth, and the mass and dashpot that are attached at a place."""
    (stated,) = truth["effects"]
    numbers, place, mass, viscosity = stated["parameters"], 0.0, 0.0, 0.0
    hidden = NOTHING
    if stated["name"] == "compliant_support":
        hidden = effect("compliant_support", end="left", compliance=1 / numbers["k_rot"])
    elif stated["name"] == "local_stiffness_loss":
        low, high = numbers["segment"]
        hidden = effect(
            "local_stiffness_loss", at=(low + high) / 2, extent=high - low, share=numbers["loss"]
        )
    else:
        assert stated["name"] in ("point_mass", "ground_dashpot")
        place = numbers["position"][0]
        mass, viscosity = numbers.get("mass", 0.0), numbers.get("c", 0.0)
    return hidden, place, mass, viscosity


def modal_parameters(case_file, truth, sensors):
    """Modal parameters of the first modes with errors."""
    line = line_of(case_file, truth)
    hidden, place, mass, viscosity = hidden_in(truth, line)
    system = plant(line, hidden, loaded=(place,) if mass or viscosity else ())
    natural, at = system.natural, system.rows([place])[0]
    count = natural.size
    inertia = np.eye(count) + mass * np.outer(at, at)
    damping = np.diag(2 * line.damping_ratio * natural) + viscosity * np.outer(at, at)
    zero, identity = np.zeros((count, count)), np.eye(count)
    state = np.block([[zero, identity], [-np.diag(natural**2), -damping]])
    values, vectors = eig(state, np.block([[identity, zero], [zero, inertia]]))
    upper = np.flatnonzero(values.imag > 1)
    chosen = upper[np.argsort(np.abs(values[upper]))][:MODES]
    pole, size = values[chosen], np.abs(values[chosen])
    true = [sensor["true_position"][0] for sensor in truth["sensors"]]
    sign = np.array([np.sign(sensor["directions"][0]) for sensor in truth["sensors"]])
    shapes = sign[:, None] * (system.rows(true) @ vectors[:count, chosen])
    shapes = shapes / np.max(np.abs(shapes), axis=0)
    shapes = (shapes / np.sqrt(np.sum(shapes**2, axis=0))).real
    deviation = SHAPE * np.max(np.abs(shapes), axis=0) * np.ones(shapes.shape)
    frequency, ratio = size / (2 * np.pi), -pole.real / size
    noise = np.random.default_rng(int(truth["case"][:2])).standard_normal
    return bp.ModalParameters(
        frequency * (1 + FREQUENCY * noise(MODES)),
        FREQUENCY * frequency,
        damping_ratio=ratio * (1 + DAMPING * noise(MODES)),
        damping_ratio_deviation=DAMPING * ratio,
        shape=shapes + deviation * noise(shapes.shape),
        shape_deviation=deviation,
        sensors=sensors,
    )


@pytest.mark.long
@pytest.mark.parametrize("number", ["01", "07", "11"])
def test_six_modes_name_a_hidden_effect_or_the_tool_says_that_they_cannot(shared_data, number):
    folder = next((shared_data / "cases").glob(f"{number}_*"))
    truth = json.loads((shared_data / f"cases/truth/{folder.name}.json").read_text())
    declared = case.read(folder).experiment
    case_file = json.loads((folder / "case.json").read_text())
    measured = modal_parameters(case_file, truth, declared.sensor_channels)
    experiment = bp.Experiment(
        declared.structure,
        sensors=list(declared.sensor.values()),
        observe=bp.observe.ModalData(measured),
        noise=bp.noise.FromVariance(),
    )
    began = time.perf_counter()
    ledger = bp.improve(experiment, measured)
    (hidden,) = truth["effects"]
    print(f"\n{number}, hidden: {hidden}; {time.perf_counter() - began:.0f} s\n{ledger}")
    rivals = {kind for pair in ledger.confounded for kind in pair if isinstance(kind, str)}
    named = ledger.verdict == (hidden["name"],)
    told_that_it_cannot = hidden["name"] in rivals or not ledger.verdict
    print("named" if named else "not named", "confounded:", ledger.confounded, flush=True)
    assert named or told_that_it_cannot
