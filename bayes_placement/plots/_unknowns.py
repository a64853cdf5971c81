"""Draws of every unknown before and after the data, in the units in which people read them."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._shared.sites import Role
from ..inference.estimates import scalars
from ..inference.units import ReadableUnit, readable

Draws = Float[np.ndarray, "draw"]


class ScaledUnknown(NamedTuple):
    """One number that was unknown."""

    name: str
    """Its name."""
    attributes: Mapping[str, Any]
    """What it belongs to and is for, as in a tree of results."""
    scale: ReadableUnit
    """The unit in which it is told."""
    prior: Draws
    posterior: Draws
    """Its draws in that unit; no posterior where nothing was inferred."""

    @property
    def unit(self) -> str:
        """Its unit, 1 for a plain number."""
        return self.scale.name or "1"

    @property
    def label(self) -> str:
        """Name with its unit; of an angle of `orientation.rotation` also the axis of rotation."""
        component = self.attributes.get("component", "")
        is_angle = self.attributes.get("field") == "angles" and component
        about = f" about {'xyz'[int(component) - 1]}" if is_angle else ""
        return f"{self.name}{about} [{self.unit}]"

    @property
    def is_placement(self) -> bool:
        """Whether it says where a sensor or an actuator is, or how it is turned."""
        return bool(self.attributes["role"] == Role.PLACEMENT.value)

    @property
    def is_told_apart(self) -> bool:
        """Whether it is told by itself: not one of hundreds of errors in units of their size."""
        role, field = self.attributes["role"], self.attributes.get("field")
        return not (role == Role.MODEL_ERROR.value and field == "standard")

    def scaled(self, value: float) -> float:
        """Return a value in SI in its unit."""
        return value * self.scale.factor


def unknowns(prior: xr.Dataset, posterior: xr.Dataset | None) -> Iterator[ScaledUnknown]:
    """List every number of a prior, with its posterior where there is one."""
    known = {} if posterior is None else {str(name): posterior[name] for name in posterior}
    for name, draws in prior.data_vars.items():
        after = dict(scalars(str(name), known[str(name)].values)) if str(name) in known else {}
        for word, before in scalars(str(name), draws.values):
            yield _unknown(word, draws.attrs, np.ravel(before), np.ravel(after.get(word, [])))


def _unknown(
    name: str, attributes: Mapping[str, Any], prior: np.ndarray, posterior: np.ndarray
) -> ScaledUnknown:
    size = float(np.abs(posterior if posterior.size else prior).max())
    scale = readable(str(attributes["units"]), str(attributes["field"]), size)
    return ScaledUnknown(name, attributes, scale, prior * scale.factor, posterior * scale.factor)


def inferred(result: xr.DataTree) -> list[ScaledUnknown]:
    """Every number that was inferred and is told by itself."""
    listed = unknowns(result["prior"].to_dataset(), result["posterior"].to_dataset())
    return [unknown for unknown in listed if unknown.posterior.size and unknown.is_told_apart]
