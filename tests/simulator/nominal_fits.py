"""Best fit of a structure as drawn to a response: what an engineer reaches without any effect.

Independent of bayes_placement.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.optimize

from tests.simulator.fine_elements import plant
from tests.simulator.hidden_scenes import COARSE
from tests.simulator.hidden_structures import deviation
from tests.simulator.imperfect_scenes import Plate, Scene, place_of
from tests.simulator.ritz_plates import plate_plant


@dataclass(frozen=True)
class Fit:
    """Values of what is unknown, and the expected chi2 per datum."""

    values: np.ndarray
    chi2: float


@dataclass
class NominalFit:
    """Young's modulus, damping ratio and density within priors, places within tolerances."""

    scene: Scene

    @cached_property
    def system(self):
        nominal = self.scene.nominal
        is_plate = isinstance(nominal, Plate)
        return plate_plant(nominal) if is_plate else plant(nominal, elements=COARSE)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        instruments = (*self.scene.sensors, *self.scene.actuators)
        bounds = [self.scene.priors[name] for name in NAMES]
        bounds += [
            (x - instrument.within, x + instrument.within)
            for instrument in instruments
            for x in flat(instrument.recorded)
        ]
        low, high = np.array(bounds).T
        return low, high

    def predicted(self, values: np.ndarray) -> np.ndarray:
        """Accelerance of shape (sensor, actuator, line); only scales change with the material."""
        scene, nominal = self.scene, self.scene.nominal
        modulus, damping, density = values[:3]
        lighter = nominal.density / density
        natural = self.system.natural * np.sqrt(modulus / nominal.youngs_modulus * lighter)
        places = values[3:].reshape(len(scene.sensors) + len(scene.actuators), -1)
        signs = np.sign([instrument.direction for instrument in (*scene.sensors, *scene.actuators)])
        rows = signs[:, None] * self.system.rows([place_of(place) for place in places])
        omega = 2 * np.pi * scene.frequency
        modal = natural[:, None] ** 2 - omega**2 + 2j * damping * natural[:, None] * omega
        read, driven = rows[: len(scene.sensors)], rows[len(scene.sensors) :]
        pairs = (read[:, None, :] * driven[None, :, :]).reshape(-1, natural.size)
        moved = lighter * pairs @ (1 / modal)
        return (-(omega**2) * moved).reshape(len(read), len(driven), -1)

    def of(self, exact: np.ndarray, *starts: np.ndarray) -> Fit:
        """Best fit to a response, from a scan of the modulus and from further starts."""
        error = deviation(exact)
        low, high = self.bounds

        def residual(share: np.ndarray) -> np.ndarray:
            missed = ((self.predicted(low + share * (high - low)) - exact) / error).ravel()
            return np.concatenate([missed.real, missed.imag])

        begins = [self._scanned(residual), *((start - low) / (high - low) for start in starts)]
        fits = [
            scipy.optimize.least_squares(
                residual,
                np.clip(start, 0.01, 0.99),
                bounds=(0, 1),
                diff_step=1e-5,
                xtol=1e-5,
                ftol=1e-5,
                max_nfev=40,
            )
            for start in begins
        ]
        best = min(fits, key=lambda fit: fit.cost)
        return Fit(low + best.x * (high - low), 1 + 2 * float(best.cost) / exact.size)

    def _scanned(self, residual) -> np.ndarray:
        starts = np.full((61, self.bounds[0].size), 0.5)
        starts[:, 0] = np.linspace(0.02, 0.98, 61)
        costs = [float(np.sum(residual(start) ** 2)) for start in starts]
        return starts[int(np.argmin(costs))]


NAMES = ("youngs_modulus", "damping_ratio", "density")


def flat(place) -> tuple[float, ...]:
    """Coordinates of a place, one or two."""
    return tuple(np.atleast_1d(place).tolist())
