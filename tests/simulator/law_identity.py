"""Whether a law is what the data tell: no simpler one fits as well, all else refitted.

Independent of bayes_placement.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.optimize

from tests.simulator.law_networks import PAIRED, Tree, dynamic_stiffness, leaves, without_one
from tests.simulator.port_plants import PlateWithPorts, closed, line_plant
from tests.simulator.unlisted_effects import Hidden
from tests.simulator.unlisted_scenes import COARSE, Scene

LEAST = 0.05
"""Chi2 per datum by which a law must fit better than any with one element less."""

STARTS = 3

PORTS = ("displacement", "rotation", "relative")
"""Kinds of ports whose laws are asked about."""


@dataclass(frozen=True, eq=False)
class LawFit:
    """The structure as drawn with a law at a port: response, and fits to it of other laws."""

    scene: Scene
    hidden: Hidden

    @cached_property
    def system(self):
        is_plate = self.scene.form == "plate"
        nominal = self.scene.nominal
        return PlateWithPorts(nominal) if is_plate else line_plant(nominal, (), (), COARSE)

    @cached_property
    def begin(self) -> np.ndarray:
        """True values of what is unknown of the structure, and the places of the port."""
        scene = self.scene
        true = [getattr(scene.true, name) for name in scene.priors]
        instruments = (*scene.sensors, *scene.actuators)
        places = [x for one in instruments for x in np.ravel(one.true)]
        return np.array([*true, *places, *np.ravel(self.hidden.places)])

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.scene.fit.bounds
        sides = np.array([self.scene.nominal.length, getattr(self.scene.nominal, "width", 0.0)])
        places = np.array(self.hidden.places).reshape(len(self.hidden.places), -1)
        ends = np.broadcast_to(sides[: places.shape[1]], places.shape).ravel()
        return np.append(low, 0 * ends), np.append(high, ends)

    def predicted(self, of_structure: np.ndarray, tree: Tree, numbers: Sequence[float]):
        """Receptance of shape (sensor, actuator, line)."""
        scene, nominal = self.scene, self.scene.nominal
        modulus, damping, density = of_structure[:3]
        lighter, omega = nominal.density / density, 2 * np.pi * scene.frequency
        natural = self.system.natural[:, None] * np.sqrt(modulus / nominal.youngs_modulus * lighter)
        flexible = lighter / (natural**2 - omega**2 + 2j * damping * natural * omega)
        width = 2 if scene.form == "plate" else 1
        places = of_structure[3:].reshape(-1, width)
        rows = self.system.rows(places)
        sensors, actuators = len(scene.sensors), len(scene.actuators)
        read, driven, port = np.split(rows, [sensors, sensors + actuators])
        if self.hidden.kind == "rotation":
            port = self.system.rows(places[sensors + actuators :], 1)
        if self.hidden.kind == "relative":
            port = np.diff(port, axis=0)
        law = dynamic_stiffness(tree, numbers, omega)
        return closed(read, driven, flexible, port, law[:, None])

    @cached_property
    def truth(self) -> tuple[np.ndarray, np.ndarray]:
        """The response, and its error."""
        exact = self.predicted(self.begin, self.hidden.law, self.hidden.values)
        square = (2 * np.pi * self.scene.frequency) ** 2
        return exact, self.scene.error(exact * square) / square

    def excess(self, tree: Tree, numbers: Sequence[float], seed: int = 0) -> float:
        """Chi2 per datum, less 1, of the best fit with another law, of several starts."""
        generator = np.random.default_rng(seed)
        spread = np.zeros(len(numbers)) + [0.0 if p else 1.0 for p in orders(tree)]
        starts = [
            np.log(numbers) + spread * generator.normal(0.0, 1.5 * bool(n), len(numbers))
            for n in range(STARTS)
        ]
        return min(self._fitted(tree, start) for start in starts)

    def _fitted(self, tree: Tree, start: np.ndarray) -> float:
        exact, error = self.truth
        low, high = self.bounds

        def residual(unknown: np.ndarray) -> np.ndarray:
            of_structure = low + unknown[: low.size] * (high - low)
            numbers = np.exp(unknown[low.size :])
            missed = ((self.predicted(of_structure, tree, numbers) - exact) / error).ravel()
            return np.concatenate([missed.real, missed.imag])

        shares = np.clip((self.begin - low) / (high - low), 0.001, 0.999)
        wide = np.full(start.size, 18.0)
        ends = [np.append(0 * low, start - wide), np.append(0 * low + 1, start + wide)]
        for number, is_order in enumerate(orders(tree)):
            if is_order:
                ends[1][low.size + number] = 0.0  # an order, and a loss factor, is at most 1
        fit = scipy.optimize.least_squares(
            residual,
            np.append(shares, start),
            bounds=ends,
            diff_step=1e-5,
            xtol=1e-4,
            ftol=1e-4,
            x_scale=np.append(np.full(low.size, 0.1), np.ones(start.size)),
            max_nfev=30,
        )
        return 2 * float(fit.cost) / exact.size


def orders(tree: Tree) -> list[bool]:
    """Whether each number is an order or a loss factor, which are at most 1."""
    return [
        second
        for leaf in leaves(tree)
        for second in ((False, True) if leaf in PAIRED else (False,))
    ]


def rivals(hidden: Hidden, omega: float) -> list[tuple[Tree, list[float]]]:
    """Laws with one element less; of a law of one element the other elements, as stiff [rad/s]."""
    if len(leaves(hidden.law)) > 1:
        return without_one(hidden.law, hidden.values)
    size = abs(dynamic_stiffness(hidden.law, hidden.values, np.array([omega]))[0])
    sizes = {"k": size, "c": size / omega, "m": size / omega**2}
    return [(letter, [value]) for letter, value in sizes.items() if letter != hidden.law]


def is_told(scene: Scene, hidden: Hidden) -> bool:
    """Whether every rival of a law fits worse."""
    if hidden.kind not in PORTS:
        return True
    fit, middle = LawFit(scene, hidden), float(np.sqrt(np.prod(scene.band)))
    return all(fit.excess(*rival) > LEAST for rival in rivals(hidden, middle))
