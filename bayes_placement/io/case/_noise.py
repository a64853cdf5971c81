"""Output error of a case: what variance or coherence state, or a ratio and a floor."""

from collections.abc import Sequence

import numpy as np
from numpyro.distributions import LogUniform

from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ...experiment.measurement import Measurement
from ...experiment.noise import FromCoherence, FromScatter, FromVariance, Noise, Relative
from .._gate import is_number
from ._json_fields import CaseError, FieldRule, JsonObject

RATIO, FLOOR = (1e-3, 0.3), (1e-4, 0.3)
"""Noise over |H|, and over the median of |H|, where neither the case nor a coherence states it."""


def stated_noise(measurement: JsonObject) -> Noise | None:
    """Read the field `noise_level` of a measurement; None without the field."""
    if not measurement.has("noise_level"):
        return None
    stated = measurement.object("noise_level")
    factor = _level(stated, "coherence_factor", 1.0) if stated.has("coherence_factor") else None
    if stated.has("ratio"):
        floor = _level(stated, "floor", 1e-3) if stated.has("floor") else 0.0
        return Relative(_level(stated, "ratio", 0.03), floor, coherence=factor)
    if factor is None:
        raise CaseError(
            f"{stated.file} has neither {stated.dotted_path('ratio')} nor "
            f"{stated.dotted_path('coherence_factor')}; one of them is needed, since a likelihood "
            'needs the size of the error. Write "noise_level": {"ratio": [0.001, 0.1]}.'
        )
    return FromCoherence(factor)


def noise_by_data(runs: Sequence[Measurement]) -> Noise:
    """What variance or coherence state, else the scatter of lines.

    Where lines are too few for that, unknown shares of |H| and of its median.
    """
    if all(run.variance is not None for run in runs):
        return FromVariance()
    if any(run.coherence is not None for run in runs):
        return FromCoherence()
    if all(map(_tells_scatter, runs)):
        return FromScatter()
    median = float(
        np.median(np.concatenate([np.abs(run.frf[run.measured]).ravel() for run in runs]))
    )
    return Relative(LogUniform(*RATIO), LogUniform(*(share * median for share in FLOOR)))


def _tells_scatter(run: Measurement) -> bool:
    try:
        run.scatter_variance()
    except InputError:
        return False
    return True


def _level(stated: JsonObject, name: str, example: float) -> Parameter:
    """Return a level, or the log-uniform distribution between two."""
    rule = FieldRule(
        "a positive number, or two increasing ones between which it is log-uniform,",
        [example / 10, example * 10],
        _is_level,
    )
    value = stated.value(name, rule)
    return LogUniform(*map(float, value)) if isinstance(value, list) else float(value)


def _is_level(value: object) -> bool:
    if isinstance(value, list):
        return len(value) == 2 and all(map(is_number, value)) and 0 < value[0] < value[1]
    return is_number(value) and value > 0
