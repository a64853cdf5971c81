"""Placement integrated by Gauss quadrature."""

from typing import Any

import equinox as eqx

from ..._sites import Unknown
from ..._types import Key
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from . import nested_quadrature
from .marginal import DrawPlacement, Marginal, Model, integrated, integrated_model


class Quadrature(Marginal):
    """Integrate the placement by Gauss quadrature: exact once resolved, for few transducers.

    Given the places of the actuators, sensors are independent of each other, so the cost grows
    with nodes^(actuators + 1) (or sensors, whichever are fewer). Positions at nodes of a mesh are
    summed.

    Parameters
    ----------
    nodes
        Gauss nodes for each continuous coordinate.
    """

    samples_placement = False
    nodes: int = eqx.field(static=True, default=64)

    def integrates(self, unknown: Unknown) -> bool:
        """All placement is."""
        return unknown.is_placement

    def _nodes(self, experiment: Experiment) -> nested_quadrature.NestedNodes:
        nested_quadrature.check(experiment, "Quadrature")
        distributions = integrated(self, experiment)
        return nested_quadrature.nested_nodes(experiment, distributions, self.nodes)

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which only parameters and output error are sampled."""
        nodes = self._nodes(experiment)
        return integrated_model(
            self,
            experiment,
            lambda realised: nested_quadrature.log_likelihood(realised, data, nodes),
        )

    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement:
        """Draw nodes in proportion to their share of the likelihood."""
        nodes = self._nodes(experiment)
        return lambda realised, draw_key: nested_quadrature.draw_placement(
            realised, data, nodes, draw_key
        )

    def settings(self) -> dict[str, Any]:
        """Name and number of nodes."""
        return {"marginal": "Quadrature", "marginal_nodes": self.nodes}
