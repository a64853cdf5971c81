"""Information gained by a smaller tolerance of the positions, such as by a drilling jig."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.garbage import long_computation
from .._shared.progress import Progress, shown
from .._shared.reprs import notebook_html
from ..experiment.experiment import Experiment
from ..positions.vectors import Recorded, triple
from ._candidates import transducer, with_transducers
from .maps import SIGNIFICANT, difference, information_map, lead
from .running.evaluation import part_of_progress

FACTORS = (1.0, 0.5, 0.25)

FACTOR = "tolerance_factor"
"""Name of their dimension; `tolerance` is an argument of xarray's `sel`."""


@dataclass(frozen=True, repr=False)
class ToleranceStudy:
    """Maps of the information gain for several tolerances.

    Parameters
    ----------
    maps
        As `information_map` returns them, along a dimension `tolerance_factor`: the multiple of the
        declared tolerance.
    table
        One row for each tolerance: the best position of each transducer [m]; `information_gain`
        there and `information_gain_se` [nat]; `improvement`, its difference from the best for the
        first tolerance, and its error `improvement_se`; `relocation`, the part of it that is lost
        if all transducers stay at the first optimum, and its error `relocation_se`.

    Examples
    --------
    >>> study.table.columns[:3].tolist(), len(study.table)
    (['s1', 'information_gain', 'information_gain_se'], 2)
    """

    maps: xr.Dataset = field(repr=False)
    table: pd.DataFrame

    def __repr__(self) -> str:
        """State how many tolerances were studied."""
        return f"ToleranceStudy of {len(self.table)} tolerances"

    def _repr_html_(self) -> str:
        return notebook_html(repr(self), self.table, str(self).splitlines())

    def __str__(self) -> str:
        """State for each tolerance the best positions and the improvement."""
        rows = self.table.reset_index().to_dict("records")
        first = rows[0][FACTOR]
        return "\n".join(self._in_words(row, first) for row in rows)

    def _in_words(self, row: dict[Hashable, Any], first: float) -> str:
        names = [str(name) for name in self.maps["information_gain"].dims if name != FACTOR]
        where = ", ".join(f"{name} at {row[name]} m" for name in names)
        words = (
            f"{row[FACTOR]:g} times the tolerance: best {where}, {row['information_gain']:.3g} ± "
            f"{row['information_gain_se']:.1g} nat"
        )
        if row[FACTOR] == first:
            return f"{words}."
        words += f", {row['improvement']:.2g} ± {row['improvement_se']:.1g} nat more"
        if row["relocation"] <= SIGNIFICANT * row["relocation_se"]:
            return f"{words}; the best place at {first:g} times the tolerance gives as much."
        return f"{words}, of which {row['relocation']:.2g} for moving there."


@arguments_checked
@long_computation()
def tolerance_study(
    experiment: Experiment,
    places: Mapping[str, Sequence[object] | np.ndarray],
    *,
    factors: Sequence[float] = FACTORS,
    progress: Progress | None = None,
    **settings: Any,
) -> ToleranceStudy:
    """Compare the best placement and its information gain for several tolerances.

    It shows the value of a drilling jig. All maps share their random points.

    Parameters
    ----------
    experiment
        The experiment. Only the tolerances of transducers that are moved change.
    places
        Recorded positions [m] to try, by the name of the transducer.
    factors
        Tolerances, as multiples of those declared; the first is what the others are compared with.
    progress
        As of `information_map`.
    **settings
        `estimator`, `about`, `nominal`, `key`, `lines`, `executor`, `store` and `chunk` of
        `information_map`.

    Returns
    -------
    ToleranceStudy
        Maps by tolerance, and a table with the best placement of each tolerance.

    Raises
    ------
    InputError
        If a transducer has no tolerance, or a factor is not positive.

    Examples
    --------
    >>> study = bp.design.tolerance_study(
    ...     experiment, places, factors=(1.0, 0.5), estimator=estimator
    ... )
    >>> study.maps.sizes["tolerance_factor"]
    2
    """
    if not factors or min(factors) <= 0:
        raise InputError(
            f"factors={list(factors)} was given; positive multiples of the tolerance are needed: "
            "factors=(1, 0.5, 0.25)."
        )
    with shown(progress, "tolerances") as report:
        maps = [
            information_map(
                _with_tolerance(experiment, list(places), factor),
                places,
                progress=part_of_progress(report, number, len(factors)),
                **settings,
            )
            for number, factor in enumerate(factors)
        ]
    return ToleranceStudy(_joined(maps, factors), _table(maps, factors))


def _with_tolerance(experiment: Experiment, names: Sequence[str], factor: float) -> Experiment:
    """The experiment with scaled tolerances of some transducers."""
    modes = experiment.structure.modes
    changed = {name: transducer(experiment, name).mounted(factor, modes) for name in names}
    return with_transducers(experiment, changed)


def _joined(maps: list[xr.Dataset], factors: Sequence[float]) -> xr.Dataset:
    dimension = xr.DataArray(list(factors), dims=FACTOR, name=FACTOR, attrs={"units": "1"})
    return xr.concat(maps, dim=dimension, combine_attrs="override", data_vars="all")


def _table(maps: list[xr.Dataset], factors: Sequence[float]) -> pd.DataFrame:
    home = lead(maps[0]).best
    first = maps[0].isel(home)
    rows = []
    for factor, learnt in zip(factors, maps, strict=True):
        best, at_home = learnt.isel(lead(learnt).best), learnt.isel(home)
        row: dict[str, Recorded] = {FACTOR: factor}
        row |= {str(name): _position(best, str(name)) for name in learnt["information_gain"].dims}
        row |= {name: float(best[name]) for name in ("information_gain", "information_gain_se")}
        row["improvement"], row["improvement_se"] = difference(best, first)
        row["relocation"], row["relocation_se"] = difference(best, at_home)
        rows.append(row)
    return pd.DataFrame(rows).set_index(FACTOR)


def _position(cell: xr.Dataset, name: str) -> Recorded:
    """Recorded position [m], three numbers in space."""
    if name in cell.coords:
        return float(cell[name])
    return triple([cell[f"{name}.{axis}"] for axis in "xyz"])
