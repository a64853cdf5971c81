"""Random bars, beams and plates that are not quite as drawn, before and after an effect came.

Stiffness varies along the structure, masses were forgotten, each mode has a damping ratio and each
channel a gain of its own. All draws of a form have the same numbers of modes in the band, lines,
sensors and actuators. Independent of bayes_placement.
"""

from dataclasses import dataclass, replace

import numpy as np

from tests.simulator import hidden_scenes
from tests.simulator.fine_elements import ELEMENTS, NOTHING, Effect, Line, plant
from tests.simulator.hidden_scenes import COARSE, MATERIALS, log_uniform
from tests.simulator.hidden_structures import Instrument, accelerance, as_recorded
from tests.simulator.ritz_plates import Plate, plate_plant

Structure = Line | Plate

ENDS = {"bar": "fixed-free", "beam": "free-free", "plate": "supported-supported"}
FORMS = tuple(ENDS)
SENSORS, ACTUATORS, MODES, LINES = 4, 1, 8, 160

PLATE_MODES = 30
"""Modes of a plate that an engineer keeps; the next is at least 1 % higher."""

PIECES, MASSES, DAMPED = 12, 3, 60
PRIORS = {"youngs_modulus": (0.85, 1.15), "damping_ratio": (0.5, 2.0), "density": (0.97, 1.03)}


@dataclass(frozen=True)
class Sizes:
    """Sizes of the flaws: deviations of logarithms, and each forgotten mass over the whole."""

    stiffness: float = 0.04
    mass: float = 0.003
    damping: float = 0.3
    gain: float = 0.01


