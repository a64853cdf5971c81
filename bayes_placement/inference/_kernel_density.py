"""_kernel_density: in, one h and draws of the placement; out, the density of the measured outputs.

Not known here: the prior on h, engines.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float
from numpyro.distributions import Normal

from .._sites import substitute
from .._types import Key
from ..experiment.experiment import Experiment
from ..experiment.noise import Data


def _silverman(factor: Any, draws: int) -> tuple[Any, Any]:
    return factor, 1.0


def _soize(factor: Any, draws: int) -> tuple[Any, Any]:
    width = factor / (factor**2 + (draws - 1) / draws) ** 0.5
    return width, width / factor


SHRINKAGE = {"soize": _soize, "silverman": _silverman}
"""Kernel width and shrinkage of the centres, both relative, from Silverman's factor."""


class KernelDensity(eqx.Module):
    """Multivariate kernel density estimate of p(z | h) with a bandwidth for each component.

    One bandwidth each is needed: z given h lies near a surface of as many dimensions as there are
    unknown positions, so a full covariance is close to singular.
    """

    data: Data
    key: Any
    draws: int = eqx.field(static=True)
    kernel: str = eqx.field(static=True)
    noise_draws: int | None = eqx.field(static=True)
    common: bool = eqx.field(static=True)

    def log_likelihood(self, experiment: Experiment) -> Float[Array, ""]:
        """Log of the estimate at the measured outputs."""
        kernels = self._kernels(experiment, self._placements(experiment))
        return logsumexp(self._log_density(experiment, *kernels)) - jnp.log(self.draws)

    def resolve(self, experiment: Experiment, key: Key) -> tuple[dict[str, Any], dict[str, Any]]:
        """One placement drawn by its share of the estimate, and how well it is resolved."""
        placements = self._placements(experiment)
        centres, variance = self._kernels(experiment, placements)
        terms = self._log_density(experiment, centres, variance)
        chosen = jax.random.categorical(key, terms)
        ess = jnp.exp(2 * logsumexp(terms) - logsumexp(2 * terms))
        stats = {"node_ess": ess ** (1 / len(placements))}
        if experiment.noise is not None:
            noise = experiment.noise.distribution(self.data.z, self.data).variance
            stats["kernel_over_noise"] = jnp.sqrt(jnp.mean(variance / noise))
        return {name: values[chosen] for name, values in placements.items()}, stats

    def _placements(self, experiment: Experiment) -> dict[str, Any]:
        """Draws of the placement, by name."""
        key = self.key if self.common else _fingerprint_key(self.key, experiment)
        laws = {one.name: one.distribution for one in experiment.unknowns if one.is_placement}
        keys = jax.random.split(key, len(laws))
        return {
            name: law.sample(k, (self.draws,))
            for (name, law), k in zip(laws.items(), keys, strict=True)
        }

    def _kernels(self, experiment: Experiment, placements: dict[str, Any]) -> tuple[Any, Any]:
        """Centres [node, output] and variance [output] of the kernels."""
        z = jax.vmap(lambda values: substitute(experiment, values).predict())(placements)
        components = int(self.data.measured.sum())
        factor = (4 / (self.draws * (components + 2))) ** (1 / (components + 4))
        width, shrinkage = SHRINKAGE[self.kernel](factor, self.draws)
        mean, deviation = jnp.mean(z, axis=0), jnp.std(z, axis=0, ddof=1)
        return mean + shrinkage * (z - mean), (width * deviation) ** 2

    def _log_density(self, experiment: Experiment, centres: Any, variance: Any) -> Any:
        if experiment.noise is not None and self.noise_draws is None:
            return self._total(
                lambda z: experiment.noise.distribution(z, self.data, variance), centres
            )
        shifted = self._shifted(experiment)

        def kernel(z: Any) -> Any:
            return Normal(z, jnp.sqrt(variance)).mask(self.data.measured)

        terms = jax.vmap(lambda measured: self._total(kernel, centres, measured))(shifted)
        return logsumexp(terms, axis=0) - jnp.log(shifted.shape[0])

    def _shifted(self, experiment: Experiment) -> Float[Array, "draw ..."]:
        """Measured outputs less each draw of the noise, z - n of Eq. (29)."""
        if experiment.noise is None:
            return self.data.z[None]
        law = experiment.noise.distribution(jnp.zeros_like(self.data.z), self.data)
        return self.data.z - law.sample(jax.random.fold_in(self.key, 1), (self.noise_draws or 1,))

    def _total(self, law: Any, centres: Any, measured: Any = None) -> Float[Array, "node"]:
        z = self.data.z if measured is None else measured
        return jax.vmap(lambda centre: jnp.sum(law(centre).log_prob(z)))(centres)


def _fingerprint_key(key: Key, experiment: Experiment) -> Key:
    """Fold the bits of h into a key: draws differ from one h to the next, yet repeat for one h."""
    leaves = jax.tree.leaves((experiment.structure, experiment.noise))
    total = sum(jnp.sum(jnp.asarray(leaf, dtype=float)) * (i + 1) for i, leaf in enumerate(leaves))
    low, high = jax.lax.bitcast_convert_type(jnp.asarray(total), jnp.uint32)
    return jax.random.fold_in(jax.random.fold_in(key, low), high)
