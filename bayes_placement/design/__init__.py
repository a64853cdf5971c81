"""design: in, an experiment; out, where its sensors and actuators had best sit.

Ways to search for a placement. Not known here: how information is estimated, measurements.
"""

from .maps import Lead, lead, rivals
from .place import Placement
from .search import Exhaustive, Sequential
from .tolerance import ToleranceStudy, tolerance_study

__all__ = [
    "Exhaustive",
    "Lead",
    "Placement",
    "Sequential",
    "ToleranceStudy",
    "lead",
    "rivals",
    "tolerance_study",
]
