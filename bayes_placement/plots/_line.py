"""Places on a structure that lies along one line: one number each, also where it lies in space."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from ..positions.vectors import PointsInSpace, Recorded
from ._instruments import FLAT


class Line(NamedTuple):
    """The axis in space along which a structure lies; None for one whose places are numbers."""

    axis: int | None = None

    @property
    def label(self) -> str:
        """Name of the axis of a figure."""
        which = "" if self.axis is None else f", {'xyz'[self.axis]}"
        return f"place along the structure{which} [m]"

    def at(self, place: Recorded | np.ndarray) -> float:
        """Where a place lies along it [m]."""
        return float(np.ravel(place)[self.axis or 0])

    def with_at(self, table: pd.DataFrame) -> pd.DataFrame:
        """Places of scores as numbers `at` along it [m]."""
        return table if self.axis is None else table.assign(at=table["xyz"[self.axis]])

    def of(self, table: pd.DataFrame) -> pd.DataFrame:
        """Places `x`, and `to_x` of other ends, as numbers along it [m]; other coordinates none."""
        if self.axis is None:
            return table
        along = {f"{end}x": table[f"{end}{'xyz'[self.axis]}"] for end in ("", "to_")}
        return table.assign(**along, **dict.fromkeys(("y", "z", "to_y", "to_z"), np.nan))


def line_through(points: PointsInSpace) -> Line | None:
    """Line along an axis on which all points lie; None where they do not."""
    size = np.nanmax(points, axis=0) - np.nanmin(points, axis=0)
    axis = int(size.argmax())
    return Line(axis) if 0 < np.sum(size > FLAT * size[axis]) < 2 else None
