"""_tensor_quadrature: in, one h; out, the likelihood integrated over positions.

Given all positions of one side (actuators, say), the outputs of each transducer of the other side
are independent. So the integral is an outer tensor over one side (and over whatever belongs to no
transducer), and inside it a product of integrals over one transducer each. A law over finitely
many values is summed. Not known here: the prior on h, engines.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float, Shaped
from numpyro.distributions import Distribution

from .._sites import is_finite, substitute
from .._types import InfeasibleError, Key
from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ._quadrature import size, tensor

LIMIT = 4_000_000
"""Most responses computed for one h."""


class Nodes(NamedTuple):
    """Nodes and log weights of several unknowns, those over finitely many values slowest."""

    values: dict[str, Shaped[Array, "node"]]
    log_weight: Float[Array, "node"]
    listed: int
    continuous: int


class Nested(NamedTuple):
    """Nodes of the outer side, and of each transducer of the inner side with its channels."""

    outer: Nodes
    inner: tuple[tuple[str, Nodes, slice], ...]
    inner_is_sensor: bool


def nested(experiment: Experiment, laws: Mapping[str, Distribution], points: int) -> Nested:
    """Lay out the nodes of some unknowns of an experiment.

    Parameters
    ----------
    experiment
        Experiment whose other unknowns will be numbers.
    laws
        Laws of what is integrated, by name.
    points
        Gauss nodes for each continuous law.

    Raises
    ------
    InfeasibleError
        If the outer tensor would be too large.
    """
    inner_is_sensor = len(experiment.actuator) <= len(experiment.sensor)
    kind, side = (
        ("sensor", experiment.sensor) if inner_is_sensor else ("actuator", experiment.actuator)
    )
    owned = {name: _below(laws, f"{kind}.{name}.") for name in side}
    outer = {name: law for name, law in laws.items() if not name.startswith(f"{kind}.")}
    _check_size(points, outer, list(owned.values()))
    inner = tuple(
        (name, _nodes(owned[name], points), channels) for name, channels in _channels(side).items()
    )
    return Nested(_nodes(outer, points), inner, inner_is_sensor)


def _below(laws: Mapping[str, Distribution], prefix: str) -> dict[str, Distribution]:
    return {name: law for name, law in laws.items() if name.startswith(prefix)}


def _check_size(points: int, outer: dict[str, Any], inner: list[dict[str, Any]]) -> None:
    sizes = [math.prod(size(law, points) for law in laws.values()) for laws in (outer, *inner)]
    whole = sizes[0] * max(sizes[1:])
    if whole > LIMIT:
        raise InfeasibleError(
            f"The marginal would compute {whole:.0e} responses for each h, since {len(outer)} "
            f"coordinates are integrated together with those of one more transducer. At most "
            f"{LIMIT:.0e} are affordable: use marginals.Latent() with engines.SMC(), or fewer "
            "nodes."
        )


def _channels(transducers: Any) -> dict[str, slice]:
    ends = [0]
    for one in transducers.values():
        ends.append(ends[-1] + len(one.channels))
    return {name: slice(ends[i], ends[i + 1]) for i, name in enumerate(transducers)}


def _nodes(laws: dict[str, Distribution], points: int) -> Nodes:
    listed = {name: law for name, law in laws.items() if is_finite(law)}
    values, log_weight = tensor(listed | laws, points)
    count = math.prod(size(law, points) for law in listed.values())
    return Nodes(values, log_weight, count, len(laws) - len(listed))


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
        return jnp.sum(one.noise.distribution(one.predict(), part).log_prob(part.z))

    # One map inside the other, so that the shapes of each side are computed once for each node.
    sizes = math.prod(inner.log_weight.shape), math.prod(nodes.outer.log_weight.shape)
    over_inner = jax.vmap(term, in_axes=(None, 0), axis_size=sizes[0])
    over_both = jax.vmap(over_inner, in_axes=(0, None), axis_size=sizes[1])
    return over_both(nodes.outer.values, inner.values) + inner.log_weight


def _node_ess(nodes: Nested, outer: Any, inner: list[Any]) -> Float[Array, ""]:
    """Effective number of Gauss nodes along the coordinate where it is least.

    Coordinates may hold each other tightly, so the inner ones are judged at given outer ones.
    """
    share = jax.nn.softmax(outer)
    counts = [jnp.asarray(jnp.inf)]
    if nodes.outer.continuous:
        counts.append(_along_one(outer, nodes.outer))
    for terms, (_, one, _) in zip(inner, nodes.inner, strict=True):
        if one.continuous:
            each = jax.vmap(lambda row, one=one: _along_one(row, one))(terms)
            counts.append(jnp.exp(jnp.sum(share * jnp.log(each))))
    return jnp.min(jnp.stack(counts))


def _along_one(log_share: Float[Array, "node"], nodes: Nodes) -> Float[Array, ""]:
    """Effective nodes along each of several continuous coordinates.

    What is summed is exact, so they are judged at given values of it.
    """
    rows = log_share.reshape(nodes.listed, -1)
    share = jax.nn.softmax(logsumexp(rows, axis=1))
    ess = jnp.exp(jnp.sum(share * jnp.log(jax.vmap(_ess)(rows))))
    return ess ** (1 / nodes.continuous)


def _ess(log_share: Float[Array, "node"]) -> Float[Array, ""]:
    return jnp.exp(2 * logsumexp(log_share) - logsumexp(2 * log_share))
