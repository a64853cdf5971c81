"""Unknowns whose posterior piles up at the edge of their prior."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ..._shared.sites import Role
from ...inference.estimates import scalars

EDGE = 0.025
"""Share of the prior that counts as its edge, on either side."""

PILED = 10.0
"""Ratio of posterior to prior probability at an edge from which the posterior counts as piled up.

With a correct model the two are equal on average, so by Markov's inequality at most one edge in ten
is reported by chance.
"""

_SIDES = ("lower", "upper")


def edges(posterior: xr.DataTree) -> xr.Dataset:
    """Posterior probability in the lowest and in the highest 2.5 % of the prior.

    By unknown and side: `share` of the posterior, `prior_share`, the value `at` which the edge
    begins, and whether the unknown is `piled_up` there.
    """
    prior_draws = dict(_scalar_draws(posterior["prior"].to_dataset()))
    posterior_draws = dict(_scalar_draws(posterior["posterior"].to_dataset()))
    rows = [_row(prior_draws[name], draws) for name, draws in posterior_draws.items()]
    columns = np.array(rows, dtype=float).reshape(len(rows), 3, len(_SIDES))
    share, prior_share, at = columns.swapaxes(0, 1)
    piled = (share >= PILED * prior_share) & (prior_share > 0)
    arrays = {"share": share, "prior_share": prior_share, "at": at, "piled_up": piled}
    variables = {name: (("unknown", "side"), array) for name, array in arrays.items()}
    return xr.Dataset(variables, coords={"unknown": list(posterior_draws), "side": list(_SIDES)})


def sentences(table: xr.Dataset) -> list[str]:
    """One sentence for each edge at which a posterior piles up."""
    return [
        sentence(unknown, side, float(edge["share"]), float(edge["prior_share"]))
        for unknown in table["unknown"].values
        for side in _SIDES
        for edge in [table.sel(unknown=unknown, side=side)]
        if bool(edge["piled_up"])
    ]


def sentence(unknown: str, side: str, share: float, prior_share: float) -> str:
    """Say how much of the posterior of an unknown lies at an edge of its prior."""
    return (
        f"{unknown} is piled up at the {side} edge of its prior: {100 * share:.0f} % of its "
        f"posterior lies in the outermost {100 * prior_share:.1f} % of the prior."
    )


def _scalar_draws(draws: xr.Dataset) -> Iterator[tuple[str, np.ndarray]]:
    for name, values in draws.data_vars.items():
        if _is_standard_error(values):
            continue
        yield from scalars(str(name), values.values)


def _is_standard_error(values: xr.DataArray) -> bool:
    """Whether these are errors of a model over their size, of which `check` tells apart."""
    role, field = values.attrs.get("role"), values.attrs.get("field")
    return role == Role.MODEL_ERROR.value and field == "standard"


def _row(prior: np.ndarray, posterior: np.ndarray) -> list[list[float]]:
    low, high = np.quantile(prior, [EDGE, 1 - EDGE])
    shares = [[np.mean(x <= low), np.mean(x >= high)] for x in (posterior, prior)]
    return [*shares, [low, high]]
