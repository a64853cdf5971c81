from . import (
    beams,
    damping,
    design,
    effects,
    engines,
    finite_elements,
    information,
    interpolation,
    io,
    ledger_plots,
    marginals,
    misfit_plots,
    modes,
    nodal_modes,
    noise,
    observe,
    placement_plots,
    places,
    plots,
    soft_supports,
    supports,
)
from ._executors import workers
from ._terminal import progress_bar
from .criticism.check import check
from .criticism.compare import compare
from .criticism.explain import explain
from .criticism.improve import improve
from .design.maps import information_map
from .design.place import place
from .experiment import Experiment
from .infer import infer
from .matrices import Matrices
from .measurement import Channel, Measurement
from .modal_model import ModalModel
from .report import report
from .simulate import simulate
from .structure import Structure
from .transducers import Actuator, Sensor

__version__: str

__all__ = [
    "Actuator",
    "Channel",
    "Experiment",
    "Matrices",
    "Measurement",
    "ModalModel",
    "Sensor",
    "Structure",
    "beams",
    "check",
    "compare",
    "damping",
    "design",
    "effects",
    "engines",
    "explain",
    "finite_elements",
    "improve",
    "infer",
    "information",
    "information_map",
    "interpolation",
    "io",
    "ledger_plots",
    "marginals",
    "misfit_plots",
    "modes",
    "nodal_modes",
    "noise",
    "observe",
    "place",
    "placement_plots",
    "places",
    "plots",
    "progress_bar",
    "report",
    "simulate",
    "soft_supports",
    "supports",
    "workers",
]
