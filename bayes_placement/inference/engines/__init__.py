"""engines: in, log_prior, log_likelihood and sample_prior over flat vectors; out, draws.

Ways to explore a posterior, one file each. Not known here: structures, placement, measurements.
"""

from .grid import Grid
from .importance import Importance
from .map import MAP
from .nuts import NUTS
from .smc import SMC

__all__ = ["MAP", "NUTS", "SMC", "Grid", "Importance"]
