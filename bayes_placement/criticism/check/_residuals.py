"""Measured and predicted outputs of a result as arrays, and groups of them."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float, Int

from ..._types import InputError, check_kind
from ...experiment.experiment import FORCE_LEVEL, MEASURED, RESPONSE
from ...experiment.observed_modes import COLUMN
from ...inference.estimates import scalars
from ...inference.results import RESPONSE_WHEN_EXACT, observed_of

BAND = (0.05, 0.95)
LINES_OF_BAND = 5
"""Fewest lines of a frequency band, where there are more bands than one."""

_NEEDED = ("posterior", "prior", "posterior_predictive", "observed_data")

FRFParts = Float[np.ndarray, "sensor actuator frequency part"]
Draws = Float[np.ndarray, "draw sensor actuator frequency part"]
Chosen = Bool[np.ndarray, "sensor actuator frequency"]
Labelled = TypeVar("Labelled", xr.DataArray, xr.Dataset)


@dataclass(frozen=True)
class Residuals:
    """Measured outputs and those of the model.

    The lines of all force levels are concatenated, sorted within each level, so that every
    statistic runs along one axis; `labelled` separates them again.

    Parameters
    ----------
    template
        Measured outputs with their labels.
    measured
        Measured outputs; zero where nothing was measured.
    present
        Where something was measured.
    draws
        Outputs of the model at draws from the posterior.
    replicates
        The same with an output error drawn for each; None where the model has no output error.
    deviation
        Standard deviation of the noise of each output; None where the noise is not known.
    frequency
        Lines [Hz].
    force_level
        Number of the force level of each line; zero where there is a single level.
    unknowns
        Number of unknowns that were fitted.
    """

    template: xr.DataArray
    measured: FRFParts
    present: Bool[np.ndarray, "sensor actuator frequency part"]
    draws: Draws
    replicates: Draws | None
    deviation: FRFParts | None
    frequency: Float[np.ndarray, "frequency"]
    force_level: Int[np.ndarray, "frequency"]
    unknowns: int

    @property
    def is_modal(self) -> bool:
        """Whether lines are modes, of which none is the neighbour of another."""
        return shows_modes(self.template)

    @cached_property
    def mean(self) -> FRFParts:
        """Posterior mean of the response."""
        return self.draws.mean(axis=0)

    @cached_property
    def residual(self) -> FRFParts:
        """Measured outputs less the posterior mean response; zero where nothing was measured."""
        return np.where(self.present, self.measured - self.mean, 0.0)

    @cached_property
    def scale(self) -> FRFParts:
        """Deviation of the noise where known, else of the replicates, else of the residuals."""
        if self.deviation is not None:
            return self.deviation
        if self.replicates is not None:
            return np.sqrt(np.mean((self.replicates - self.draws) ** 2, axis=0))
        axes = (2, 3)
        count = np.maximum(self.present.sum(axes, keepdims=True), 1)
        size = np.sqrt(np.sum(self.residual**2, axes, keepdims=True) / count)
        return np.broadcast_to(np.where(size > 0, size, 1.0), self.residual.shape)

    def labelled(self, values: Any, **attributes: str) -> xr.DataArray:
        """Put the labels of the outputs on an array; NaN where nothing was measured."""
        array = np.where(self.present, values, np.nan)
        flat = self.template.copy(data=array if "part" in self.template.dims else array[..., 0])
        return by_level(flat.assign_attrs(attributes))

    def labelled_lines(self, values: Any, **attributes: str) -> xr.DataArray:
        """Put the labels on one number for each line, both parts together."""
        template = self.template
        flat = template.isel(part=0, drop=True) if "part" in template.dims else template
        array = np.where(self.present[..., 0], values, np.nan)
        return by_level(flat.copy(data=array).assign_attrs(attributes))


@dataclass(frozen=True)
class Grouping:
    """A way to divide the data: the number of the group of each datum, and the groups' names."""

    dimensions: tuple[str, ...]
    coordinates: dict[str, Any]
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


def shows_modes(labelled: Any) -> bool:
    """Whether outputs are modal parameters, by their labels."""
    return labelled["actuator"].values.tolist() == [COLUMN]


def residuals(posterior: xr.DataTree) -> Residuals:
    """Read measured and predicted outputs from what `infer` returned."""
    _check(posterior)
    observed = _in_order(observed_of(posterior))
    predicted = _in_order(posterior["posterior_predictive"].to_dataset())
    template = _transposed(observed[MEASURED], ())
    raw = _with_part(template)
    draws = _flat_draws(predicted[RESPONSE])
    if draws.shape[0] < 2:
        raise InputError(
            "The posterior holds one draw of the response; at least two are needed, since the "
            "expected misfit follows from their spread. Draw more: engines.SMC(particles=1000)."
        )
    return Residuals(
        template=template,
        measured=np.where(np.isfinite(raw), raw, 0.0),
        present=np.isfinite(raw),
        draws=draws,
        replicates=_flat_draws(predicted[MEASURED]) if MEASURED in predicted else None,
        deviation=_deviation(observed),
        frequency=np.asarray(template["frequency"].values, dtype=float),
        force_level=_levels(template)[1],
        unknowns=sum(len(scalars("", v.values)) for v in posterior["posterior"].data_vars.values()),
    )


