"""Simulated measurement of a bar with a clamp left on it.

It writes hidden_effect.uff and hidden_effect_truth.json, and does not use bayes_placement: the
finite elements are those of bar_measurement, with an attached mass.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

try:
    from models import bar_measurement as bar
except ImportError:  # as a script, this folder is searched instead of the one above it
    import bar_measurement as bar

NOMINAL_YOUNGS_MODULUS, YOUNGS_MODULUS = bar.YOUNGS_MODULUS, 1.03e9  # Pa
NOMINAL_DAMPING_RATIO, DAMPING_RATIO = 0.04, 0.03
CLAMP = {"mass_kg": 0.06 * bar.DENSITY * bar.AREA * bar.LENGTH, "position_m": 0.37}

# No two are mirror images: the bar is symmetric, and symmetric positions would hide on which half
# the clamp is.
SENSORS = [
    {"name": "s1", "recorded_position_m": 0.16, "true_position_m": 0.172},
    {"name": "s2", "recorded_position_m": 0.47, "true_position_m": 0.455},
    {"name": "s3", "recorded_position_m": 0.71, "true_position_m": 0.728},
]
ACTUATOR = {"name": "a1", "recorded_position_m": 0.25, "true_position_m": 0.233}
TOLERANCE = 0.03  # m, plus and minus

FREQUENCY = np.arange(20.0, 1600.0, 8.0)  # Hz
RELATIVE_NOISE, FLOOR, AVERAGES, SEED = 0.01, 0.05, 32, 20240918


def accelerance(
    frequency: np.ndarray, elements: int = bar.ELEMENTS, clamp: dict[str, float] = CLAMP
) -> np.ndarray:
    """Accelerance [(m/s^2)/N] of shape (sensor, frequency), by a direct solve at each line [Hz].

    The damping is that of the modes of the bar without the clamp. The sensors have no mass, so that
    a sensor roved over three positions measures what three sensors would.
    """
    stiffness, mass = bar.matrices(elements)
    stiffness = stiffness * YOUNGS_MODULUS / NOMINAL_YOUNGS_MODULUS
    losses = bar.damping(stiffness, mass, first=(), further=DAMPING_RATIO)
    at_clamp = bar.shape_functions(clamp["position_m"], elements)
    mass = mass + clamp["mass_kg"] * np.outer(at_clamp, at_clamp)
    sensors = [bar.shape_functions(sensor["true_position_m"], elements) for sensor in SENSORS]
    actuator = bar.shape_functions(ACTUATOR["true_position_m"], elements)
    return bar.solved((stiffness, losses, mass), np.array(sensors), actuator, frequency).T


def measured(exact: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add circular complex Gaussian noise; return FRF and coherence.

    The noise is 1 % of the modulus, with a floor at antiresonances. The coherence g2 obeys
    E|error|^2 = |H|^2 (1 - g2) / (n g2) exactly, with the measured H.
    """
    generator = np.random.default_rng(SEED)
    real, imaginary = generator.standard_normal((2, *exact.shape)) / np.sqrt(2)
    level = np.sqrt(np.mean(np.abs(exact) ** 2, axis=1, keepdims=True))
    deviation = RELATIVE_NOISE * np.maximum(np.abs(exact), FLOOR * level)
    frf = exact + deviation * (real + 1j * imaginary)
    return frf, 1 / (1 + AVERAGES * deviation**2 / np.abs(frf) ** 2)


def datasets(frf: np.ndarray, coherence: np.ndarray) -> list[dict[str, Any]]:
    """Datasets of the universal file: units, recorded nodes, functions."""
    units, nodes, *_ = bar.datasets(FREQUENCY, frf[0], coherence[0])
    numbers = [*range(1, len(SENSORS) + 1), nodes["node_nums"][-1]]
    positions = [transducer["recorded_position_m"] for transducer in [*SENSORS, ACTUATOR]]
    zeros = [0] * len(positions)
    systems = {"def_cs": zeros, "disp_cs": zeros, "color": zeros}
    geometry = {"x": positions, "y": [0.0] * len(positions), "z": [0.0] * len(positions)}
    functions = [
        function
        for node, sensor, *values in zip(numbers, SENSORS, frf, coherence, strict=False)
        for function in _functions(node, sensor["name"], *values)
    ]
    return [units, {**nodes, "node_nums": numbers, **systems, **geometry}, *functions]


def _functions(node: int, name: str, frf: np.ndarray, coherence: np.ndarray) -> list[dict]:
    """FRF and coherence of a sensor; ID lines 4 and 5 hold averages and names."""
    pair = f"{name}+x / {ACTUATOR['name']}+x"
    fields = {
        "id2": f"bar run {node}",
        "id4": json.dumps({"averages": AVERAGES}),
        "id5": json.dumps({"names": [name, ACTUATOR["name"]]}),
        "rsp_node": node,
    }
    acceleration, coherence_fields = bar.datasets(FREQUENCY, frf, coherence)[2:]
    return [
        {**acceleration, **fields, "id1": f"FRF {pair}"},
        {**coherence_fields, **fields, "id1": f"Coherence {pair}"},
    ]


def truth() -> dict[str, Any]:
    """True values behind the measurement, and how it was made."""
    return {
        "hidden_effect": {"name": "point_mass", "what": "a clamp left on the bar", **CLAMP},
        "structure": {
            "type": "bar, fixed at both ends",
            "length_m": bar.LENGTH,
            "area_m2": bar.AREA,
            "youngs_modulus_Pa": YOUNGS_MODULUS,
            "nominal_youngs_modulus_Pa": NOMINAL_YOUNGS_MODULUS,
            "density_kg_m3": bar.DENSITY,
        },
        "damping_ratio": DAMPING_RATIO,
        "nominal_damping_ratio": NOMINAL_DAMPING_RATIO,
        "sensors": SENSORS,
        "sensor_setup": "one massless sensor, roved over three places",
        "actuator": ACTUATOR,
        "position_tolerance_m": TOLERANCE,
        "quantity": "accelerance",
        "relative_noise": RELATIVE_NOISE,
        "noise_floor_as_share_of_root_mean_square": RELATIVE_NOISE * FLOOR,
        "averages": AVERAGES,
        "seed": SEED,
        "quadratic_elements": bar.ELEMENTS,
    }


def main(folder: Path) -> None:
    """Write hidden_effect.uff and hidden_effect_truth.json into a folder."""
    file = pyuff.UFF(str(folder / "hidden_effect.uff"))
    file.write_sets(datasets(*measured(bar.rounded(accelerance(FREQUENCY)))), mode="overwrite")
    text = json.dumps(truth(), indent=1) + "\n"
    (folder / "hidden_effect_truth.json").write_text(text)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    main(parser.parse_args().folder)
