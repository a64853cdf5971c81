"""Placement integrated by Gauss quadrature."""

import equinox as eqx

from ..._shared.arguments import check_count
from ..._shared.dimensions import Key
from ..._shared.sites import Unknown
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..engines.engine import Settings
from .marginal import DrawPlacement, IntegratedModel, Marginal, Model, integrated
from .nested_quadrature import NestedQuadrature, check, nested_nodes


class Quadrature(Marginal):
    """Integrate the placement by Gauss quadrature: exact once resolved, for few transducers.

    Given the places of the actuators, sensors are independent of each other, so the cost grows
    with nodes^(actuators + 1) (or sensors, whichever are fewer). Positions at nodes of a mesh are
    summed.

    Parameters
    ----------
    nodes
        Gauss nodes for each continuous coordinate.

    Examples
    --------
    >>> bp.marginals.Quadrature(nodes=48).settings()
    {'marginal': 'Quadrature', 'marginal_nodes': 48}
    """

    samples_placement = False
    nodes: int = eqx.field(static=True, default=64)

    def __check_init__(self) -> None:
        """Refuse a rule without nodes."""
        check_count("nodes", self.nodes, 1, "marginals.Quadrature(nodes=64)")

    def integrates(self, unknown: Unknown) -> bool:
        """All placement is."""
        return unknown.is_of_transducer

    def _likelihood(self, experiment: Experiment, data: Data) -> NestedQuadrature:
        check(experiment, "marginals.Quadrature")
        nodes = nested_nodes(experiment, integrated(self, experiment), self.nodes)
        return NestedQuadrature(data, nodes)

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which only parameters and output error are sampled."""
        return IntegratedModel(self, experiment, self._likelihood(experiment, data))

    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement:
        """Draw nodes in proportion to their share of the likelihood."""
        return self._likelihood(experiment, data).draw_placement

    def settings(self) -> Settings:
        """Name and number of nodes."""
        return {"marginal": "Quadrature", "marginal_nodes": self.nodes}
