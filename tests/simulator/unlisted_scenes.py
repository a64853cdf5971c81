"""Random bars, beams and plates as a case folder describes them, and their instruments.

Independent of bayes_placement.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.simulator import hidden_scenes, imperfect_scenes
from tests.simulator.fine_elements import Line
from tests.simulator.hidden_scenes import COARSE, log_uniform
from tests.simulator.hidden_structures import Instrument, deviation
from tests.simulator.imperfect_scenes import NO_FLAWS, Sizes, Structure, elastic, mounted
from tests.simulator.nominal_fits import Fit, NominalFit
from tests.simulator.ritz_plates import FINE, Plate

ENDS = {
    "bar": ("bar", "fixed-fixed"),
    "cantilever": ("beam", "fixed-free"),
    "freebeam": ("beam", "free-free"),
}
LINES = tuple(ENDS)
FORMS = (*LINES, "plate")
SHARES = {"bar": 0.28, "cantilever": 0.32, "freebeam": 0.25, "plate": 0.15}

BAND = {"plate": (6, 12)}
MODES = (4, 10)
"""Fewest modes in the band, and one more than the most."""

ALUMINIUM = (7e10, 2700.0, 0.33)
"""Modulus, density and Poisson's ratio of all plates."""

KNOWN = 1e-7
"""Half width, as a share, of the range of what is known."""

APART = 0.06
"""Least distance of instruments of one kind, over the length."""


@dataclass(frozen=True)
class Scene:
    """All of a draw but what is hidden and the noise."""

    form: str
    nominal: Structure
    uncertain: dict[str, tuple[float, float]]
    true: Structure
    gains: np.ndarray  # factor of each sensor and actuator, [sensor, actuator]
    sensors: tuple[Instrument, ...]
    actuators: tuple[Instrument, ...]
    frequency: np.ndarray
    noise: float  # share of the modulus

    @property
    def priors(self) -> dict[str, tuple[float, float]]:
        """Ranges of modulus, damping ratio and density; that of what is known is a point."""
        nominal = {name: getattr(self.nominal, name) for name in imperfect_scenes.PRIORS}
        known = {name: (x * (1 - KNOWN), x * (1 + KNOWN)) for name, x in nominal.items()}
        return known | self.uncertain

    @cached_property
    def fit(self) -> NominalFit:
        return NominalFit(self)

    @property
    def band(self) -> tuple[float, float]:
        """Ends [rad/s]."""
        return 2 * np.pi * float(self.frequency[0]), 2 * np.pi * float(self.frequency[-1])

    @property
    def reference(self) -> float:
        """Stiffness [N/m] of the whole mass in the middle of the band."""
        return self.nominal.mass * self.band[0] * self.band[1]

    def error(self, exact: np.ndarray) -> np.ndarray:
        """Root of the mean square of the noise."""
        return deviation(exact, self.noise)

    def best_fit(self, exact: np.ndarray) -> Fit:
        """Best fit of the structure as drawn, and its expected chi2 per datum."""
        truth = [getattr(self.true, name) for name in self.priors]
        truth += [x for one in (*self.sensors, *self.actuators) for x in np.ravel(one.true)]
        fit = self.fit.of(exact, np.array(truth))
        louder = (self.noise / 0.01) ** 2  # the fit is weighted by noise of 1 %
        return replace(fit, chi2=1 + (fit.chi2 - 1) / louder)


def drawn(key: tuple[int, ...], form: str, sizes: Sizes = NO_FLAWS) -> Scene:
    """The scene of a key; with flaws its priors are wider, as of one who expects some."""
    generator = np.random.default_rng([*key, 0])
    nominal = structure(generator, form)
    uncertain = prior(generator, nominal, flawless=sizes == NO_FLAWS)
    true = replace(nominal, **{name: inner(generator, *ends) for name, ends in uncertain.items()})
    sensors, actuators = instruments(generator, nominal)
    flaws = np.random.default_rng([*key, 3])
    gains = np.exp(sizes.gain * flaws.standard_normal(len(sensors) + len(actuators)))
    return Scene(
        form=form,
        nominal=nominal,
        uncertain=uncertain,
        true=true if sizes == NO_FLAWS else imperfect_scenes.flawed(flaws, true, sizes),
        gains=np.outer(gains[: len(sensors)], gains[len(sensors) :]),
        sensors=sensors,
        actuators=actuators,
        frequency=lines(generator, nominal),
        noise=float(generator.uniform(0.01, 0.02)),
    )


