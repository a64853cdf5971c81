"""Unknowns as the page shows them: a number, its range, and the prior drawn along that range."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution, TransformedDistribution
from numpyro.distributions.transforms import AffineTransform, ExpTransform

from .._shared.compiled import compiled
from .._shared.files import Json
from .._shared.ranges import described, ends
from .._shared.sites import Role, Unknown, is_finite
from ..experiment.experiment import Experiment
from ..inference.units import readable

Value: TypeAlias = float | int | np.generic | np.ndarray | Array

POINTS = 65
"""Points along a range at which a prior is drawn."""

WIDE = 30.0
"""Ratio of the ends of a range from which on it is divided by factors."""

TAIL = 1e-3
"""Probability that lies beyond each end of a range where a prior has no end."""

DEVIATIONS = 4.0
"""Standard deviations to the ends where a prior has no quantiles."""


class Slider(NamedTuple):
    """A number that is moved."""

    name: str
    """The unknown, of an array with the number of the element."""
    owner: str
    label: str
    """What it belongs to, and its name there."""
    kind: str
    """Kind of the owner: `modes`, `damping`, `sensor`, `effects`, `noise`."""
    unit: str
    factor: float
    """Unit in which it is shown, and by what a number in SI is multiplied."""
    low: float
    high: float
    """Ends of its range, in SI."""
    origin: float
    is_logarithmic: bool
    """Whether the range is divided by factors, of the distance from the origin, in SI."""
    is_whole: bool
    """Whether only whole numbers are meant."""
    prior: str
    """The prior in words."""
    density: list[float]
    """Prior density along the range over the greatest."""


def sliders(experiment: Experiment) -> list[Slider]:
    """Return a slider for each unknown but the errors of a model error, which are many."""
    return [
        slider
        for unknown in experiment.unknowns
        if unknown.role is not Role.MODEL_ERROR
        for slider in _sliders(unknown)
    ]


def _sliders(unknown: Unknown) -> Iterator[Slider]:
    prior = unknown.distribution
    low, high, origins = (_flat(each, prior) for each in (*_range(prior), _origin(prior)))
    for number in range(int(np.prod(prior.shape(), initial=1))):
        least, most, origin = float(low[number]), float(high[number]), float(origins[number])
        is_wide = bool(least > origin and (most - origin) / (least - origin) > WIDE)
        size = np.sqrt(least * most) if is_wide and least > 0 else max(abs(least), abs(most))
        unit = readable(unknown.unit, unknown.field, size)
        suffix = f"[{number}]" if prior.shape() else ""
        component = f" {unknown.component}" if unknown.component else ""
        yield Slider(
            name=unknown.name + suffix,
            owner=unknown.owner.name,
            label=unknown.field.replace("_", " ") + component + suffix,
            kind=unknown.owner.kind,
            unit=unit.name,
            factor=unit.factor,
            low=least,
            high=most,
            origin=origin,
            is_logarithmic=is_wide,
            is_whole=is_finite(prior),
            prior=described(prior),
            density=_density(prior, number, _points(least, most, origin, is_wide), origin, is_wide),
        )


def _flat(end: Value, prior: Distribution) -> np.ndarray:
    return np.ravel(np.broadcast_to(np.asarray(end, dtype=float), prior.shape()))


def _origin(prior: Distribution) -> Value:
    """The number from which a prior goes by factors: -1 of -1 + exp(...), as of a gain."""
    match prior:
        case TransformedDistribution(transforms=[*_, ExpTransform(), AffineTransform() as last]):
            return last.loc
    return 0.0


def _range(prior: Distribution) -> tuple[Value, Value]:
    """Ends of a prior, or what most of its probability lies between."""
    if is_finite(prior):
        support = np.asarray(prior.enumerate_support())
        return support.min(), support.max()
    low, high = ends(prior)
    if np.isfinite([low, high]).all():
        return getattr(prior, "low", low), getattr(prior, "high", high)
    try:
        return prior.icdf(TAIL), prior.icdf(1 - TAIL)
    except NotImplementedError:
        spread = DEVIATIONS * np.sqrt(np.asarray(prior.variance))
        middle = np.asarray(prior.mean)
        return np.maximum(middle - spread, low), np.minimum(middle + spread, high)


def _points(low: float, high: float, origin: float, is_wide: bool) -> Float[np.ndarray, "point"]:
    if is_wide:
        return origin + np.geomspace(low - origin, high - origin, POINTS)
    return np.linspace(low, high, POINTS)


def _density(
    prior: Distribution,
    number: int,
    points: Float[np.ndarray, "point"],
    origin: float,
    is_wide: bool,
) -> list[float]:
    """Density along a range, of a range of factors by the logarithm."""
    if is_finite(prior):
        return []
    shape = prior.shape()
    middle = np.asarray(prior.mean, dtype=float) if shape else np.zeros(())
    values = np.broadcast_to(middle, (len(points), *shape)).reshape(len(points), -1).copy()
    values[:, number] = points
    log_density = np.asarray(compiled(_log_densities)(prior, values.reshape(-1, *shape)))
    log_density = log_density + np.log(points - origin) if is_wide else log_density
    inside = np.where(np.isfinite(log_density), log_density, -np.inf)
    height = np.exp(inside - inside.max()) if np.isfinite(inside).any() else 0 * points
    return [round(float(each), 3) for each in height]


def _log_densities(prior: Distribution, values: Float[Array, "value ..."]) -> Float[Array, "value"]:
    densities = prior.log_prob(values)
    return jnp.sum(densities.reshape(len(values), -1), axis=1)


def as_json(shown: list[Slider], values: Mapping[str, float]) -> list[Json]:
    """Return sliders with their values for the page."""
    return [{**slider._asdict(), "value": values[slider.name]} for slider in shown]
