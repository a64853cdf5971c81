"""Where sensors and actuators should sit: maps of information, searches for the best placement."""

from .._shared.executors import workers
from . import information
from .effective_independence import EffectiveIndependence, effective_independence
from .maps import Lead, information_map, lead, rivals
from .next_measurement import planned
from .place import Placement, place
from .running.chunks import progress_bar
from .search import Exhaustive
from .search.evolutionary import Evolutionary
from .search.forward import Forward, Sequential
from .tolerance import ToleranceStudy, tolerance_study

__all__ = [
    "EffectiveIndependence",
    "Evolutionary",
    "Exhaustive",
    "Forward",
    "Lead",
    "Placement",
    "Sequential",
    "ToleranceStudy",
    "effective_independence",
    "information",
    "information_map",
    "lead",
    "place",
    "planned",
    "progress_bar",
    "rivals",
    "tolerance_study",
    "workers",
]
