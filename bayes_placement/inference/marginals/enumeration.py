"""Positions at nodes of a mesh summed, all else sampled."""

from typing import Any

from ..._sites import Unknown, is_finite
from ..._types import InputError, Key
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from . import nested_quadrature
from .marginal import DrawPlacement, Marginal, Model, integrated, integrated_model


class Enumeration(Marginal):
    """Sum over all positions at nodes of a mesh: exact, with everything else left latent.

    Places of effects at nodes are summed as well. Given the nodes of the actuators, sensors are
    independent of each other, so the cost grows with the number of combinations of the actuators'
    nodes (or the sensors', whichever are fewer) times the nodes of one further instrument.
    """

    samples_placement = True

    def integrates(self, unknown: Unknown) -> bool:
        """Whatever has finitely many values."""
        return is_finite(unknown.distribution)

    def _nodes(self, experiment: Experiment) -> nested_quadrature.NestedNodes:
        distributions = integrated(self, experiment)
        if not distributions:
            raise InputError(
                "marginals.Enumeration sums over positions at nodes, but none is unknown. Declare "
                "one, at=positions.Nodes(positions, positions.Box(...)), or use "
                "marginals.Latent()."
            )
        nested_quadrature.check(experiment, "Enumeration")
        return nested_quadrature.nested_nodes(experiment, distributions, 1)

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which all but the nodes is sampled."""
        nodes = self._nodes(experiment)
        return integrated_model(
            self,
            experiment,
            lambda realised: nested_quadrature.log_likelihood(realised, data, nodes),
        )

    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement:
        """Draw nodes in proportion to their share of the likelihood."""
        nodes = self._nodes(experiment)
        return lambda realised, draw_key: (
            nested_quadrature.draw_placement(realised, data, nodes, draw_key)[0],
            {},
        )

    def settings(self) -> dict[str, Any]:
        """Only the name."""
        return {"marginal": "Enumeration"}
