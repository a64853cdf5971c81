from .kde import KDE as KDE
from .latent import Latent as Latent
from .quadrature import Enumeration as Enumeration
from .quadrature import Quadrature as Quadrature
