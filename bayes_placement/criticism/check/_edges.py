"""Unknowns whose posterior is piled up at the edge of their prior."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...inference.estimates import scalars

EDGE = 0.025
"""Share of the prior that counts as its edge, on either side."""

PILED = 10.0
"""Times the prior's share from which the posterior counts as piled up.

Under a right model the posterior share is that of the prior on average, so by Markov's inequality
an edge is named without reason at most once in ten.
"""

_SIDES = ("lower", "upper")


def edges(posterior: xr.DataTree) -> xr.Dataset:
    """Share of the posterior in the outer 2.5 % of prior probability, on either side.

    Parameters
    ----------
    posterior
        What `infer` returned.

    Returns
    -------
    xarray.Dataset
        By unknown and side: `share` of the posterior, `prior_share`, the place `at` which the
        edge begins, and whether the unknown is `piled_up` there.
    """
    prior = dict(_numbers(posterior["prior"].to_dataset()))
    found = dict(_numbers(posterior["posterior"].to_dataset()))
    rows = [_row(prior[name], draws) for name, draws in found.items()]
    columns = np.array(rows, dtype=float).reshape(len(rows), 3, len(_SIDES))
    share, prior_share, at = columns.swapaxes(0, 1)
    piled = (share >= PILED * prior_share) & (prior_share > 0)
    arrays = {"share": share, "prior_share": prior_share, "at": at, "piled_up": piled}
    variables = {name: (("unknown", "side"), array) for name, array in arrays.items()}
    return xr.Dataset(variables, coords={"unknown": list(found), "side": list(_SIDES)})


def sentences(found: xr.Dataset) -> list[str]:
    """Name what is piled up."""
    return [
        f"{unknown} is piled up at the {side} edge of its prior: "
        f"{100 * float(one['share']):.0f} % of its posterior lies in the outer "
        f"{100 * float(one['prior_share']):.1f} % of prior probability."
        for unknown in found["unknown"].values
        for side in _SIDES
        for one in [found.sel(unknown=unknown, side=side)]
        if bool(one["piled_up"])
    ]


def _numbers(draws: xr.Dataset) -> Iterator[tuple[str, np.ndarray]]:
    for name, values in draws.data_vars.items():
        yield from scalars(str(name), values.values)


def _row(prior: np.ndarray, posterior: np.ndarray) -> list[list[float]]:
    low, high = np.quantile(prior, [EDGE, 1 - EDGE])
    shares = [[np.mean(x <= low), np.mean(x >= high)] for x in (posterior, prior)]
    return [*shares, [low, high]]
