"""What the page is told: structure, modes, unknowns, what was measured and what is predicted."""

import abc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution, TransformedDistribution
from numpyro.distributions.transforms import AffineTransform, ExpTransform

from .._shared.compiled import compiled
from .._shared.files import Json
from .._shared.progress import Progress
from .._shared.ranges import described, ends
from .._shared.sites import Role, Unknown, is_finite
from ..criticism.findings._places import outline_of, points_and_lines, shapes
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from ..experiment.transducers import Transducer
from ..inference.units import readable
from ..page.frames import packed
from ..positions._outlines import outline_of as tolerance_of
from ..positions.bounds import Bounds
from ..positions.vectors import unit_vector
from .response import Response, coherence_rows, measured_rows, pair_labels
from .session import KeptPage, Session

if TYPE_CHECKING:
    import xarray as xr

    from .live import LivePage
    from .opened import Given

REPORT = "report"
"""Word of what takes long to save."""

DIGITS = 6
"""Digits of coordinates."""


def structure_for_page(experiment: Experiment) -> Json:
    """Return points [m] and lines of a structure, its transducers with axes and tolerances."""
    outline = points_and_lines(experiment)
    bounds = experiment.structure.modes.bounds()
    low, high = (np.resize(np.pad(np.atleast_1d(end), (0, 2)), 3) for end in bounds)
    return {
        "points": _rounded(outline.points),
        "lines": outline.lines.tolist(),
        "on_a_line": outline.on_a_line,
        "low": _rounded(low),
        "high": _rounded(high),
        "transducers": [
            _transducer(transducer, bounds)
            for side in (experiment.sensor, experiment.actuator)
            for transducer in side.values()
        ],
    }


def modes_for_page(session: Session) -> Json:
    """Return modes of the model at hand, and those without what was added; or those as drawn.

    With the modal assurance criterion of each shape with each of the others.
    """
    from ..criticism.check.correlation import as_channels, mac  # the page stands before

    given, model = session.states[0].model, session.model
    added = [effect.name for effect in session.new_effects(model)]
    values = {name: model.values[name] for name in given.values} if added else given.values
    outline = outline_of(given.experiment)
    now = shapes(model.experiment, model.values, outline)
    before = shapes(given.experiment, values, outline)
    return {
        "now": _modes(now),
        "before": _modes(before),
        "beside": f"without {', '.join(added)}" if added else "as drawn",
        "mac": _rounded(mac(*(as_channels(of["shape"].values) for of in (now, before)))),
    }


def _modes(found: "xr.Dataset") -> Json:
    """Natural frequencies [Hz] and mode shapes at the points of the structure."""
    shape = found["shape"].values
    largest = np.abs(shape).max(axis=(1, 2), keepdims=True, initial=0.0)
    return {
        "frequency": _rounded(found["natural_frequency"].values),
        "shape": _rounded(shape / np.where(largest > 0, largest, 1.0)),
    }


def _transducer(transducer: Transducer, bounds: Bounds) -> Json:
    place = np.atleast_1d(np.asarray(transducer.recorded, dtype=float))
    tolerance = tolerance_of(transducer.position, bounds)
    return {
        "kind": transducer.kind.lower(),
        "name": transducer.name,
        "at": _rounded(np.pad(place, (0, 3 - place.size))),
        "directions": [list(map(float, unit_vector(d))) for d in transducer.directions],
        "axes": [int(direction) for direction in transducer.directions],
        "tolerance": _rounded(np.reshape(tolerance, (-1, 3))),
    }


def _rounded(numbers: np.ndarray) -> list[object]:
    return np.round(np.asarray(numbers, dtype=float), DIGITS).tolist()


class LongSave(abc.ABC):
    """How something is saved that takes long: a worker does it."""

    @abc.abstractmethod
    def writer(self, page: "LivePage") -> Callable[[Progress], object]:
        """Return what the worker calls: it writes the page as it is now."""

    @abc.abstractmethod
    def take_over(self, written: Any) -> Path:
        """Take over what that returned, and return the file."""


class Surroundings(NamedTuple):
    """What a page is given besides model and measurement."""

    given: "Given"
    """What it was opened with."""
    baseline: Measurements | None
    """An earlier state that was measured, or None."""
    kept: KeptPage
    """Files in which the state is kept."""


def model_frame(session: Session, data: Data, around: Surroundings) -> bytes:
    """Return what never changes: lines, what was measured, structure and channels."""
    experiment = session.states[0].model.experiment
    header = {
        "is": "model",
        "name": around.given.name,
        "words": repr(experiment),
        "pairs": pair_labels(experiment),
        "unit": experiment.observe.label,
        "structure": structure_for_page(experiment),
        "saves": [*around.given.saves, *([] if around.given.report is None else [REPORT])],
    }
    arrays = {
        "frequency": np.asarray(experiment.frequency, dtype=float),
        "measured": measured_rows(experiment, data),
    }
    coherence = coherence_rows(experiment, session.measurement)
    return packed(header, arrays | ({} if coherence is None else {"coherence": coherence}))


def curves_frame(response: Response, **header: object) -> bytes:
    """Return what a model predicts, and its error; the header names the curves and their owner."""
    arrays = {
        "predicted": response.predicted,
        "deviation": response.deviation,
        "error": response.error,
        "chi2_of_pairs": response.chi2_of_pairs,
        "chi2_of_bands": response.chi2_of_bands(),
        "places": response.places,
    }
    return packed({"is": "curves", "chi2": response.chi2, **header}, arrays)


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


def state_for_page(session: Session, shown: list[Slider]) -> Json:
    """Return numbers, effects and steps of the model at hand."""
    model = session.model
    steps = [
        {"title": state.title, "parent": state.parent, "chi2": session.chi2.get(number)}
        for number, state in enumerate(session.states)
    ]
    return {
        "sliders": [{**slider._asdict(), "value": model.values[slider.name]} for slider in shown],
        "effects": [
            {"name": effect.name, "kind": effect.kind} for effect in session.new_effects(model)
        ],
        "steps": steps,
        "current": session.current,
        "path": session.path(),
        "can_undo": session.can_undo,
        "can_redo": session.can_redo,
        "script": session.script(),
    }
