"""The set-up of a test in words, the unknowns shown of it, and how far fits moved these."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ..._shared.dimensions import Parameter
from ..._shared.ranges import described, ends
from ..._shared.sites import Role, Unknown, is_unknown
from ...experiment.experiment import Experiment, Measurements
from ...experiment.measurement import Measurement
from ...experiment.modal_parameters import ModalParameters
from ...experiment.quantities import quantity_of
from ...inference.estimates import scalars
from ...inference.units import readable
from ...positions.bounds import position_text

SIZE = "size"
"""Field of a model error that is its size."""


def shown_unknowns(experiment: Experiment) -> list[Unknown]:
    """Return the unknowns of an experiment; of a model error its sizes alone."""
    return [
        unknown
        for unknown in experiment.unknowns
        if unknown.role is not Role.MODEL_ERROR or unknown.field == SIZE
    ]


def with_bounds(experiment: Experiment, draws: xr.Dataset) -> xr.Dataset:
    """Return draws from priors, with the bounds of each prior that has some as its attribute."""
    for unknown in experiment.unknowns:
        bounds = ends(unknown.distribution) if unknown.name in draws else ()
        if bounds and np.isfinite(bounds).all():
            draws[unknown.name].attrs["prior_bounds"] = list(map(float, bounds))
    return draws


UNSTATED = "not stated"


def set_up(experiment: Experiment, measurement: Measurements) -> dict[str, list[list[str]]]:
    """Return what a test was made with.

    `facts` are pairs of a word and what is known; `channels` has a row for each sensor and
    actuator: labels, kind, recorded position [m] and the gain on its FRFs.
    """
    facts = [("structure", repr(experiment.structure).removeprefix("Structure: "))]
    facts += [*_of_modes(measurement)] if isinstance(measurement, ModalParameters) else []
    measured = [measurement] if isinstance(measurement, Measurement) else measurement
    facts += [] if isinstance(measured, ModalParameters) else [*_of_frfs(experiment, measured)]
    return {"facts": [list(fact) for fact in facts], "channels": [*_channels(experiment)]}


def _of_modes(modes: ModalParameters) -> Iterator[tuple[str, str]]:
    natural = modes.natural_frequency
    yield "modes", f"{natural.size}, from {natural.min():.4g} to {natural.max():.4g} Hz"
    yield "damping ratios", str(int(np.isfinite(modes.damping_ratio).sum()))
    yield "shapes", f"at {len(modes.sensors)} channels" if modes.sensors else "none"


def _of_frfs(experiment: Experiment, measured: Sequence[Measurement]) -> Iterator[tuple[str, str]]:
    first, lines = measured[0], np.asarray(experiment.frequency)
    yield "FRFs", f"{first.quantity} [{quantity_of(first.quantity).unit}]"
    yield "lines", f"{lines.size}, from {lines.min():.4g} to {lines.max():.4g} Hz"
    yield "averages", UNSTATED if first.averages is None else f"{first.averages:g}"
    yield "coherence", _coherence(measured)
    levels = [f"{each.force_level:g} N" for each in measured if each.force_level is not None]
    yield "force", ", ".join(levels) or UNSTATED


def _coherence(measured: Sequence[Measurement]) -> str:
    known = [each.coherence for each in measured if each.coherence is not None]
    values = np.concatenate([array[np.isfinite(array)] for array in known] or [np.zeros(0)])
    if not values.size:
        return UNSTATED
    return f"median {np.median(values):.3f}, least {values.min():.2g}"


def _channels(experiment: Experiment) -> Iterator[list[str]]:
    """A row for each sensor and actuator, with its channels."""
    for kind in ("sensor", "actuator"):
        channels = getattr(experiment, f"{kind}_channels")
        for name, of in getattr(experiment, kind).items():
            labels = ", ".join(channel.label for channel in channels if channel.name == name)
            yield [labels, kind, position_text(of.recorded), _gain(of.gain)]


def _gain(gain: Parameter | None) -> str:
    """Factor on the recorded FRFs; an unknown one as its prior."""
    return described(gain) if is_unknown(gain) else f"{1.0 if gain is None else gain:g}"


MOST = 3
"""Parameters that are told, those that moved the most."""


def moved_in_words(
    unknowns: Sequence[Unknown],
    priors: Mapping[str, np.ndarray],
    drawn: Mapping[str, float],
    fitted: Mapping[str, Mapping[str, float]],
) -> list[str]:
    """Say, a sentence for each model, how far the fit moved which parameters.

    Draws [draw, ...] are of the priors; values as drawn are recorded positions and means of priors.
    Elements of arrays are given one by one. Fitted values are by the name of a model.
    """
    rows = [
        (word, unknown, drawn[word], float(draws.std()))
        for unknown in unknowns
        if unknown.name in priors
        for word, draws in scalars(unknown.name, np.asarray(priors[unknown.name])[None])
    ]
    return [_sentence(model, values, rows) for model, values in fitted.items()]


def _sentence(
    model: str, values: Mapping[str, float], rows: list[tuple[str, Unknown, float, float]]
) -> str:
    known = [row for row in rows if row[0] in values and row[3] > 0]
    known.sort(key=lambda row: -abs(values[row[0]] - row[2]) / row[3])
    told = [_change(row, values[row[0]]) for row in known[:MOST]]
    if not told:
        return f"Nothing of the model as drawn is unknown, so that fitting moves nothing ({model})."
    return f"Fitted {model}, the model moved the most in {'; '.join(told)}."


def _change(row: tuple[str, Unknown, float, float], value: float) -> str:
    """Say from where to where a parameter moved, in standard deviations of its prior as well."""
    word, unknown, drawn, spread = row
    scale = readable(unknown.unit, unknown.field, max(abs(drawn), abs(value)))
    ends = [scale.number(number, spread / 10) for number in (drawn, value)]
    shift = (value - drawn) / spread
    after = f"{ends[1]} {scale.name}".rstrip()
    return f"{word}, from {ends[0]} to {after} ({shift:+.1f} standard deviations of its prior)"
