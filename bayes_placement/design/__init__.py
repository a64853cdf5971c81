"""design: in, an experiment; out, where its sensors and actuators had best sit.

Ways to search for a placement. Not known here: how information is estimated, measurements.
"""

from .maps import Lead, lead
from .place import Placement
from .search import Exhaustive, Sequential

__all__ = ["Exhaustive", "Lead", "Placement", "Sequential", "lead"]
