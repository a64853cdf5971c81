from . import (
    beams,
    damping,
    effects,
    engines,
    information,
    io,
    ledger_plots,
    marginals,
    misfit_plots,
    modes,
    noise,
    observe,
    plots,
    supports,
)
from .criticism.check import check
from .criticism.compare import compare
from .criticism.explain import explain
from .criticism.improve import improve
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
    "check",
    "compare",
    "damping",
    "effects",
    "engines",
    "explain",
    "improve",
    "infer",
    "information",
    "io",
    "ledger_plots",
    "marginals",
    "misfit_plots",
    "modes",
    "noise",
    "observe",
    "plots",
    "report",
    "simulate",
    "supports",
]
