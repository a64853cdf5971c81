"""Labelled arrays and warnings of a tree of results, in ArviZ's words."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from .._shared.labels import FORCE_LEVEL
from .._shared.sites import Unknown

if TYPE_CHECKING:  # a report reads results without the first, a page stands before the second
    import xarray as xr

    from ..experiment.experiment import Experiment

WARNINGS = "warnings"
"""Attribute of a tree of results that holds what the inference warns of, a list of sentences."""

RESPONSE_WHEN_EXACT = "response_when_exact"
"""Name of the outputs without the errors of the model, where it has some."""

CONSTANTS = "constant_data"
"""Group of a tree of results with what is known of each datum besides its value."""

MISFIT = "misfit"
"""Attribute of a tree of results that says that the model fails; there where it does."""

DATA_FAULTS = "data_faults"
"""Attribute of a tree of results that holds the faults of the measurement, a list of sentences."""


def data_faults_of(result: "xr.DataTree") -> list[str]:
    """Sentences on faults of the measurement that was given; empty where there are none."""
    return _sentences(result, DATA_FAULTS)


def observed_of(result: "xr.DataTree") -> "xr.Dataset":
    """Measured outputs, and what is known of each: noise, receptance, change of variables.

    Results of former versions hold all of that in the group of the measured outputs.
    """
    observed = result["observed_data"].to_dataset()
    if CONSTANTS not in result.children:
        return observed
    return observed.merge(result[CONSTANTS].to_dataset(), combine_attrs="override")


def warnings_of(result: "xr.DataTree") -> list[str]:
    """Sentences in which an inference warns of itself; empty where it has nothing to warn of."""
    return _sentences(result, WARNINGS)


def misfit_of(result: "xr.DataTree") -> list[str]:
    """Sentence that says that the model fails; none where it does not, or its noise is unknown."""
    return _sentences(result, MISFIT)


def _sentences(result: "xr.DataTree", attribute: str) -> list[str]:
    """Sentences of an attribute.

    netCDF keeps a list of one string as a string, and an empty list as an array of no numbers.
    """
    return [str(sentence) for sentence in np.atleast_1d(result.attrs.get(attribute, []))]


def named_draws(experiment: "Experiment", values: Mapping[str, object]) -> "xr.Dataset":
    """Draws [chain, draw, ...] of the unknowns, in their order, with units and roles."""
    import xarray as xr

    variables = {}
    for unknown in experiment.unknowns:
        if unknown.name in values:
            array = np.asarray(values[unknown.name])
            extra = [f"{unknown.name}_dim_{i}" for i in range(array.ndim - 2)]
            dimensions = ("chain", "draw", *extra)
            variables[unknown.name] = (dimensions, array, _attributes(unknown))
    return numbered(xr.Dataset(variables))


def _attributes(unknown: Unknown) -> dict[str, str]:
    """What an unknown belongs to and is for, so that a file of results tells it as well."""
    return {
        "units": unknown.unit,
        "role": unknown.role.value,
        "owner": " ".join(word for word in unknown.owner if word),
        "field": unknown.field,
        "component": unknown.component,
    }


def numbered(dataset: "xr.Dataset") -> "xr.Dataset":
    """Number chains and draws from zero; where nothing is unknown there are none to count."""
    dimensions = [name for name in ("chain", "draw") if name in dataset.sizes]
    return dataset.assign_coords({name: np.arange(dataset.sizes[name]) for name in dimensions})


def outputs(
    experiment: "Experiment", variables: Mapping[str, object], leading: tuple[str, ...]
) -> "xr.Dataset":
    """Arrays of outputs with the names of channels, force levels where there are, parts, lines.

    They are [*leading, sensor, actuator, (force_level,) (part,) frequency].
    """
    import xarray as xr

    parts = ("part",) if experiment.observe.parts > 1 else ()
    levels = () if experiment.force_levels is None else (FORCE_LEVEL,)
    dimensions = (*leading, "sensor", "actuator", *levels, *parts, "frequency")
    units = {"units": experiment.observe.label}
    dataset = xr.Dataset({n: (dimensions, np.asarray(v), units) for n, v in variables.items()})
    coordinates: dict[str, object] = {
        "sensor": experiment.observe.rows(experiment.sensor_channels),
        "actuator": experiment.observe.columns(experiment.actuator_channels),
        "frequency": ("frequency", np.asarray(experiment.frequency), {"units": "Hz"}),
    }
    if levels:
        amplitudes = np.asarray(experiment.force_levels)
        coordinates[FORCE_LEVEL] = (FORCE_LEVEL, amplitudes, {"units": "N"})
    if parts:
        coordinates["part"] = ["real", "imaginary"]
    return dataset.assign_coords(coordinates)
