"""A structure as the page draws it: lines or nodes, channels, tolerances, natural modes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..criticism.findings._shapes import outline_of, shapes
from ..experiment.experiment import Experiment
from ..positions._outlines import outline_of as tolerance_of
from ..positions.vectors import unit_vector
from .response import Values

DIGITS = 6
"""Digits of coordinates."""


def structure_for_page(experiment: Experiment) -> dict[str, Any]:
    """Return points [m] and lines of a structure, its transducers with axes and tolerances."""
    outline = outline_of(experiment)
    bounds = experiment.structure.modes.bounds()
    low, high = (np.resize(np.pad(np.atleast_1d(end), (0, 2)), 3) for end in bounds)
    return {
        "points": _rounded(outline["point"].values),
        "lines": outline["line"].values.tolist(),
        "on_a_line": bool(outline.attrs["on_a_line"]),
        "low": _rounded(low),
        "high": _rounded(high),
        "transducers": [
            _transducer(transducer, bounds)
            for side in (experiment.sensor, experiment.actuator)
            for transducer in side.values()
        ],
    }


def modes_for_page(experiment: Experiment, values: Values) -> dict[str, Any]:
    """Return natural frequencies [Hz] and mode shapes at the points of the structure."""
    found = shapes(experiment, values, outline_of(experiment))
    shape = found["shape"].values
    largest = np.abs(shape).max(axis=(1, 2), keepdims=True, initial=0.0)
    return {
        "frequency": _rounded(found["natural_frequency"].values),
        "shape": _rounded(shape / np.where(largest > 0, largest, 1.0)),
        "axes": list(found.attrs["axes"]),
    }


def _transducer(transducer: Any, bounds: Any) -> Mapping[str, Any]:
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


def _rounded(numbers: Any) -> Any:
    return np.round(np.asarray(numbers, dtype=float), DIGITS).tolist()
