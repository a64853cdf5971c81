"""Simulated measurement of a bar: writes bar.uff and bar_truth.json.

It does not use bayes_placement. A fine finite element model, solved directly at each line, replaces
the real bar, so that no model of the package is checked against itself.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyuff
import scipy.linalg

LENGTH, AREA, YOUNGS_MODULUS, DENSITY = 1.0, 1e-3, 1e9, 9000.0  # m, m^2, Pa, kg/m^3
ELEMENTS = 200

# The first two ratios differ from the nominal 0.04 and from each other: equal true values would
# hide an exchange of the two.
DAMPING_RATIOS, FURTHER_DAMPING_RATIO = (0.035, 0.047), 0.04

SENSOR = {"name": "s1", "recorded_position_m": 0.25, "true_position_m": 0.262}
ACTUATOR = {"name": "a1", "recorded_position_m": 0.30, "true_position_m": 0.283}
TOLERANCE = 0.04  # m, plus and minus

LINES, SPACING = 100, 4.33  # Hz; lines 5, 15, ..., 95 are the ten of the paper
RELATIVE_NOISE, AVERAGES, SEED = 0.01, 16, 20240917


def matrices(elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Assemble stiffness [N/m] and mass [kg] of quadratic elements, both ends fixed.

    Returns arrays of shape (node, node) without the two fixed nodes.
    """
    size = LENGTH / elements
    rigidity = YOUNGS_MODULUS * AREA
    stiffness = rigidity / (3 * size) * np.array([[7, -8, 1], [-8, 16, -8], [1, -8, 7]])
    mass = DENSITY * AREA * size / 30 * np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]])
    return _assembled(stiffness, elements), _assembled(mass, elements)


def _assembled(element: np.ndarray, elements: int) -> np.ndarray:
    nodes = 2 * elements + 1
    matrix = np.zeros((nodes, nodes))
    for first in range(0, nodes - 1, 2):
        matrix[first : first + 3, first : first + 3] += element
    return matrix[1:-1, 1:-1]


def damping(
    stiffness: np.ndarray,
    mass: np.ndarray,
    first: tuple[float, ...] = DAMPING_RATIOS,
    further: float = FURTHER_DAMPING_RATIO,
) -> np.ndarray:
    """Damping matrix [N s/m] D = M Phi diag(2 xi w) Phi' M with every mode of the mesh.

    Damping ratios are those of the first modes and a common one of all further modes.
    """
    eigenvalues, shapes = scipy.linalg.eigh(stiffness, mass)
    ratios = np.full(eigenvalues.size, further)
    ratios[: len(first)] = first
    mass_times_shapes = mass @ shapes
    return mass_times_shapes * (2 * ratios * np.sqrt(eigenvalues)) @ mass_times_shapes.T


def shape_functions(position: float, elements: int) -> np.ndarray:
    """Row of shape functions that gives the displacement at a position [m]."""
    element, local = divmod(position * elements / LENGTH, 1.0)
    row = np.zeros(2 * elements + 1)
    first = 2 * int(element)
    row[first : first + 3] = (
        (1 - local) * (1 - 2 * local),
        4 * local * (1 - local),
        local * (2 * local - 1),
    )
    return row[1:-1]


def accelerance(frequency: np.ndarray, elements: int = ELEMENTS) -> np.ndarray:
    """Accelerance [(m/s^2)/N] between the true positions, by a direct solve at each line [Hz]."""
    stiffness, mass = matrices(elements)
    sensor = shape_functions(SENSOR["true_position_m"], elements)
    actuator = shape_functions(ACTUATOR["true_position_m"], elements)
    system = stiffness, damping(stiffness, mass), mass
    return solved(system, sensor, actuator, frequency)


def solved(
    system: tuple[np.ndarray, np.ndarray, np.ndarray],
    sensors: np.ndarray,
    actuator: np.ndarray,
    frequency: np.ndarray,
) -> np.ndarray:
    """Accelerance of stiffness, damping and mass, by a direct solve at each line [Hz].

    Returns an array of shape (frequency,) for a row of shape functions of a sensor, and of shape
    (frequency, sensor) for the rows of several.
    """
    stiffness, losses, mass = system
    values = []
    for omega in 2 * np.pi * frequency:
        dynamic_stiffness = stiffness + 1j * omega * losses - omega**2 * mass
        # Twice as fast as the solver of complex symmetric matrices.
        displacement = scipy.linalg.solve(dynamic_stiffness, actuator, assume_a="gen")
        values.append(-(omega**2) * (sensors @ displacement))
    return np.array(values)


