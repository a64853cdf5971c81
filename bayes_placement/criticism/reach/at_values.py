"""What any law could remove beside a model whose unknowns have given values: nothing is fitted."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..._shared.dimensions import Spectrum
from ..._shared.errors import InputError
from ...experiment.experiment import Experiment, Measurements
from ...experiment.variants import with_lines
from ...inference.residuals import Problem, point_in_problem
from ..fitted import point_of
from ._at_port import MOST_LINES, ends_in_metres, where
from ._free_law import Points, squares_by_line, tells_phase
from ._ports import Port, can_be_reached, grid, place_columns, ports_of
from ._slopes import measured_by_line


class LeftByLine(NamedTuple):
    """Sums of squares at each line: of the model, and with any law at each place.

    So many numbers were `measured` at the line.
    """

    given: Float[np.ndarray, "line"]
    left: Float[np.ndarray, "place line"]
    measured: Int[np.ndarray, "line"]


class ReachAtValues:
    """Any law on the ports of one kind, at places all over the structure, all else being given.

    Of a model error nothing is taken, since it would take up what laws do. Data are complex FRFs of
    one state. An `InputError` says that the structure has no such port, or that no law can be read
    beside the model.
    """

    def __init__(self, experiment: Experiment, measurement: Measurements, acts_on: str):
        at_lines = with_lines(experiment.with_errors(None), MOST_LINES)
        self.problem = Problem(at_lines, at_lines.data(measurement))
        ports = [port for port in ports_of(at_lines) if port.acts_on == acts_on]
        if not (ports and tells_phase(self.problem) and can_be_reached(self.problem)):
            raise InputError(
                f"acts_on={acts_on!r} was given; a kind of port of the structure, complex FRFs at "
                "one force level and a model that is linear are needed, since a law is read line "
                'by line: acts_on="displacement".'
            )
        self._ports = [_PlacesOfPort(port, self.problem) for port in ports]

    @property
    def frequency(self) -> Spectrum:
        """Lines that are looked at [Hz]: they are no more than are needed to compare places."""
        return np.asarray(self.problem.experiment.frequency, dtype=float)

    @property
    def places(self) -> list[list[list[float]]]:
        """Places, each with one or two ends of coordinates [m]."""
        return [place for port in self._ports for place in port.places]

    def __call__(self, values: Mapping[str, float]) -> LeftByLine:
        """Return what is left at these lines and places, with values of the unknowns."""
        point = point_of(self.problem, values)
        read = [port.free.at(port.points_at(point)) for port in self._ports]
        left = np.concatenate([squares_by_line(at.left(at.best())) for at in read])
        given, measured = squares_by_line(read[0].free[:1])[0], measured_by_line(self.problem)
        return LeftByLine(given, left, measured)


class _PlacesOfPort:
    """A port at places all over its piece of the structure."""

    def __init__(self, port: Port, base: Problem):
        self._base, problem = base, base.with_effect(port.effect)
        self._columns = place_columns(port, problem)
        self._grid = grid(port, len(self._columns))
        self.free = port.free(problem, self._columns)
        table = where(port, problem, self.points_at(np.zeros(base.dimension)))
        self.places = [ends_in_metres(row) for _, row in table.iterrows()]

    def points_at(self, point: Float[np.ndarray, "coordinate"]) -> Points:
        """A point of the problem without the port, at each place."""
        start = point_in_problem(self._base, point, self.free.problem)
        points = np.repeat(start[None], len(self._grid), axis=0)
        points[:, self._columns] = self._grid
        return points
