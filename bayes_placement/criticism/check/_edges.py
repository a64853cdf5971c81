"""Unknowns that pile up at the edge of their prior, and errors that the model needed."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..._shared.sites import Role
from ...experiment.model_error import OF_WHAT
from ...inference.estimates import scalars
from ...inference.units import percent

EDGE = 0.025
"""Share of the prior that counts as its edge, on either side."""

BOUND = EDGE / 10
"""Share of the prior that counts as its bound, within the edge."""

FALLEN = 0.5
"""Posterior over prior at the bound, over that in the whole edge, below which nothing is cut off.

The edge of a prior that is log-uniform over decades is wide: a third of the value at its end. What
lies there and falls off towards the bound has its value there.
"""

PILED = 10.0
"""Ratio of posterior to prior probability at an edge from which the posterior counts as piled up.

With a correct model the two are equal on average, so by Markov's inequality at most one edge in ten
is reported by chance.
"""

MOST_TOLD = 3
"""Unknowns that are piled up, each in a sentence of its own."""

_SIDES = ("lower", "upper")


def edges(posterior: xr.DataTree) -> xr.Dataset:
    """Posterior probability in the lowest and in the highest 2.5 % of the prior.

    By unknown and side: `share` of the posterior, `prior_share`, the value `at` which the edge
    begins, and whether the unknown is `piled_up` there.
    """
    prior_draws = dict(_scalar_draws(posterior["prior"].to_dataset()))
    posterior_draws = dict(_scalar_draws(posterior["posterior"].to_dataset()))
    rows = [_row(prior_draws[name], draws) for name, draws in posterior_draws.items()]
    columns = np.array(rows, dtype=float).reshape(len(rows), 4, len(_SIDES))
    share, prior_share, at, share_at_bound = columns.swapaxes(0, 1)
    piled = (share >= PILED * prior_share) & (prior_share > 0) & leans(share, share_at_bound)
    arrays = {"share": share, "prior_share": prior_share, "at": at, "piled_up": piled}
    variables = {name: (("unknown", "side"), array) for name, array in arrays.items()}
    return xr.Dataset(variables, coords={"unknown": list(posterior_draws), "side": list(_SIDES)})


def edges_in_words(table: xr.Dataset) -> list[str]:
    """Say at which edges posteriors pile up."""
    return sentences(
        (unknown, side, float(edge["share"]), float(edge["prior_share"]))
        for unknown in table["unknown"].values
        for side in _SIDES
        for edge in [table.sel(unknown=unknown, side=side)]
        if bool(edge["piled_up"])
    )


def sentences(piled_up: Iterable[tuple[str, str, float, float]]) -> list[str]:
    """Say which unknowns are piled up at which side, and by how much more than their priors.

    One sentence for each of a few; of more of them one alone.
    """
    piled_up = list(piled_up)
    if len(piled_up) > MOST_TOLD:
        named = ", ".join(f"{unknown} ({side})" for unknown, side, _, _ in piled_up)
        return [
            f"{len(piled_up)} unknowns are piled up at an edge of their priors: {named}. What the "
            "model lacks is elsewhere, or these priors are too narrow."
        ]
    return [
        f"{unknown} is piled up at the {side} edge of its prior: {100 * share:.0f} % of its "
        f"posterior lies in the outermost {100 * prior_share:.1f} % of the prior."
        for unknown, side, share, prior_share in piled_up
    ]


def _scalar_draws(draws: xr.Dataset) -> Iterator[tuple[str, np.ndarray]]:
    for name, values in draws.data_vars.items():
        if _is_standard_error(values):
            continue
        yield from scalars(str(name), values.values)


def _is_standard_error(values: xr.DataArray) -> bool:
    """Whether these are errors of a model over their size, of which `check` tells apart."""
    role, field = values.attrs.get("role"), values.attrs.get("field")
    return role == Role.MODEL_ERROR.value and field == "standard"


def leans(share: np.ndarray | float, share_at_bound: np.ndarray | float) -> np.ndarray:
    """Whether a posterior of these shares does not fall off within the edge towards the bound."""
    return np.asarray(share_at_bound / BOUND >= FALLEN * share / EDGE)


def _row(prior: np.ndarray, posterior: np.ndarray) -> list[list[float]]:
    low, high = np.quantile(prior, [EDGE, 1 - EDGE])
    ends = np.quantile(prior, [BOUND, 1 - BOUND])
    shares = [_shares(draws, low, high) for draws in (posterior, prior)]
    return [*shares, [low, high], _shares(posterior, *ends)]


def _shares(draws: np.ndarray, low: float, high: float) -> list[float]:
    return [float(np.mean(draws <= low)), float(np.mean(draws >= high))]


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


def errors_in_words(errors: tuple[Errors, ...]) -> list[str]:
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
