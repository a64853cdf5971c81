from .enumeration import Enumeration as Enumeration
from .kde import KDE as KDE
from .latent import Latent as Latent
from .quadrature import Quadrature as Quadrature
