"""_tensor_quadrature: in, one h; out, the likelihood integrated over all positions.

Given all positions of one side (actuators, say), the outputs of each transducer of the other side
are independent. So the integral is an outer tensor over one side, and inside it a product of
one-dimensional integrals. Not known here: the prior on h, engines.
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ._sites import substitute, unknowns
from ._types import InfeasibleError, Key
from .experiment import Experiment, is_placement
from .noise import Data
from .supports import quadrature

LIMIT = 4_000_000
"""Most responses computed for one h."""


class Nodes(NamedTuple):
    """Nodes and log weights of the unknown coordinates of one or several transducers."""

    values: dict[str, Float[Array, "node"]]
    log_weight: Float[Array, "node"]


class Nested(NamedTuple):
    """Nodes of the outer side, and of each transducer of the inner side with its channels."""

    outer: Nodes
    inner: tuple[tuple[str, Nodes, slice], ...]
    inner_is_sensor: bool


def nested(experiment: Experiment, points: int) -> Nested:
    """Lay out the nodes of all positions of an experiment.

    Raises
    ------
    InfeasibleError
        If the outer tensor would be too large.
    """
    inner_is_sensor = len(experiment.actuator) <= len(experiment.sensor)
    sides = ("actuator", experiment.sensor) if inner_is_sensor else ("sensor", experiment.actuator)
    kind = "sensor" if inner_is_sensor else "actuator"
    laws = {one.name: one.law for one in unknowns(experiment) if is_placement(one.name)}
    inner_counts = [sum(n.startswith(f"{kind}.{t}.") for n in laws) for t in sides[1]]
    outer_count = sum(name.startswith(f"{sides[0]}.") for name in laws)
    _check_size(points, outer_count, inner_counts)
    outer = _tensor(laws, f"{sides[0]}.", points)
    inner = tuple(
        (name, _tensor(laws, f"{kind}.{name}.", points), channels)
        for name, channels in _channels(sides[1]).items()
    )
    return Nested(outer, inner, inner_is_sensor)


def _check_size(points: int, outer: int, inner: list[int]) -> None:
    size = points**outer * max(points**count for count in inner)
    if size > LIMIT:
        raise InfeasibleError(
            f"marginals.Quadrature({points}) would compute {size:.0e} responses for each h, since "
            f"{outer} coordinates are integrated together with those of one more transducer. At "
            f"most {LIMIT:.0e} are affordable: use marginals.Latent() with engines.SMC()."
        )


def _channels(transducers: Any) -> dict[str, slice]:
    ends = [0]
    for one in transducers.values():
        ends.append(ends[-1] + len(one.channels))
    return {name: slice(ends[i], ends[i + 1]) for i, name in enumerate(transducers)}


def _tensor(laws: dict[str, Any], prefix: str, points: int) -> Nodes:
    chosen = {name: law for name, law in laws.items() if name.startswith(prefix)}
    rules = [quadrature(law, points) for law in chosen.values()]
    if not rules:
        return Nodes({}, jnp.zeros(1))
    grids = jnp.meshgrid(*(node for node, _ in rules), indexing="ij")
    weights = jnp.meshgrid(*(jnp.log(weight) for _, weight in rules), indexing="ij")
    values = {name: grid.ravel() for name, grid in zip(chosen, grids, strict=True)}
    return Nodes(values, sum(weights, jnp.zeros(())).ravel())


def log_likelihood(experiment: Experiment, data: Data, nodes: Nested) -> Float[Array, ""]:
    """Log of the likelihood integrated over every position."""
    return logsumexp(_outer_terms(nodes, _inner_terms(experiment, data, nodes)))


def resolve(
    experiment: Experiment, data: Data, nodes: Nested, key: Key
) -> tuple[dict[str, Any], dict[str, Any]]:
    """One placement drawn by its share of the integral, and how well the nodes resolve it."""
    inner = _inner_terms(experiment, data, nodes)
    outer = _outer_terms(nodes, inner)
    keys = jax.random.split(key, len(inner) + 1)
    place = jax.random.categorical(keys[0], outer)
    drawn = {name: values[place] for name, values in nodes.outer.values.items()}
    for (_, one, _), terms, k in zip(nodes.inner, inner, keys[1:], strict=True):
        node = jax.random.categorical(k, terms[place])
        drawn |= {name: values[node] for name, values in one.values.items()}
    return drawn, {"node_ess": _node_ess(nodes, outer, inner)}


def _outer_terms(nodes: Nested, inner: list[Any]) -> Float[Array, "node"]:
    return nodes.outer.log_weight + sum(logsumexp(terms, axis=1) for terms in inner)


def _inner_terms(experiment: Experiment, data: Data, nodes: Nested) -> list[Any]:
    """Log weighted likelihood of each inner transducer, [outer node, inner node]."""
    return [_inner_term(experiment, data, nodes, *one) for one in nodes.inner]


def _inner_term(
    experiment: Experiment, data: Data, nodes: Nested, name: str, inner: Nodes, channels: slice
) -> Float[Array, "outer inner"]:
    side = "sensor" if nodes.inner_is_sensor else "actuator"
    part = data.of(**{f"{side}s": channels})
    alone = experiment.with_only(side, name, channels)

    def term(outer_values: Any, inner_values: Any) -> Any:
        one = substitute(alone, {**outer_values, **inner_values})
        assert one.noise is not None  # as the marginal has checked
        return jnp.sum(one.noise.law(one.predict(), part).log_prob(part.z))

    # One map inside the other, so that the shapes of each side are computed once for each node.
    sizes = math.prod(inner.log_weight.shape), math.prod(nodes.outer.log_weight.shape)
    over_inner = jax.vmap(term, in_axes=(None, 0), axis_size=sizes[0])
    over_both = jax.vmap(over_inner, in_axes=(0, None), axis_size=sizes[1])
    return over_both(nodes.outer.values, inner.values) + inner.log_weight


def _node_ess(nodes: Nested, outer: Any, inner: list[Any]) -> Float[Array, ""]:
    """Effective number of nodes along the coordinate where it is least.

    Coordinates may hold each other tightly, so the inner ones are judged at given outer ones.
    """
    share = jax.nn.softmax(outer)
    counts = [_along_one(_ess(outer), len(nodes.outer.values))]
    for terms, (_, one, _) in zip(inner, nodes.inner, strict=True):
        at_outer = jnp.exp(jnp.sum(share * jnp.log(jax.vmap(_ess)(terms))))
        counts.append(_along_one(at_outer, len(one.values)))
    return jnp.min(jnp.stack(counts))


def _ess(log_share: Float[Array, "node"]) -> Float[Array, ""]:
    return jnp.exp(2 * logsumexp(log_share) - logsumexp(2 * log_share))


def _along_one(ess: Any, coordinates: int) -> Any:
    """Effective nodes along each of several coordinates; no coordinate is always resolved."""
    return ess ** (1 / coordinates) if coordinates else jnp.inf