def measured(exact: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add circular complex Gaussian noise; return FRF and coherence.

    The coherence g2 obeys E|error|^2 = |H|^2 (1 - g2) / (n g2) exactly, with the measured H.
    """
    generator = np.random.default_rng(SEED)
    real, imaginary = generator.standard_normal((2, exact.size)) / np.sqrt(2)
    deviation = RELATIVE_NOISE * np.abs(exact)
    frf = exact + deviation * (real + 1j * imaginary)
    return frf, 1 / (1 + AVERAGES * deviation**2 / np.abs(frf) ** 2)


def rounded(values: np.ndarray) -> np.ndarray:
    """Round to a millionth of the modulus, the accuracy of the mesh.

    Linear algebra libraries differ by 1e-11 of it and would otherwise give different files.
    """
    digits = (6 - np.floor(np.log10(np.abs(values)))).astype(int)
    return np.array(
        [
            complex(round(value.real, count), round(value.imag, count))
            for value, count in zip(values.ravel().tolist(), digits.ravel().tolist(), strict=True)
        ]
    ).reshape(values.shape)


def datasets(frequency: np.ndarray, frf: np.ndarray, coherence: np.ndarray) -> list[dict[str, Any]]:
    """Datasets of the universal file: units, recorded nodes, functions."""
    zeros = [0, 0]
    positions = [SENSOR["recorded_position_m"], ACTUATOR["recorded_position_m"]]
    units = {"units_code": 1, "units_description": "SI", "temp_mode": 1, "length": 1.0}
    nodes = {"node_nums": [1, 101], "def_cs": zeros, "disp_cs": zeros, "color": zeros}
    acceleration = {
        "id1": "FRF s1+x / a1+x",
        "func_type": 4,
        "func_id": 1,
        "ordinate_spec_data_type": 12,
        "ordinate_axis_lab": "Acceleration",
        "ordinate_axis_units_lab": "m/s^2",
        "orddenom_spec_data_type": 13,
        "orddenom_axis_lab": "Excitation force",
        "orddenom_axis_units_lab": "N",
    }
    coherence_fields = {
        "id1": "Coherence s1+x / a1+x",
        "func_type": 6,
        "func_id": 2,
        "ordinate_spec_data_type": 0,
        "ordinate_axis_lab": "Coherence",
        "orddenom_spec_data_type": 0,
    }
    return [
        {"type": 164, **units, "force": 1.0, "temp": 1.0, "temp_offset": 0.0},
        {"type": 2411, **nodes, "x": positions, "y": [0.0, 0.0], "z": [0.0, 0.0]},
        {**acceleration, **_function(frequency), "data": frf},
        {**coherence_fields, **_function(frequency), "data": coherence},
    ]


def _function(frequency: np.ndarray) -> dict[str, Any]:
    """Fields that the FRF and its coherence share; ID lines 4 and 5 hold averages and names."""
    return {
        "type": 58,
        "id2": "bar run 1",
        "id4": json.dumps({"averages": AVERAGES}),
        "id5": json.dumps({"names": [SENSOR["name"], ACTUATOR["name"]]}),
        "rsp_node": 1,
        "rsp_dir": 1,
        "ref_node": 101,
        "ref_dir": 1,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 18,
        "abscissa_axis_lab": "Frequency",
        "abscissa_axis_units_lab": "Hz",
        "x": frequency,
    }


def truth() -> dict[str, Any]:
    """True values behind the measurement, and how it was made."""
    return {
        "structure": {
            "type": "bar, fixed at both ends",
            "length_m": LENGTH,
            "area_m2": AREA,
            "youngs_modulus_Pa": YOUNGS_MODULUS,
            "density_kg_m3": DENSITY,
        },
        "damping_ratios": list(DAMPING_RATIOS),
        "damping_ratio_of_further_modes": FURTHER_DAMPING_RATIO,
        "sensor": SENSOR,
        "actuator": ACTUATOR,
        "position_tolerance_m": TOLERANCE,
        "quantity": "accelerance",
        "relative_noise": RELATIVE_NOISE,
        "averages": AVERAGES,
        "seed": SEED,
        "quadratic_elements": ELEMENTS,
    }


def main(folder: Path) -> None:
    """Write bar.uff and bar_truth.json into a folder."""
    frequency = SPACING * np.arange(1, LINES + 1)
    frf, coherence = measured(rounded(accelerance(frequency)))
    file = pyuff.UFF(str(folder / "bar.uff"))
    file.write_sets(datasets(frequency, frf, coherence), mode="overwrite")
    (folder / "bar_truth.json").write_text(json.dumps(truth(), indent=1) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    main(parser.parse_args().folder)
