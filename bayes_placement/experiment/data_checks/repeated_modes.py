"""Modes of a model that have one natural frequency, where modal parameters are observed."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ...modes.modes import frequencies_of
from .record import Fault

if TYPE_CHECKING:
    from ..experiment import Experiment

NAME = "repeated modes"

LEAST_DISTANCE = 1e-6
"""Relative distance of two natural frequencies below which their shapes are any mixture."""

MARGIN = 1.05
"""Natural frequencies over the last one measured up to which modes are compared."""


def check(experiment: "Experiment") -> Iterator[Fault]:
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
