"""Residuals of a fitted model, and groups of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import xarray as xr
from jaxtyping import Int

from ..._shared.arguments import check_kind
from ..._shared.errors import InputError
from ..._shared.labels import FORCE_LEVEL
from ...inference.output_residuals import Chosen, Residuals, levels_of, output_residuals

LINES_OF_BAND = 5
"""Fewest lines of a frequency band, where there are more bands than one."""

Labels: TypeAlias = Mapping[str, Sequence[object] | np.ndarray]

_NEEDED = ("posterior", "prior", "posterior_predictive", "observed_data")


@dataclass(frozen=True)
class Grouping:
    """A way to divide the data: the number of the group of each datum, and the groups' names."""

    dimensions: tuple[str, ...]
    coordinates: Labels
    number: Int[np.ndarray, "sensor actuator frequency"]
    shape: tuple[int, ...]

    def masks(self) -> Iterator[Chosen]:
        """Mask of the data of each group."""
        return (self.number == group for group in range(int(np.prod(self.shape))))

    def dataset(self, columns: dict[str, list[float]]) -> xr.Dataset:
        """Lay out one number for each group, column by column."""
        variables = {
            name: (self.dimensions, np.reshape(values, self.shape))
            for name, values in columns.items()
        }
        return xr.Dataset(variables, coords=self.coordinates)


def residuals(posterior: xr.DataTree) -> Residuals:
    """Read measured and predicted outputs from what `infer` returned."""
    _check(posterior)
    return output_residuals(posterior)


def groupings(data: Residuals, bands: int) -> dict[str, Grouping]:
    """Divide the data by sensor, actuator, channel pair, force level and frequency band."""
    sensors, actuators, lines = data.residual.shape[:3]
    shape = (sensors, actuators, lines)
    sensor, actuator, line = np.indices(shape)
    names = {side: data.template[side].values for side in ("sensor", "actuator")}
    band, edges = _modes(data.frequency) if data.is_modal else bands_of(data.frequency, bands)
    groupings = {
        "overall": Grouping((), {}, np.zeros(shape, int), ()),
        "sensor": Grouping(("sensor",), {"sensor": names["sensor"]}, sensor, (sensors,)),
        "actuator": Grouping(
            ("actuator",), {"actuator": names["actuator"]}, actuator, (actuators,)
        ),
        "channel": Grouping(
            ("sensor", "actuator"), names, sensor * actuators + actuator, (sensors, actuators)
        ),
        "band": Grouping(("band",), edges, band[line], (len(edges["band"]),)),
    }
    levels, number = levels_of(data.template)
    if levels.size:
        labels = {FORCE_LEVEL: (FORCE_LEVEL, levels, {"units": "N"})}
        groupings[FORCE_LEVEL] = Grouping((FORCE_LEVEL,), labels, number[line], (levels.size,))
    return groupings


def _check(posterior: xr.DataTree) -> None:
    needed = "the result of an inference is needed, since only a fitted model has a misfit"
    instead = "bp.check(bp.infer(experiment, measurement))"
    check_kind("posterior", posterior, xr.DataTree, needed, instead)
    missing = [name for name in _NEEDED if name not in posterior.children]
    if missing:
        raise InputError(
            f"A tree without the group {missing[0]} was given; the result of an inference is "
            "needed, since only a fitted model has a misfit: bp.check(bp.infer(experiment, "
            "measurement))."
        )


def bands_of(frequency: np.ndarray, bands: int) -> tuple[np.ndarray, Labels]:
    """Band of each line; all bands have as many lines."""
    distinct = np.unique(frequency)
    blocks = np.array_split(distinct, max(1, min(bands, distinct.size // LINES_OF_BAND)))
    low, high = (np.array([block[end] for block in blocks]) for end in (0, -1))
    names = [f"{a:.4g} to {b:.4g} Hz" for a, b in zip(low, high, strict=True)]
    limits = {"low": ("band", low, {"units": "Hz"}), "high": ("band", high, {"units": "Hz"})}
    return np.searchsorted(low, frequency, side="right") - 1, {"band": names, **limits}


def _modes(frequency: np.ndarray) -> tuple[np.ndarray, Labels]:
    """Each mode as a band of its own."""
    limits = {end: ("band", frequency, {"units": "Hz"}) for end in ("low", "high")}
    names = [f"{natural:.4g} Hz" for natural in frequency]
    return np.arange(frequency.size), {"band": names, **limits}
