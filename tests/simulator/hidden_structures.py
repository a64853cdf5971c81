"""Simulated measurements of a bar or beam with instruments and hidden effects.

Independent of bayes_placement. Every mode of a fine mesh is kept, so that their sum is the direct
solution of the mesh, without truncation.

SI units; time convention exp(+i w t).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tests.simulator.fine_elements import (
    ELEMENTS,
    NOTHING,
    Effect,
    Line,
    Plant,
    damping_ratios,
    effect,
    plant,
)

__all__ = ["NOTHING", "Effect", "Instrument", "Line", "Record", "accelerance", "effect", "record"]


@dataclass(frozen=True)
class Instrument:
    """A sensor or an actuator of one channel, its record and the truth."""

    name: str
    recorded: float
    within: float
    direction: int  # recorded: +-1 for a bar, +-3 for a beam
    true: float


@dataclass(frozen=True)
class Record:
    """FRFs as measured: accelerance of shape (sensor, actuator, line), with its coherence."""

    frequency: np.ndarray
    frf: np.ndarray
    coherence: np.ndarray
    averages: int
    force_level: float | None

    def variance(self) -> np.ndarray:
        return np.abs(self.frf) ** 2 * (1 - self.coherence) / (self.averages * self.coherence)


def accelerance(
    line: Line,
    sensors: Sequence[Instrument],
    actuators: Sequence[Instrument],
    frequency: np.ndarray,
    hidden: Effect = NOTHING,
    force_level: float = 1.0,
    elements: int = ELEMENTS,
) -> np.ndarray:
    """Accelerance [(m/s^2)/N] of shape (sensor, actuator, line) without noise, as recorded."""
    read, driven = seats(sensors, hidden), [actuator.true for actuator in actuators]
    system = plant(line, hidden, elements, driven + ports(read, hidden))
    return as_recorded(
        system, line, sensors, actuators, frequency, hidden, force_level, line.attached
    )


def as_recorded(
    system,
    structure,
    sensors: Sequence[Instrument],
    actuators: Sequence[Instrument],
    frequency: np.ndarray,
    hidden: Effect,
    force_level: float = 1.0,
    attached: tuple[tuple[float, float], ...] = (),
) -> np.ndarray:
    """Accelerance of any structure whose modes are known: `natural`, and `rows` at places."""
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    read, driven = seats(sensors, hidden), [actuator.true for actuator in actuators]
    response = Response(system, omega, flexibility(system, structure, hidden, omega), attached)
    moved = motion(response, read, driven, hidden, force_level)
    signs = np.outer(*(np.sign([x.direction for x in side]) for side in (sensors, actuators)))
    recorded = -(omega**2) * moved * signs[:, :, None]
    return recorded * chain(hidden, sensors, omega)[:, None, :]


def seats(sensors: Sequence[Instrument], hidden: Effect) -> list[float]:
    """Where the sensors truly sit [m]."""
    wrong = hidden["sensor"] if hidden.name == "misplaced_sensor" else None
    return [hidden["position"] if sensor.name == wrong else sensor.true for sensor in sensors]


def ports(read: list[float], hidden: Effect) -> list[float]:
    """Where something is attached [m]."""
    if hidden.name == "sensor_mass":
        return read
    return [hidden["at"]] if hidden.name in {*ATTACHED, "cubic_stiffness"} else []


def flexibility(system, structure, hidden: Effect, omega: np.ndarray) -> np.ndarray:
    """Modal flexibility 1 / (w_n^2 E*(w) / E - w^2 + 2 i xi w_n w), of shape (mode, line)."""
    natural = system.natural[:, None]
    ratios = damping_ratios(structure, system.natural.size)[:, None]
    modulus, loss = np.ones_like(omega, dtype=complex), 2j * ratios * natural * omega
    if hidden.name == "hysteretic_damping":
        modulus, loss = modulus + 1j * hidden["loss_factor"], 0.0
    if hidden.name == "viscoelastic_modulus":
        turn = 1j * omega * hidden["relaxation_time"]
        modulus = modulus + hidden["relaxing"] * turn / (1 + turn)
    return 1 / (natural**2 * modulus - omega**2 + loss)


@dataclass(frozen=True)
class Response:
    """Receptance of the structure proper between any places, with masses attached to it."""

    system: Plant
    omega: np.ndarray
    flexibility: np.ndarray
    attached: tuple[tuple[float, float], ...] = ()

    def between(self, left: Sequence[float], right: Sequence[float]) -> np.ndarray:
        """Receptance [m/N] of shape (line, left, right)."""
        places = [place for place, _ in self.attached]
        masses = np.array([mass for _, mass in self.attached])
        added = -np.multiply.outer(self.omega**2, masses)
        return stiffened(self._without_masses, left, right, places, added)

    def _without_masses(self, left: Sequence[float], right: Sequence[float]) -> np.ndarray:
        rows, columns = self.system.rows(left), self.system.rows(right)
        pairs = (rows[:, None, :] * columns[None, :, :]).reshape(-1, rows.shape[1])
        return (pairs @ self.flexibility).T.reshape(-1, len(rows), len(columns))

    def held_by(
        self,
        read: Sequence[float],
        driven: Sequence[float],
        ports: Sequence[float],
        added: np.ndarray,
    ) -> np.ndarray:
        """Receptance (sensor, actuator, line) with dynamic stiffness added (line,) at each port."""
        each = np.tile(added[:, None], (1, len(ports)))
        return np.moveaxis(stiffened(self.between, read, driven, ports, each), 0, -1)


def stiffened(
    between: Callable[[Sequence[float], Sequence[float]], np.ndarray],
    read: Sequence[float],
    driven: Sequence[float],
    ports: Sequence[float],
    added: np.ndarray,
) -> np.ndarray:
    """Receptance (line, sensor, actuator) with dynamic stiffness added (line, port) at ports."""
    if not len(ports):
        return between(read, driven)
    across = np.eye(len(ports)) + added[:, :, None] * between(ports, ports)
    force = np.linalg.solve(across, added[:, :, None] * between(ports, driven))
    return between(read, driven) - between(read, ports) @ force


def motion(
    response: Response,
    read: Sequence[float],
    driven: Sequence[float],
    hidden: Effect,
    force_level: float,
) -> np.ndarray:
    """Receptance [m/N] of shape (sensor, actuator, line) with what is attached."""
    if hidden.name == "cubic_stiffness":
        columns = [cubic(response, read, place, hidden, force_level) for place in driven]
        return np.concatenate(columns, axis=1)
    if hidden.name == "sensor_mass":
        added = -(response.omega**2) * hidden["mass"]
        if not hidden["roving"]:
            return response.held_by(read, driven, read, added)
        rows = [response.held_by([place], driven, [place], added) for place in read]
        return np.concatenate(rows)
    if hidden.name in ATTACHED:
        added = ATTACHED[hidden.name](hidden, response.omega)
        return response.held_by(read, driven, [hidden["at"]], added)
    return np.moveaxis(response.between(read, driven), 0, -1)


def absorber(hidden: Effect, omega: np.ndarray) -> np.ndarray:
    """Mass m on spring k and dashpot c, -w^2 m (k + i w c) / (k + i w c - w^2 m)."""
    natural, mass = 2 * np.pi * hidden["frequency"], hidden["mass"]
    link = mass * (natural**2 + 2j * hidden["damping_ratio"] * natural * omega)
    return -(omega**2) * mass * link / (link - omega**2 * mass)


ATTACHED = {
    "point_mass": lambda hidden, omega: -(omega**2) * hidden["mass"],
    "ground_spring": lambda hidden, omega: np.full_like(omega, hidden["stiffness"]),
    "ground_dashpot": lambda hidden, omega: 1j * omega * hidden["viscosity"],
    "tuned_absorber": absorber,
}


def cubic(
    response: Response,
    read: Sequence[float],
    driven: float,
    hidden: Effect,
    force_level: float,
) -> np.ndarray:
    """Fundamental of the motion per force on a spring k u^3 to ground, by harmonic balance.

    Where several motions are possible, the one that a slow sweep upwards follows.
    """
    port = [hidden["at"]]
    direct, cross = response.between(port, port)[:, 0, 0], response.between(port, [driven])[:, 0, 0]
    spring = 0.75 * hidden["stiffness"] * np.abs(force_level * cross) ** 2
    ratios = [real_positive(roots) for roots in ratio_polynomials(direct, spring)]
    followed = sweep(ratios)
    return response.held_by(read, [driven], port, spring / followed)


def ratio_polynomials(direct: np.ndarray, spring: np.ndarray) -> np.ndarray:
    """Companion matrices of r^3 = r^2 + 2 p Re(H) r + p^2 |H|^2, r = |U without / U with|^2.

    From U (1 + p H / r) = U without: |1 + p H / r|^2 = r.
    """
    matrices = np.zeros((direct.size, 3, 3))
    matrices[:, 0] = np.stack(
        [np.ones(direct.size), 2 * spring * direct.real, spring**2 * np.abs(direct) ** 2], axis=1
    )
    matrices[:, 1, 0] = matrices[:, 2, 1] = 1.0
    return np.linalg.eigvals(matrices)


def real_positive(roots: np.ndarray) -> np.ndarray:
    real = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0)]
    return np.sort(real)


def sweep(choices: list[np.ndarray]) -> np.ndarray:
    """Of the ratios possible at each line, the one nearest to that of the line before."""
    followed, last = [], 1.0
    for ratios in choices:
        last = ratios[np.argmin(np.abs(np.log(ratios / last)))]
        followed.append(last)
    return np.array(followed)


def chain(hidden: Effect, sensors: Sequence[Instrument], omega: np.ndarray) -> np.ndarray:
    """Factor of each sensor and line between motion and record."""
    whose = [
        hidden.name == "time_delay" or ("sensor", sensor.name) in hidden.pairs for sensor in sensors
    ]
    factors = {
        "time_delay": lambda: np.exp(-1j * omega * hidden["delay"]),
        "gain_error": lambda: 1 + hidden["error"] + 0j * omega,
        "reversed_sensor": lambda: -np.ones_like(omega),
        "mount_resonance": lambda: mount(hidden, omega),
    }
    factor = factors.get(hidden.name, lambda: np.ones_like(omega))()
    return np.where(np.array(whose)[:, None], factor, 1.0)


def mount(hidden: Effect, omega: np.ndarray) -> np.ndarray:
    natural = 2 * np.pi * hidden["frequency"]
    loss = 2j * hidden["damping_ratio"] * natural * omega
    return (natural**2 + loss) / (natural**2 - omega**2 + loss)


def deviation(exact: np.ndarray, relative: float = 0.01, floor: float = 0.03) -> np.ndarray:
    """Root of E|error|^2: a share of the modulus, with a floor near antiresonances."""
    level = np.sqrt(np.mean(np.abs(exact) ** 2, axis=-1, keepdims=True))
    return relative * np.sqrt(np.abs(exact) ** 2 + (floor * level) ** 2)


def record(
    exact: np.ndarray,
    frequency: np.ndarray,
    generator: np.random.Generator,
    averages: int = 16,
    force_level: float | None = None,
    relative: float = 0.01,
) -> Record:
    """Add circular complex noise, and the coherence g2 that tells its size with the measured H."""
    real, imaginary = generator.standard_normal((2, *exact.shape)) / np.sqrt(2)
    error = deviation(exact, relative)
    frf = exact + error * (real + 1j * imaginary)
    coherence = 1 / (1 + averages * error**2 / np.abs(frf) ** 2)
    return Record(frequency, frf, coherence, averages, force_level)