def response_when_exact(posterior: xr.DataTree) -> FRFParts | None:
    """Mean response without the errors of the model; None where it has none."""
    predicted = posterior["posterior_predictive"].to_dataset()
    if RESPONSE_WHEN_EXACT not in predicted:
        return None
    ordered = _in_order(predicted)
    mean: FRFParts = _flat_draws(ordered[RESPONSE_WHEN_EXACT]).mean(axis=0)
    return mean


def groupings(data: Residuals, bands: int) -> dict[str, Grouping]:
    """Divide the data by sensor, actuator, channel pair, force level and frequency band."""
    sensors, actuators, lines = data.residual.shape[:3]
    shape = (sensors, actuators, lines)
    sensor, actuator, line = np.indices(shape)
    names = {side: data.template[side].values for side in ("sensor", "actuator")}
    band, edges = _modes(data.frequency) if data.is_modal else _bands(data.frequency, bands)
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
    levels, number = _levels(data.template)
    if levels.size:
        labels = {FORCE_LEVEL: (FORCE_LEVEL, levels, {"units": "N"})}
        groupings[FORCE_LEVEL] = Grouping((FORCE_LEVEL,), labels, number[line], (levels.size,))
    return groupings


def by_level(flat: Labelled) -> Labelled:
    """Separate concatenated force levels along a dimension of their own."""
    levels, number = _levels(flat)
    if not levels.size:
        return flat
    runs = [
        flat.isel(frequency=np.flatnonzero(number == level)).drop_vars(FORCE_LEVEL)
        for level in range(levels.size)
    ]
    options: dict[str, Any] = {"coords": "minimal", "compat": "override", "join": "override"}
    levelled = xr.concat(runs, FORCE_LEVEL, **options)
    ordered = levelled.transpose("sensor", "actuator", FORCE_LEVEL, "frequency", ...)
    return ordered.assign_coords({FORCE_LEVEL: (FORCE_LEVEL, levels, {"units": "N"})})


def band_of(draws: Any, axis: int = 0) -> tuple[Any, Any, Any]:
    """Median and 5 % and 95 % quantiles over draws."""
    low, median, high = np.quantile(draws, [BAND[0], 0.5, BAND[1]], axis=axis)
    return median, low, high


def _check(posterior: xr.DataTree) -> None:
    check_kind(
        "posterior",
        posterior,
        xr.DataTree,
        "the result of an inference is needed, since only a fitted model has a misfit",
        "bp.check(bp.infer(experiment, measurement))",
    )
    missing = [name for name in _NEEDED if name not in posterior.children]
    if missing:
        raise InputError(
            f"A tree without the group {missing[0]} was given; the result of an inference is "
            "needed, since only a fitted model has a misfit: bp.check(bp.infer(experiment, "
            "measurement))."
        )


def _in_order(dataset: xr.Dataset) -> xr.Dataset:
    """Sort the lines and concatenate those of all force levels."""
    ordered = dataset.sortby("frequency")
    if FORCE_LEVEL not in ordered.dims:
        return ordered
    lines = (FORCE_LEVEL, "frequency")
    flat = ordered.sortby(FORCE_LEVEL).stack(line=lines, create_index=False)
    return flat.swap_dims(line="frequency")


def _levels(labelled: Any) -> tuple[Any, Any]:
    """Force levels [N], none where they are not known, and the number of the level of each line."""
    if FORCE_LEVEL not in labelled.coords:
        return np.empty(0), np.zeros(labelled.sizes["frequency"], int)
    levels, number = np.unique(labelled[FORCE_LEVEL].values, return_inverse=True)
    return levels, number


def _bands(frequency: np.ndarray, bands: int) -> tuple[np.ndarray, dict[str, Any]]:
    """Band of each line; all bands have as many lines."""
    distinct = np.unique(frequency)
    blocks = np.array_split(distinct, max(1, min(bands, distinct.size // LINES_OF_BAND)))
    low, high = (np.array([block[end] for block in blocks]) for end in (0, -1))
    names = [f"{a:.4g} to {b:.4g} Hz" for a, b in zip(low, high, strict=True)]
    limits = {"low": ("band", low, {"units": "Hz"}), "high": ("band", high, {"units": "Hz"})}
    return np.searchsorted(low, frequency, side="right") - 1, {"band": names, **limits}


def _modes(frequency: np.ndarray) -> tuple[np.ndarray, dict[str, Any]]:
    """Each mode as a band of its own."""
    limits = {end: ("band", frequency, {"units": "Hz"}) for end in ("low", "high")}
    names = [f"{natural:.4g} Hz" for natural in frequency]
    return np.arange(frequency.size), {"band": names, **limits}


def _transposed(values: xr.DataArray, leading: tuple[str, ...]) -> xr.DataArray:
    trailing = ("part",) if "part" in values.dims else ()
    return values.transpose(*leading, "sensor", "actuator", "frequency", *trailing)


def _with_part(values: xr.DataArray) -> Any:
    array = np.asarray(values.values, dtype=float)
    return array if "part" in values.dims else array[..., None]


def _flat_draws(values: xr.DataArray) -> Any:
    array = _with_part(_transposed(values, ("chain", "draw")))
    return array.reshape(-1, *array.shape[2:])


def _deviation(observed: xr.Dataset) -> Any:
    if "deviation" not in observed:
        return None
    deviation = _with_part(_transposed(observed["deviation"], ()))
    return np.where(np.isfinite(deviation), deviation, 1.0)