def inner(generator: np.random.Generator, low: float, high: float) -> float:
    """A value that is not at the edge of its range."""
    return float(low + generator.uniform(0.1, 0.9) * (high - low))


def structure(generator: np.random.Generator, form: str) -> Structure:
    if form == "plate":
        return plate(generator)
    line = hidden_scenes.structure(generator, *ENDS[form], log_uniform(generator, 0.004, 0.02))
    return replace(line, suspension=suspension(line) if form == "freebeam" else ())


def suspension(line: Line) -> tuple[tuple[float, float], ...]:
    """Two soft springs far below the band."""
    spring = line.mass * (0.03 * elastic(replace(line, suspension=()))[0]) ** 2 / 2
    return (0.2 * line.length, spring), (0.8 * line.length, spring)


def plate(generator: np.random.Generator) -> Plate:
    length = round(log_uniform(generator, 0.3, 1.0), 3)
    youngs_modulus, density, poisson_ratio = ALUMINIUM
    return Plate(
        length=length,
        width=round(length * generator.uniform(0.6, 0.9), 3),
        thickness=round(length * generator.uniform(0.005, 0.012), 5),
        youngs_modulus=youngs_modulus,
        density=density,
        damping_ratio=log_uniform(generator, 0.008, 0.02),
        poisson_ratio=poisson_ratio,
        order=FINE,
    )


def prior(generator: np.random.Generator, of: Structure, flawless: bool) -> dict:
    """Ranges of what is uncertain."""
    stiffness = generator.uniform(0.04, 0.08) if flawless else 0.15
    shares = {"youngs_modulus": (1 - stiffness, 1 + stiffness), "damping_ratio": (0.5, 2.0)}
    if generator.random() < 0.5 or not flawless:
        shares["density"] = (0.97, 1.03)
    return {name: tuple(getattr(of, name) * x for x in ends) for name, ends in shares.items()}


def instruments(
    generator: np.random.Generator, of: Structure
) -> tuple[tuple[Instrument, ...], tuple[Instrument, ...]]:
    """Three to six sensors and one or two actuators, somewhat off their recorded places."""
    within = round(generator.uniform(0.005, 0.02) * of.length, 4)
    axis = 1 if isinstance(of, Line) and of.kind == "bar" else 3
    sides = []
    for letter, count in (("s", generator.integers(3, 7)), ("a", generator.integers(1, 3))):
        places: list[np.ndarray] = []
        while len(places) < count:
            place = np.round(np.atleast_1d(imperfect_scenes.somewhere(generator, of, 0.07)), 4)
            if all(np.linalg.norm(place - other) > APART * of.length for other in places):
                places.append(place)
        signs = axis * generator.choice([-1, 1], count)
        sides.append(
            tuple(
                mounted(generator, f"{letter}{number}", place, within, int(sign))
                for number, (place, sign) in enumerate(zip(places, signs, strict=True), start=1)
            )
        )
    return sides[0], sides[1]


def lines(generator: np.random.Generator, of: Structure) -> np.ndarray:
    """Lines [Hz] of a band that holds some elastic modes."""
    modes = int(generator.integers(*BAND.get("plate" if isinstance(of, Plate) else "", MODES)))
    natural = elastic(of) / (2 * np.pi)
    band = 0.4 * natural[0], np.sqrt(natural[modes - 1] * natural[modes])
    count = int(generator.integers(140, 261))
    frequency = (np.linspace if axial_or_plate(of) else np.geomspace)(*band, count)
    return np.array([float(f"{line:.5e}") for line in frequency])  # as a universal file has them


def axial_or_plate(of: Structure) -> bool:
    return isinstance(of, Plate) or of.kind == "bar"


__all__ = ["COARSE", "FORMS", "LINES", "SHARES", "Scene", "drawn"]
