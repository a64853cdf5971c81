from .grid import Grid as Grid
from .importance import Importance as Importance
from .map import MAP as MAP
from .nuts import NUTS as NUTS
from .smc import SMC as SMC
