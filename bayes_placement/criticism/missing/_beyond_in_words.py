"""A number of the structure beyond its prior, in words: nothing is missing then."""

from ...effects.beyond_prior import BeyondPrior
from ...inference.units import readable
from ._parameter_estimate import ParameterEstimate


def explanation(effect: BeyondPrior, value: ParameterEstimate) -> str:
    """Say which value explains the data, and where the prior ends."""
    what, end = _value_and_end(effect, value)
    return f"{what} explains the data; your prior {end}"


def in_short(effect: BeyondPrior, value: ParameterEstimate) -> str:
    """Say the same, as what is one of several candidates."""
    what, end = _value_and_end(effect, value)
    return f"{what} where your prior {end}"


def _value_and_end(effect: BeyondPrior, value: ParameterEstimate) -> tuple[str, str]:
    field = effect.unknown.rpartition(".")[2]
    scale = readable(value.unit, field, abs(value.mean))
    mean = scale.number(value.mean, value.standard_deviation)
    verb = "ends" if value.mean > effect.end else "begins"
    what = f"{_quantity(effect.unknown)} of {mean} {scale.name}"
    return what.rstrip(), f"{verb} at {effect.end * scale.factor:.4g} {scale.name}".rstrip()


def _quantity(name: str) -> str:
    """Words for an unknown by its name: Young's modulus, damping ratio, mount stiffness."""
    _, part, *path = name.split(".")
    words = " ".join(path).replace("_", " ").replace("youngs", "Young's")
    return f"{part} {words}" if part == "damping" and part not in words else words
