"""design: in, an experiment; out, where its sensors and actuators had best sit.

Ways to search for a placement. Not known here: how information is estimated, measurements.
"""

from .effective_independence import EffectiveIndependence, effective_independence
from .evolutionary import Evolutionary
from .exhaustive import Exhaustive
from .forward import Forward
from .maps import Lead, lead, rivals
from .place import Placement
from .planned import planned
from .sequential import Sequential
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
    "lead",
    "planned",
    "rivals",
    "tolerance_study",
]
