"""A mount of rubber, between a spring and a dashpot."""

from .._shared.ranges import ORDER, POSITIVE
from .prelude import NetworkAttachment, Parameter, Scales, Springpot, Uniform, at_each, field, unit


class FractionalMount(NetworkAttachment):
    """A springpot, k (i omega / omega_0)^order: its stiffness and loss grow with the frequency.

    Bagley and Torvik, AIAA Journal 21 (1983) 741, DOI 10.2514/3.8142.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None for every motion there is.
    stiffness, frequency
        Dynamic stiffness k [N/m], by its magnitude, at the frequency omega_0 / (2 pi) [Hz].
    order
        Order from 0, a spring, to 1, a dashpot [1].

    Examples
    --------
    >>> bp.effects.fractional_mount(0.4, stiffness=2e4, order=0.3, frequency=100.0).network()
    Springpot(20000.0, 0.3, 100.0)
    """

    tried_by_default = False
    absent = ("stiffness", 0.0)
    stiffness: Parameter = field(metadata=unit("N/m"))
    order: Parameter = field(metadata=unit("1", within=ORDER))
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    name: str = field(static=True, default="fractional_mount", kw_only=True)

    def network(self) -> Springpot:
        """Return the springpot."""
        return Springpot(self.stiffness, self.order, self.frequency)

    @classmethod
    def suggest(cls, scales: Scales) -> list["FractionalMount"]:
        """Any order, of 1e-5 to 100 times the modal stiffness in the middle of the band."""
        numbers = scales.any_stiffness, Uniform(0.0, 1.0), scales.middle
        return at_each(cls, scales.places_and_directions(), *numbers)
