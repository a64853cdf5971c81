"""How large the model error of a fitted model had to be, and where it is largest."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..._shared.sites import Role
from ...experiment.model_error import OF_WHAT
from ...inference.units import percent

COUNTED = {
    "frequency": "mode",
    "damping": "mode",
    "shape": "mode",
    "stiffness_and_mass": "piece",
    "runs": "mode",
}
"""What is counted along the last dimension of errors of a kind."""


class Errors(NamedTuple):
    """Errors of one kind, `frequency` for example.

    The size is the median, with its 90 % interval [1]; NaN where it was not unknown. `largest` is
    the greatest of the errors at the posterior mean [1], over its size where that was known, and
    `where` its mode or channel, in words.
    """

    kind: str
    low: float
    size: float
    high: float
    largest: float
    where: str

    def words(self) -> str:
        """Say how large the errors are and where the largest is."""
        of_what = OF_WHAT[self.kind]
        if np.isnan(self.size):
            return f"{of_what} by at most {abs(self.largest):.2g} times its size ({self.where})"
        return (
            f"{of_what} by {percent(self.size)} (90 %: {percent(self.low)} to "
            f"{percent(self.high)}; {self.where}: {percent(self.largest)})"
        )


def model_error(posterior: xr.DataTree) -> tuple[Errors, ...]:
    """Errors of each kind that a result of `infer` holds."""
    draws = {
        str(name): array
        for name, array in posterior["posterior"].data_vars.items()
        if array.attrs.get("role") == Role.MODEL_ERROR.value
    }
    kinds = dict.fromkeys(array.attrs["owner"] for array in draws.values())
    return tuple(_of_kind(kind, draws) for kind in kinds)


def sentences(errors: tuple[Errors, ...]) -> list[str]:
    """One sentence on the errors of all kinds."""
    if not errors:
        return []
    return [f"The model errs: {', '.join(error.words() for error in errors)}."]


def _of_kind(kind: str, draws: dict[str, xr.DataArray]) -> Errors:
    of_kind = [array for array in draws.values() if array.attrs["owner"] == kind]
    sizes = [array.values for array in of_kind if array.attrs["field"] == "size"]
    quantiles = np.quantile(sizes[0], [0.05, 0.5, 0.95]) if sizes else np.full(3, np.nan)
    factor = sizes[0] if sizes else np.ones(())
    standard = [array for array in of_kind if array.attrs["field"] == "standard"]
    named = [pair for array in standard for pair in _means(array, factor)]
    where, largest = max(named, key=lambda pair: abs(pair[1]))
    low, size, high = map(float, quantiles)
    return Errors(kind, low, size, high, largest, where)


def _means(array: xr.DataArray, size: np.ndarray) -> Iterator[tuple[str, float]]:
    """Place of each error in words, and its posterior mean."""
    product = array.values * np.reshape(size, size.shape + (1,) * (array.ndim - size.ndim))
    means = np.mean(product, axis=(0, 1))
    counted = COUNTED.get(array.attrs["owner"])
    transducer = array.attrs["component"].replace(".", " ")
    for index, mean in np.ndenumerate(means):
        number = f"{counted} {index[-1] + 1}" if counted else ""
        number += f" of {means.size}" if counted == "piece" else ""
        yield ", ".join(filter(None, [transducer, number])), float(mean)
