"""Natural frequencies of the model: beside resonances of the data, and those of repeated modes."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...modes.modes import frequencies_of
from .._noise_level import FEWEST_LINES
from ..line_choice import resonances
from .record import Fault, Pair, Record

if TYPE_CHECKING:
    from ..experiment import Experiment

FEWEST_RESONANCES = 3
"""Resonances that are not all near natural frequencies by chance."""

LEAST_DISTANCE = 1e-6
"""Relative distance of two natural frequencies below which their shapes are any mixture."""

MARGIN = 1.05
"""Natural frequencies over the last one measured up to which modes are compared."""

NaturalFrequencies = Float[np.ndarray, "mode"]


def can_check(record: Record) -> bool:
    """Tell whether there are lines enough to see resonances, and modes that are those measured.

    Effects of the structure change its natural frequencies, soft mounts those of rigid bodies.
    """
    return record.frequency.size >= FEWEST_LINES and not record.experiment.structure.effects


def check(record: Record) -> Iterator[Fault]:
    """Find natural frequencies that are all outside of the lines."""
    measured = record.frequency[resonances((record.measurement,))]
    if measured.size < FEWEST_RESONANCES:
        return
    draws = [frequencies_of(model.structure.modes) for model in record.prior_models]
    low, high = record.frequency[[0, -1]]
    first = next(record.pairs)
    if not any(np.any((modes >= low) & (modes <= high)) for modes in draws):
        greatest = max(float(modes.max()) for modes in draws)
        yield _outside(record, first, draws[0], greatest)


def _outside(record: Record, first: Pair, modes: NaturalFrequencies, greatest: float) -> Fault:
    """Fault whose value is above 1 where all natural frequencies are below the lines."""
    low, high = record.frequency[[0, -1]]
    elastic = modes[modes > 0]
    return record.fault(
        first,
        low / greatest if greatest > 0 else np.inf,
        1.0,
        f"The FRFs have resonances between {low:.4g} and {high:.4g} Hz, but no natural frequency "
        f"of the model lies there, at any draw from the priors (nominal: {elastic[0]:.3g} to "
        f"{elastic[-1]:.3g} Hz), as of a modulus in GPa or a length in mm; Pa, m, kg/m³ and Hz are "
        "needed: youngs_modulus=70e9.",
    )


def repeated_modes(experiment: "Experiment") -> Iterator[Fault]:
    """Find two modes of the nominal structure whose natural frequencies are the same.

    A measured mode cannot be compared with one of two: the equations of its pole are singular.
    """
    modes = experiment.nominal().structure.proper_modes()
    natural = frequencies_of(modes)[modes.rigid_body_modes :]
    below = natural[natural < MARGIN * float(np.max(experiment.frequency))]
    distance = np.diff(below) / below[1:]
    for lower in np.flatnonzero(distance < LEAST_DISTANCE):
        yield Fault(
            sensor="",
            actuator="",
            value=float(distance[lower]),
            threshold=LEAST_DISTANCE,
            sentence=f"Modes {lower + 1} and {lower + 2} of the model are both at "
            f"{below[lower]:.5g} Hz, so that their shapes are any mixture and neither can be "
            "compared with a measured mode. Observe FRFs, or break the symmetry of the model: a "
            "small mass by effects.point_mass.",
        )
