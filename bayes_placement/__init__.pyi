from . import (
    beams,
    damping,
    effects,
    engines,
    information,
    io,
    marginals,
    modes,
    noise,
    observe,
    plots,
    supports,
)
from .experiment import Experiment
from .infer import infer
from .measurement import Channel, Measurement
from .report import report
from .simulate import simulate
from .structure import Structure
from .transducers import Actuator, Sensor

__version__: str

__all__ = [
    "Actuator",
    "Channel",
    "Experiment",
    "Measurement",
    "Sensor",
    "Structure",
    "beams",
    "damping",
    "effects",
    "engines",
    "infer",
    "information",
    "io",
    "marginals",
    "modes",
    "noise",
    "observe",
    "plots",
    "report",
    "simulate",
    "supports",
]
