from . import (
    design,
    effects,
    io,
    modes,
    plots,
    positions,
)
from .criticism.check.check import check
from .criticism.compare import compare
from .criticism.missing.decide import decide
from .criticism.missing.explain import explain
from .criticism.missing.improve import improve
from .criticism.missing.reach import reach
from .criticism.missing.table import Policy
from .design import information, information_map, place
from .experiment import (
    Actuator,
    Channel,
    Experiment,
    Measurement,
    ModalParameters,
    Sensor,
    Structure,
    damping,
    model_error,
    noise,
    observe,
)
from .experiment.identification import identify
from .experiment.variants import observing_modes
from .explorer import explore
from .inference import engines, marginals
from .inference.infer import infer
from .inference.report import report
from .inference.simulate import simulate
from .io import time_records
from .modes import beams, finite_elements

__version__: str

__all__ = [
    "Actuator",
    "Channel",
    "Experiment",
    "Measurement",
    "ModalParameters",
    "Policy",
    "Sensor",
    "Structure",
    "beams",
    "check",
    "compare",
    "damping",
    "decide",
    "design",
    "effects",
    "engines",
    "explain",
    "explore",
    "finite_elements",
    "identify",
    "improve",
    "infer",
    "information",
    "information_map",
    "io",
    "marginals",
    "model_error",
    "modes",
    "noise",
    "observe",
    "observing_modes",
    "place",
    "plots",
    "positions",
    "reach",
    "report",
    "simulate",
    "time_records",
]
