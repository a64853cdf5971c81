"""tolerance: in, an experiment and places to try; out, what a smaller tolerance would buy.

Not known here: how information is estimated.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
import pandas as pd
import xarray as xr

from .._types import InfeasibleError, Key, Progress, no_progress
from ..experiment.experiment import Experiment
from .information._estimator import Estimator
from .maps import DOUBT, difference, information_map, lead

FACTORS = (1.0, 0.5, 0.25)

FACTOR = "tolerance_factor"
"""Name of their dimension; `tolerance` is an argument of xarray's `sel`."""


@dataclass(frozen=True)
class ToleranceStudy:
    """Maps of information for several tolerances.

    Parameters
    ----------
    maps
        As `information_map` returns them, along a dimension `tolerance_factor`: so many
        times the tolerance that is declared.
    table
        One row for each tolerance: the best place of each transducer [m]; `kl` there and `kl_se`
        [nat]; `bought`, by how much that is more than the best for the first tolerance, and its
        error; `moved`, what is lost where all stays at the first optimum, and its error.
    """

    maps: xr.Dataset = field(repr=False)
    table: pd.DataFrame

    def __str__(self) -> str:
        """Say for each tolerance where to measure and what it buys."""
        rows: Any = self.table.reset_index().to_dict("records")
        first = rows[0][FACTOR]
        return "\n".join(self._said(row, first) for row in rows)

    def _said(self, row: dict[str, Any], first: float) -> str:
        names = [str(name) for name in self.maps["information_gain"].dims if name != FACTOR]
        where = ", ".join(f"{name} at {row[name]}" for name in names)
        said = (
            f"{row[FACTOR]:g} times the tolerance: best {where}, {row['information_gain']:.3g} ± "
            f"{row['information_gain_se']:.1g} nat"
        )
        if row[FACTOR] == first:
            return f"{said}."
        bought = f"{row['improvement']:.2g} ± {row['improvement_se']:.1g} nat more"
        if row["relocation"] <= DOUBT * row["relocation_se"]:
            return f"{said}, {bought}; the first place is as good."
        return f"{said}, {bought}, of which {row['relocation']:.2g} for moving there."


def tolerance_study(
    experiment: Experiment,
    places: Mapping[str, Sequence[Any] | np.ndarray],
    *,
    factors: Sequence[float] = FACTORS,
    estimator: Estimator | None = None,
    about: Sequence[str] | None = None,
    nominal: Mapping[str, float] | None = None,
    key: int | Key = 0,
    executor: Executor | None = None,
    store: str | Path | None = None,
    progress: Progress = no_progress,
) -> ToleranceStudy:
    """Tell how the best placement moves, and how much more is learnt, with a smaller tolerance.

    What a drilling jig would buy. All maps share their random points.

    Parameters
    ----------
    experiment
        The experiment. Only transducers that are moved get other tolerances.
    places
        Recorded positions [m] to try, by the name of the transducer.
    factors
        Tolerances, as multiples of those declared; the first is what the others are compared with.
    estimator, about, nominal, key, executor, store, progress
        See `information_map`.

    Raises
    ------
    ValueError
        If a transducer has no tolerance, or a factor is not positive.
    """
    if not factors or min(factors) <= 0:
        raise InfeasibleError(
            f"factors={list(factors)} was given; positive multiples of the tolerance are needed: "
            "factors=(1, 0.5, 0.25)."
        )
    maps = [
        information_map(
            _glued(experiment, list(places), factor),
            places,
            estimator=estimator,
            about=about,
            nominal=nominal,
            key=key,
            executor=executor,
            store=store,
            progress=_part(progress, number, len(factors)),
        )
        for number, factor in enumerate(factors)
    ]
    return ToleranceStudy(_joined(maps, factors), _table(maps, factors))


def _glued(experiment: Experiment, names: Sequence[str], factor: float) -> Experiment:
    """The experiment with other tolerances of some transducers."""
    for name in names:
        for side in ("sensor", "actuator"):
            if name in getattr(experiment, side):
                experiment = _replaced(experiment, side, name, factor)
    return experiment


def _replaced(experiment: Experiment, side: str, name: str, factor: float) -> Experiment:
    new = getattr(experiment, side)[name].glued(factor, experiment.structure.modes)
    return eqx.tree_at(lambda tree: getattr(tree, side)[name], experiment, new)


def _part(progress: Progress, number: int, count: int) -> Progress:
    return lambda share: progress((number + share) / count)


def _joined(maps: list[xr.Dataset], factors: Sequence[float]) -> xr.Dataset:
    along = xr.DataArray(list(factors), dims=FACTOR, name=FACTOR, attrs={"units": "1"})
    return xr.concat(maps, dim=along, combine_attrs="override", data_vars="all")


def _table(maps: list[xr.Dataset], factors: Sequence[float]) -> pd.DataFrame:
    home = lead(maps[0]).best
    first = maps[0].isel(home)
    rows = []
    for factor, one in zip(factors, maps, strict=True):
        best, stayed = one.isel(lead(one).best), one.isel(home)
        bought, bought_se = difference(best, first)
        moved, moved_se = difference(best, stayed)
        rows.append(
            {FACTOR: factor}
            | {str(name): _place(best, str(name)) for name in one["information_gain"].dims}
            | {
                "information_gain": float(best["information_gain"]),
                "information_gain_se": float(best["information_gain_se"]),
            }
            | {
                "improvement": bought,
                "improvement_se": bought_se,
                "relocation": moved,
                "relocation_se": moved_se,
            }
        )
    return pd.DataFrame(rows).set_index(FACTOR)


def _place(one: xr.Dataset, name: str) -> Any:
    """Recorded place [m], three numbers in space."""
    if name in one.coords:
        return float(one[name])
    return tuple(float(one[f"{name}.{axis}"]) for axis in "xyz")
