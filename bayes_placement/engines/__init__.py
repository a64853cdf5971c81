"""engines: ways to explore a posterior, one file each.

They see log_prior, log_likelihood and sample_prior over flat vectors, nothing else.
"""

from .grid import Grid
from .importance import Importance
from .map import MAP
from .nuts import NUTS
from .smc import SMC

__all__ = ["MAP", "NUTS", "SMC", "Grid", "Importance"]
