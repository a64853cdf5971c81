"""Positions at nodes of a mesh summed, all else sampled."""

from ..._shared.dimensions import Key
from ..._shared.errors import InputError
from ..._shared.sites import Unknown, is_finite
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..engines.engine import Settings
from .marginal import DrawPlacement, IntegratedModel, Marginal, Model, integrated
from .nested_quadrature import NestedQuadrature, check, nested_nodes


class Enumeration(Marginal):
    """Sum over all positions at nodes of a mesh: exact, with everything else left latent.

    Places of effects at nodes are summed as well. Given the nodes of the actuators, sensors are
    independent of each other, so the cost grows with the number of combinations of the actuators'
    nodes (or the sensors', whichever are fewer) times the nodes of one further instrument.

    Examples
    --------
    >>> bp.marginals.Enumeration().settings()
    {'marginal': 'Enumeration'}
    """

    samples_placement = True

    def integrates(self, unknown: Unknown) -> bool:
        """Whatever has finitely many values."""
        return is_finite(unknown.distribution)

    def _likelihood(self, experiment: Experiment, data: Data) -> NestedQuadrature:
        distributions = integrated(self, experiment)
        if not distributions:
            raise InputError(
                "marginals.Enumeration sums over positions at nodes, but none is unknown. Declare "
                "one, at=positions.Nodes(positions, positions.Box(...)), or use "
                "marginals.Latent()."
            )
        check(experiment, "marginals.Enumeration")
        return NestedQuadrature(data, nested_nodes(experiment, distributions, 1))

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which all but the nodes is sampled."""
        return IntegratedModel(self, experiment, self._likelihood(experiment, data))

    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement:
        """Draw nodes in proportion to their share of the likelihood."""
        return self._likelihood(experiment, data).draw_placement

    def settings(self) -> Settings:
        """Only the name."""
        return {"marginal": "Enumeration"}
