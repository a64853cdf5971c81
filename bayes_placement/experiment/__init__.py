"""experiment: a structure, what excites and reads it, and the output error: one NumPyro model."""

from .._shared.reprs import offer_own
from ..positions.channel import Channel
from . import damping, model_error, noise, observe
from .experiment import Experiment
from .measurement import Measurement
from .modal_parameters import ModalParameters
from .structure import Structure
from .transducers import Actuator, Sensor

__all__ = [
    "Actuator",
    "Channel",
    "Experiment",
    "Measurement",
    "ModalParameters",
    "Sensor",
    "Structure",
    "damping",
    "model_error",
    "noise",
    "observe",
]

offer_own(damping, model_error, noise, observe)
