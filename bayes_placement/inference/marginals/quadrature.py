"""Placement integrated by nested quadrature, or summed over the nodes of a mesh.

Given all positions of one side (actuators, say), the outputs of each transducer of the other side
are independent. So the integral is an outer tensor over one side (and over whatever belongs to no
transducer), and inside it a product of integrals over one transducer each. A distribution over
finitely many values is summed.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float, Shaped
from numpyro.distributions import Distribution

from ..._shared.arguments import check_count
from ..._shared.dimensions import Key
from ..._shared.errors import InfeasibleError, InputError
from ..._shared.sites import Unknown, is_finite, substitute
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ...experiment.transducers import Transducer
from ...experiment.variants import with_only
from .._quadrature_rules import node_count, product_rule
from ..estimates import effective_size
from ..symmetries import Values
from .marginal import (
    Drawn,
    IntegratedLikelihood,
    IntegratingMarginal,
    integrated,
)

InnerTerm = Float[Array, "outer inner"]

MOST_RESPONSES = 4_000_000
"""Most responses computed for one set of parameters."""


class SideNodes(NamedTuple):
    """Nodes of several unknowns; those over finitely many values run slowest."""

    values: dict[str, Shaped[Array, "node"]]
    """Values at the nodes, by name."""
    log_weight: Float[Array, "node"]
    """Logs of the weights of the nodes."""
    finite: int
    """Number of combinations of the unknowns over finitely many values."""
    continuous: int
    """Number of continuous unknowns."""


class Channels(NamedTuple):
    """Channels of one transducer among those of its side."""

    first: int
    end: int

    @property
    def slice(self) -> slice:
        """The same as a slice."""
        return slice(self.first, self.end)


class InnerTransducer(NamedTuple):
    """One transducer of the inner side: its name, channels and nodes."""

    name: str
    channels: Channels
    nodes: SideNodes


class NestedNodes(NamedTuple):
    """Nodes of the outer side, and of each transducer of the inner side."""

    outer: SideNodes
    inner: tuple[InnerTransducer, ...]
    inner_side: str


def check(experiment: Experiment, method: str) -> None:
    """Refuse an experiment whose likelihood is no product over transducers."""
    if experiment.noise is None:
        raise InfeasibleError(
            f"{method} integrates a density of the measured outputs, which noise=None lacks. Give "
            "noise.Gaussian(sigma), or use marginals.KDE(), whose kernel is a density."
        )
    effect = next(iter(experiment.instrument_effects), None)
    if effect is not None:
        raise InfeasibleError(
            f"{method} was given an experiment with the effect "
            f'"{effect}" on its instruments, but it needs sensors that are '
            "independent of each other once the actuators are placed, and such an effect may "
            "couple them. Use marginals.Latent()."
        )


def nested_nodes(
    experiment: Experiment, distributions: Mapping[str, Distribution], nodes: int
) -> NestedNodes:
    """Lay out the nodes of some unknowns of an experiment.

    Its other unknowns will be numbers. `nodes` are Gauss nodes of each continuous one.
    """
    inner_is_sensor = len(experiment.actuator) <= len(experiment.sensor)
    kind, side = (
        ("sensor", experiment.sensor) if inner_is_sensor else ("actuator", experiment.actuator)
    )
    inner: dict[str, dict[str, Distribution]] = {name: {} for name in side}
    outer: dict[str, Distribution] = {}
    for name, distribution in distributions.items():
        owner = experiment.unknown[name].owner
        nodes_of = inner[owner.name] if owner.kind == kind else outer
        nodes_of[name] = distribution
    _check_size(nodes, outer, list(inner.values()))
    channels = _channels(side)
    return NestedNodes(
        _side_nodes(outer, nodes),
        tuple(
            InnerTransducer(name, channels[name], _side_nodes(inner[name], nodes)) for name in side
        ),
        kind,
    )


def _check_size(
    nodes: int, outer: dict[str, Distribution], inner: list[dict[str, Distribution]]
) -> None:
    sizes = [_size(distributions, nodes) for distributions in (outer, *inner)]
    responses = sizes[0] * max(sizes[1:])
    if responses > MOST_RESPONSES:
        raise InfeasibleError(
            f"The marginal would compute {responses:.0e} responses for each h, since {len(outer)} "
            f"coordinates are integrated together with those of one more transducer. At most "
            f"{MOST_RESPONSES:.0e} are affordable: use marginals.Latent() with engines.SMC(), or "
            "fewer nodes."
        )


def _size(distributions: Mapping[str, Distribution], nodes: int) -> int:
    return math.prod(node_count(distribution, nodes) for distribution in distributions.values())


def _channels(transducers: Mapping[str, Transducer]) -> dict[str, Channels]:
    """Channels of each transducer, by its name."""
    channels, start = {}, 0
    for name, transducer in transducers.items():
        end = start + len(transducer.channels)
        channels[name] = Channels(start, end)
        start = end
    return channels


def _side_nodes(distributions: dict[str, Distribution], nodes: int) -> SideNodes:
    finite = {
        name: distribution
        for name, distribution in distributions.items()
        if is_finite(distribution)
    }
    rule = product_rule(finite | distributions, nodes)
    continuous = len(distributions) - len(finite)
    return SideNodes(rule.values, rule.log_weight, _size(finite, nodes), continuous)


class NestedQuadrature(IntegratedLikelihood):
    """Likelihood integrated over the nodes of some unknowns."""

    data: tuple[Data, ...]
    """Measured outputs."""
    nodes: NestedNodes
    """Nodes of the integrated unknowns."""

    def __init__(self, data: Data, nodes: NestedNodes):
        self.data = tuple(
            data.of(**{f"{nodes.inner_side}s": transducer.channels.slice})
            for transducer in nodes.inner
        )
        self.nodes = nodes

    def log_likelihood(self, experiment: Experiment) -> Float[Array, ""]:
        """Log of the likelihood integrated over every position."""
        return logsumexp(_outer_terms(self.nodes, self._inner_terms(experiment)))

    def draw_placement(self, experiment: Experiment, key: Key) -> Drawn:
        """One placement drawn by its share of the integral, and how well the nodes resolve it."""
        nodes, inner = self.nodes, self._inner_terms(experiment)
        outer = _outer_terms(nodes, inner)
        keys = jax.random.split(key, len(inner) + 1)
        outer_node = jax.random.categorical(keys[0], outer)
        drawn: Values = {name: values[outer_node] for name, values in nodes.outer.values.items()}
        for transducer, terms, inner_key in zip(nodes.inner, inner, keys[1:], strict=True):
            inner_node = jax.random.categorical(inner_key, terms[outer_node])
            drawn |= {name: values[inner_node] for name, values in transducer.nodes.values.items()}
        return drawn, _node_ess(nodes, outer, inner)

    def _inner_terms(self, experiment: Experiment) -> list[InnerTerm]:
        """Log weighted likelihood of each inner transducer, [outer node, inner node]."""
        pairs = zip(self.nodes.inner, self.data, strict=True)
        return [self._inner_term(experiment, *pair) for pair in pairs]

    def _inner_term(
        self, experiment: Experiment, transducer: InnerTransducer, data: Data
    ) -> InnerTerm:
        inner, outer = transducer.nodes, self.nodes.outer
        alone = with_only(experiment, **{f"{self.nodes.inner_side}s": [transducer.name]})

        def term(
            outer_values: Mapping[str, Array], inner_values: Mapping[str, Array]
        ) -> Float[Array, ""]:
            placed = substitute(alone, {**outer_values, **inner_values})
            assert placed.noise is not None  # as `check` made sure
            return jnp.sum(placed.noise.distribution(placed.predict(), data).log_prob(data.z))

        # A map inside another, so that the shapes of each side are computed once for each node.
        sizes = math.prod(inner.log_weight.shape), math.prod(outer.log_weight.shape)
        over_inner = jax.vmap(term, in_axes=(None, 0), axis_size=sizes[0])
        over_both = jax.vmap(over_inner, in_axes=(0, None), axis_size=sizes[1])
        return over_both(outer.values, inner.values) + inner.log_weight


def _outer_terms(nodes: NestedNodes, inner: list[InnerTerm]) -> Float[Array, "node"]:
    """Log weighted likelihood at each outer node, the inner side integrated."""
    return nodes.outer.log_weight + sum(logsumexp(terms, axis=1) for terms in inner)


def _node_ess(nodes: NestedNodes, outer: Float[Array, "outer"], inner: list[InnerTerm]) -> Values:
    """Effective number of Gauss nodes along the coordinate where it is least, `node_ess`.

    Coordinates may be strongly correlated, so the inner ones are judged at given outer ones. Where
    all are summed there is none.
    """
    share = jax.nn.softmax(outer)
    counts = []
    if nodes.outer.continuous:
        counts.append(_ess_along_coordinate(outer, nodes.outer))
    for terms, (_, _, side) in zip(inner, nodes.inner, strict=True):
        if side.continuous:
            sizes = jax.vmap(lambda row, side=side: _ess_along_coordinate(row, side))(terms)
            counts.append(jnp.exp(jnp.sum(share * jnp.log(sizes))))
    return {"node_ess": jnp.min(jnp.stack(counts))} if counts else {}


def _ess_along_coordinate(log_share: Float[Array, "node"], nodes: SideNodes) -> Float[Array, ""]:
    """Effective number of nodes along a continuous coordinate: their geometric mean.

    Sums over finitely many values are exact, so it is judged at each combination of these.
    """
    rows = log_share.reshape(nodes.finite, -1)
    share = jax.nn.softmax(logsumexp(rows, axis=1))
    ess = jnp.exp(jnp.sum(share * jnp.log(jax.vmap(effective_size)(rows))))
    return ess ** (1 / nodes.continuous)


class Quadrature(IntegratingMarginal):
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

    def likelihood(self, experiment: Experiment, data: Data, key: Key) -> NestedQuadrature:
        """Likelihood by nested quadrature."""
        check(experiment, "marginals.Quadrature")
        nodes = nested_nodes(experiment, integrated(self, experiment), self.nodes)
        return NestedQuadrature(data, nodes)


class Enumeration(IntegratingMarginal):
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

    def likelihood(self, experiment: Experiment, data: Data, key: Key) -> NestedQuadrature:
        """Likelihood by nested quadrature."""
        distributions = integrated(self, experiment)
        if not distributions:
            raise InputError(
                "marginals.Enumeration sums over positions at nodes, but none is unknown. Declare "
                "one, at=positions.Nodes(positions, positions.Box(...)), or use "
                "marginals.Latent()."
            )
        check(experiment, "marginals.Enumeration")
        return NestedQuadrature(data, nested_nodes(experiment, distributions, 1))
