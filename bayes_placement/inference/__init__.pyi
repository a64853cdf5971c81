from . import engines as engines
from . import marginals as marginals
