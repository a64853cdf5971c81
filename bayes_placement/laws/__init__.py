"""What may hang on a port: networks of springs, dashpots and masses."""

from .catalogue import canonical, classes, law_of, networks
from .elements import Dashpot, LossySpring, Mass, Spring, Springpot
from .law import Law, Parallel, Scaled, Series
from .tabulated import Tabulated

__all__ = [
    "Dashpot",
    "Law",
    "LossySpring",
    "Mass",
    "Parallel",
    "Scaled",
    "Series",
    "Spring",
    "Springpot",
    "Tabulated",
    "canonical",
    "classes",
    "law_of",
    "networks",
]