FLAWS, NO_FLAWS = Sizes(), Sizes(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """All of a draw that is fixed before the noise falls."""

    form: str
    nominal: Structure
    priors: dict[str, tuple[float, float]]
    true: Structure  # with its flaws
    gains: np.ndarray  # factor of each sensor and actuator, [sensor, actuator]
    sensors: tuple[Instrument, ...]
    actuators: tuple[Instrument, ...]
    frequency: np.ndarray
    hidden: Effect

    def response(self, hidden: Effect, elements: int = ELEMENTS) -> np.ndarray:
        """Accelerance of shape (sensor, actuator, line) without noise."""
        sides = self.sensors, self.actuators
        if isinstance(self.true, Plate):
            system = plate_plant(self.true, hidden)
            exact = as_recorded(system, self.true, *sides, self.frequency, hidden)
        else:
            exact = accelerance(self.true, *sides, self.frequency, hidden, elements=elements)
        return self.gains[:, :, None] * exact

    @property
    def first(self) -> float:
        """Natural angular frequency of the first elastic mode as drawn [rad/s]."""
        return float(elastic(self.nominal)[0])


def drawn(key: tuple[int, ...], form: str, sizes: Sizes = FLAWS) -> Scene:
    """The scene of a key, with nothing hidden; flaws of other sizes change nothing else."""
    generator = np.random.default_rng([*key, 0])
    nominal = structure(generator, form)
    true = replace(
        nominal,
        youngs_modulus=nominal.youngs_modulus * generator.uniform(0.92, 1.08),
        damping_ratio=nominal.damping_ratio * log_uniform(generator, 0.7, 1.4),
        density=nominal.density * generator.uniform(0.98, 1.02),
    )
    sensors, actuators = instruments(generator, nominal)
    flaws = np.random.default_rng([*key, 3])
    gains = np.exp(sizes.gain * flaws.standard_normal(SENSORS + ACTUATORS))
    return Scene(
        form=form,
        nominal=nominal,
        priors={
            name: tuple(getattr(nominal, name) * share for share in ends)
            for name, ends in PRIORS.items()
        },
        true=flawed(flaws, true, sizes),
        gains=np.outer(gains[:SENSORS], gains[SENSORS:]),
        sensors=sensors,
        actuators=actuators,
        frequency=lines(nominal),
        hidden=NOTHING,
    )


def flawed(generator: np.random.Generator, true: Structure, sizes: Sizes) -> Structure:
    """Return the structure with uneven stiffness, forgotten masses and uneven damping."""
    pieces = np.exp(sizes.stiffness * generator.standard_normal(PIECES))
    places = [somewhere(generator, true, 0.05) for _ in range(MASSES)]
    damping = np.exp(sizes.damping * generator.standard_normal(DAMPED))
    return replace(
        true,
        pieces=tuple(pieces.tolist()),
        masses=tuple((place, sizes.mass * true.mass) for place in places),
        damping_factors=tuple(damping.tolist()),
    )


def structure(generator: np.random.Generator, form: str) -> Structure:
    """Nominal structure."""
    if form == "plate":
        return plate(generator)
    slenderness = log_uniform(generator, 0.004, 0.02)
    line = hidden_scenes.structure(generator, form, ENDS[form], slenderness)
    low, high = {"bar": (0.015, 0.04), "beam": (0.01, 0.02)}[form]
    return replace(line, suspension=(), damping_ratio=log_uniform(generator, low, high))


def plate(generator: np.random.Generator) -> Plate:
    """A plate whose last kept mode stands apart from the next, so that all keep the same number."""
    while True:
        length = log_uniform(generator, 0.3, 1.0)
        youngs_modulus, density = generator.choice(MATERIALS)
        drawn_plate = Plate(
            length=length,
            width=length * generator.uniform(0.6, 0.9),
            thickness=length * generator.uniform(0.005, 0.012),
            youngs_modulus=float(youngs_modulus),
            density=float(density),
            damping_ratio=log_uniform(generator, 0.008, 0.02),
            ends=ENDS["plate"],
            sides=ENDS["plate"],
        )
        natural = elastic(drawn_plate)
        if natural[PLATE_MODES] > 1.01 * natural[PLATE_MODES - 1]:
            return drawn_plate


def elastic(structure: Structure) -> np.ndarray:
    """Natural angular frequencies [rad/s] of the elastic modes."""
    if isinstance(structure, Plate):
        return plate_plant(structure).natural
    rigid = {"bar": 1, "beam": 2}[structure.kind] if structure.ends == "free-free" else 0
    return plant(structure, elements=COARSE).natural[rigid:]


def lines(structure: Structure) -> np.ndarray:
    """Lines [Hz] of a band that ends between the last mode wanted and the next."""
    natural = elastic(structure) / (2 * np.pi)
    band = 0.4 * natural[0], np.sqrt(natural[MODES - 1] * natural[MODES])
    bent = isinstance(structure, Line) and structure.kind == "beam"
    return (np.geomspace if bent else np.linspace)(*band, LINES)


def somewhere(generator: np.random.Generator, structure: Structure, margin: float):
    """A place [m]: one number on a line, two on a plate."""
    shares = generator.uniform(margin, 1 - margin, 2)
    if isinstance(structure, Line):
        return float(shares[0] * structure.length)
    return float(shares[0] * structure.length), float(shares[1] * structure.width)


def instruments(
    generator: np.random.Generator, structure: Structure
) -> tuple[tuple[Instrument, ...], tuple[Instrument, ...]]:
    """Sensors and actuators, somewhat off their recorded places, none close to another."""
    within = round(generator.uniform(0.005, 0.015) * structure.length, 6)
    places: list[np.ndarray] = []
    while len(places) < SENSORS + ACTUATORS:
        place = np.round(np.atleast_1d(somewhere(generator, structure, 0.08)), 4)
        if all(np.linalg.norm(place - other) > 0.08 * structure.length for other in places):
            places.append(place)
    names = [f"s{n + 1}" for n in range(SENSORS)] + [f"a{n + 1}" for n in range(ACTUATORS)]
    axis = 1 if isinstance(structure, Line) and structure.kind == "bar" else 3
    # Every second one is turned round; the same in all draws, which then share compiled functions.
    directions = [axis * (-1) ** number for number in range(len(names))]
    transducers = tuple(
        mounted(generator, name, place, within, direction)
        for name, place, direction in zip(names, places, directions, strict=True)
    )
    return transducers[:SENSORS], transducers[SENSORS:]


def mounted(
    generator: np.random.Generator, name: str, place: np.ndarray, within: float, direction: int
) -> Instrument:
    true = place + generator.uniform(-within, within, place.size)
    return Instrument(name, place_of(place), within, direction, place_of(true))


def place_of(coordinates: np.ndarray):
    """One number, or a tuple of them."""
    numbers = tuple(coordinates.tolist())
    return numbers[0] if len(numbers) == 1 else numbers
