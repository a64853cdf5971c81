"""A measured frame of four plates on a rail, driven by a shaker, and one wrong instrument.

Nine accelerances for one force, without coherence. The model is a handful of masses and springs:
each plate moves along the rail, the four columns of a storey are a spring, and the carriage under
the base plate lets the frame rock. Unknown: the stiffness of the storeys, whose joints are not
rigid, the mass that bolts and the shaker add, the stiffness against rocking, damping, the noise,
and the model error. Turning of the plates about the vertical is not in the model.

The measurement is not part of this project. Give the folder of `measured.npz`:
`BOOKCASE_DATA=folder bayes-placement improve models/bookcase.py`.
"""

import functools
import os
from pathlib import Path

import jax
import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement.io.model import Study

FOLDER = "BOOKCASE_DATA"
"""Environment variable that names the folder of the measurement."""

WIDTH, THICKNESS, DENSITY = 0.305, 0.0254, 2700.0
PLATE = WIDTH**2 * THICKNESS * DENSITY
"""Mass of a plate [kg]."""

PITCH = 0.1524 + THICKNESS
"""Height of a storey [m]."""

COLUMNS = 4 * 12 * 68.9e9 * 0.0254 * 0.0064**3 / 12 / 0.1524**3
"""Stiffness of the columns of a storey, clamped at both ends [N/m]."""

ROCKING = 1e5
"""Nominal stiffness against rocking [N m/rad]."""

FLOORS = ("base", "floor1", "floor2", "floor3")
CHANNELS = {
    "base_low": "base",
    "floor3_low": "floor3",
    "floor2_low": "floor2",
    "floor1_low": "floor1",
    "base_high": "base",
    "floor3_high": "floor3",
    "floor2_high": "floor2",
    "floor1_high": "floor1",
    "base_shaker": "base",
}
"""Plate on which each accelerometer sits, in the order of the file."""

BAND, LINES = (4.0, 80.0), 160


def matrices():
    """Stiffness and mass of four plates along y, and of the rotation of the frame about x."""
    height = PITCH * np.arange(4)
    storeys = {}
    for number in range(3):
        strain = np.zeros(5)
        strain[number], strain[number + 1], strain[4] = -1.0, 1.0, PITCH
        storeys[f"storey{number + 1}"] = COLUMNS * np.outer(strain, strain)
    rocking = np.diag([0.0, 0.0, 0.0, 0.0, ROCKING])
    inertia = 4 * PLATE * WIDTH**2 / 12
    added = {
        floor: np.diag(PLATE * (np.arange(5) == number)) for number, floor in enumerate(FLOORS)
    }
    model = bp.finite_elements.Matrices(
        sum(storeys.values()) + rocking,
        sum(added.values()) + np.diag([0.0, 0.0, 0.0, 0.0, inertia]),
        position=np.stack([0 * height, 0 * height, height], axis=1),
        dof=[(1, 2), (2, 2), (3, 2), (4, 2), (1, 4)],
    )
    return model, storeys | {"rocking": rocking}, added


def structure():
    """The frame, with unknown stiffness of its joints and unknown additional masses."""
    model, stiffness, mass = matrices()
    priors = {name: dist.LogUniform(0.3, 1.2) for name in stiffness if name != "rocking"}
    priors |= {"rocking": dist.LogUniform(0.01, 100.0)}
    priors |= {floor: dist.Uniform(1.0, 1.5) for floor in FLOORS}
    modes = bp.finite_elements.affine(
        model,
        bp.finite_elements.interpolation.nearest(model, axes=(2,)),
        parameters=priors,
        stiffness=stiffness,
        mass=mass,
        up_to=300.0,
    )
    return bp.Structure(modes, damping=bp.damping.Modal(dist.LogUniform(1e-3, 0.1)))


def read(folder=None):
    """Read the measurement from a folder, by default that in the environment."""
    file = Path(folder or os.environ.get(FOLDER) or "no folder") / "measured.npz"
    if not file.is_file():
        raise FileNotFoundError(
            f"{file} was given for the measurement of models/bookcase.py; a folder that holds "
            "measured.npz is needed, since the data are not part of this project. Name it: "
            f"{FOLDER}=folder bayes-placement improve models/bookcase.py."
        )
    stored = np.load(file)
    return measured(stored["frf"].astype(complex), stored["frequency_hz"])


def measured(frf, frequency):
    """Accelerances [sensor, line] for the shaker, at some lines dense where they change most."""
    inside = (frequency >= BAND[0]) & (frequency <= BAND[1])
    return bp.Measurement.from_arrays(
        frf[:, None, inside],
        frequency[inside],
        sensors=[bp.Channel(name, 2) for name in CHANNELS],
        actuators=[bp.Channel("shaker", 2)],
        quantity="accelerance",
    ).thinned(LINES)


def place(floor):
    """Position of a plate [m]."""
    return (0.0, 0.0, PITCH * FLOORS.index(floor))


def experiment_at(frequency, model_error=None):
    """Experiment at some lines, with model error and with noise of unknown level."""
    errors = bp.model_error.Embedded() if model_error is None else model_error
    return bp.Experiment(
        structure(),
        sensors=[
            bp.Sensor(name, place(floor), directions=(2,)) for name, floor in CHANNELS.items()
        ],
        actuators=[bp.Actuator("shaker", place("base"), directions=(2,))],
        frequency=frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Relative(dist.LogUniform(1e-3, 0.3), dist.LogUniform(1e-4, 1.0)),
        model_error=errors,
        sensors_mounted="fixed",
    )


def stand_in(seed=0):
    """Measurement of a simulated frame, off by a few percent, with the same wrong instrument."""
    frequency = np.arange(BAND[0], BAND[1], 0.25)
    sizes = bp.model_error.Embedded(
        frequency=0.005, damping=0.3, shape=0.03, gain=0.02, stiffness_and_mass=None
    )
    true = experiment_at(frequency, sizes)
    random = np.random.default_rng(seed)
    values = {
        unknown.name: random.standard_normal(unknown.distribution.shape())
        for unknown in true.unknowns
        if unknown.name.startswith("model_error.")
    }
    factors = dict(storey1=0.82, storey2=0.88, storey3=0.73, rocking=0.64)
    factors |= dict(base=1.4, floor1=1.23, floor2=1.22, floor3=1.23)
    values |= {f"structure.modes.parameter.{name}": value for name, value in factors.items()}
    values |= {"structure.damping.ratio": 0.01, "noise.ratio": 0.03, "noise.floor": 1e-3}
    known = true.fix(values) + bp.effects.reversed_sensor("base_low")
    exact = np.asarray(jax.jit(lambda: known.frf())())[:, 0]
    parts = random.standard_normal((2, *exact.shape))
    error = np.hypot(0.03 * np.abs(exact), 1e-3) * (parts[0] + 1j * parts[1]) / np.sqrt(2)
    return measured(exact + error, frequency)


@functools.cache
def study(folder=None):
    """Experiment, measurement and engine; for the folder of the data see `read`."""
    measurement = read(folder)
    return Study(experiment_at(measurement.frequency), measurement, bp.engines.MAP(starts=8), {})


def __getattr__(name):
    """Read the data on the first access of the experiment or the measurement."""
    if name in ("experiment", "measurement"):
        return getattr(study(), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
