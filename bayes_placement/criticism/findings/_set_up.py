"""The set-up of a test in words: structure, channels, lines, averages, coherence."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..._shared.dimensions import Parameter
from ..._shared.ranges import described
from ..._shared.sites import is_unknown
from ...experiment.experiment import Experiment, Measurements
from ...experiment.measurement import Measurement
from ...experiment.modal_parameters import ModalParameters
from ...experiment.quantities import quantity_of
from ...positions.bounds import position_text

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
