"""Placement integrated by a kernel density estimate, as in the paper: equations (29) and (31)."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float
from numpyro.distributions import Distribution, Normal

from ..._shared.arguments import check_count, check_fields
from ..._shared.dimensions import Key
from ..._shared.errors import InputError
from ..._shared.sites import Unknown, substitute
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..estimates import effective_size
from ..record import jax_key
from ..symmetries import Values
from .marginal import (
    Drawn,
    IntegratedLikelihood,
    IntegratingMarginal,
    integrated,
)

Outputs = Float[Array, "*output"]
Centres = Float[Array, "draw *output"]
PerDraw = Float[Array, "draw"]
Around = Callable[[Outputs], Distribution]


class Kernel(NamedTuple):
    """Gaussian kernels for draws of standard deviation one, mean zero."""

    width: float
    """Standard deviation of each kernel."""
    shrinkage: float
    """Distance of its centre from the mean over that of its draw."""


def silverman_width(draws: int, dimension: int) -> float:
    """Width of Gaussian kernels for so many draws in so many dimensions (Silverman 1986, 4.14)."""
    return (4 / (draws * (dimension + 2))) ** (1 / (dimension + 4))


def _silverman(width: float, draws: int) -> Kernel:
    return Kernel(width, 1.0)


def _soize(width: float, draws: int) -> Kernel:
    shrunk = width / (width**2 + (draws - 1) / draws) ** 0.5
    return Kernel(shrunk, shrunk / width)


KERNELS = {"soize": _soize, "silverman": _silverman}
"""Kernels by name, from Silverman's width and the number of draws."""


def kernel(name: str, draws: int, dimension: int) -> Kernel:
    """Kernel of a name for so many draws of so many outputs, Eq. (31)."""
    return KERNELS[name](silverman_width(draws, dimension), draws)


class KernelDensity(IntegratedLikelihood):
    """Multivariate kernel density estimate of p(z | h) with a bandwidth for each component.

    A bandwidth for each is needed: z given h lies near a surface of as many dimensions as there are
    unknown positions, so a full covariance is close to singular.
    """

    data: Data
    """Measured outputs."""
    key: Key
    """JAX key of the draws."""
    draws: int = eqx.field(static=True)
    kernel: str = eqx.field(static=True)
    noise_draws: int | None = eqx.field(static=True)
    common: bool = eqx.field(static=True)
    """See `marginals.KDE`; `draws` are its `placement_draws`."""
    dimension: int = eqx.field(static=True)

    def __init__(
        self,
        data: Data,
        key: Key,
        draws: int,
        kernel: str = "soize",
        noise_draws: int | None = None,
        common: bool = True,
    ):
        self.data, self.key, self.draws = data, key, draws
        self.kernel, self.noise_draws, self.common = kernel, noise_draws, common
        self.dimension = int(np.sum(data.measured))  # a bandwidth depends on it

    def log_likelihood(self, experiment: Experiment) -> Float[Array, ""]:
        """Log of the estimate at the measured outputs."""
        kernels = self._kernels(experiment, self._placements(experiment))
        return logsumexp(self._log_density(experiment, *kernels)) - jnp.log(self.draws)

    def draw_placement(self, experiment: Experiment, key: Key) -> Drawn:
        """One placement drawn by its share of the estimate, and how well it is resolved."""
        placements = self._placements(experiment)
        centres, variance = self._kernels(experiment, placements)
        terms = self._log_density(experiment, centres, variance)
        chosen = jax.random.categorical(key, terms)
        stats: Values = {"node_ess": effective_size(terms) ** (1 / len(placements))}
        if experiment.noise is not None:
            noise = experiment.noise.distribution(self.data.z, self.data).variance
            stats["kernel_over_noise"] = jnp.sqrt(jnp.mean(variance / noise))
        return {name: values[chosen] for name, values in placements.items()}, stats

    def _placements(self, experiment: Experiment) -> Values:
        """Draws [draw, ...] of the placement, by name."""
        key = self.key if self.common else _key_of_parameters(self.key, experiment)
        placement = [unknown for unknown in experiment.unknowns if unknown.is_of_transducer]
        keys = jax.random.split(key, len(placement))
        return {
            unknown.name: unknown.distribution.sample(draw_key, (self.draws,))
            for unknown, draw_key in zip(placement, keys, strict=True)
        }

    def _kernels(self, experiment: Experiment, placements: Values) -> tuple[Centres, Outputs]:
        """Centres [draw, *output] and variance [*output] of the kernels."""
        z = jax.vmap(lambda values: substitute(experiment, values).predict())(placements)
        width, shrinkage = kernel(self.kernel, self.draws, self.dimension)
        mean, deviation = jnp.mean(z, axis=0), jnp.std(z, axis=0, ddof=1)
        return mean + shrinkage * (z - mean), (width * deviation) ** 2

    def _log_density(self, experiment: Experiment, centres: Centres, variance: Outputs) -> PerDraw:
        """Log density [draw] of each kernel at the measured outputs, output error included."""
        noise = experiment.noise
        if noise is not None and self.noise_draws is None:
            return self._total(lambda z: noise.distribution(z, self.data, variance), centres)
        shifted = self._less_noise(experiment)

        def density(z: Outputs) -> Distribution:
            return Normal(z, jnp.sqrt(variance)).mask(self.data.measured)

        terms = jax.vmap(lambda measured: self._total(density, centres, measured))(shifted)
        return logsumexp(terms, axis=0) - jnp.log(shifted.shape[0])

    def _less_noise(self, experiment: Experiment) -> Float[Array, "draw ..."]:
        """Measured outputs less each draw of the noise, z - n of Eq. (29)."""
        if experiment.noise is None:
            return self.data.z[None]
        noise = experiment.noise.distribution(jnp.zeros_like(self.data.z), self.data)
        return self.data.z - noise.sample(jax.random.fold_in(self.key, 1), (self.noise_draws or 1,))

    def _total(self, density: Around, centres: Centres, measured: Outputs | None = None) -> PerDraw:
        z = self.data.z if measured is None else measured
        return jax.vmap(lambda centre: jnp.sum(density(centre).log_prob(z)))(centres)


def _key_of_parameters(key: Key, experiment: Experiment) -> Key:
    """Fold the bits of h into a key: draws differ from one h to the next, yet repeat for one h."""
    leaves = jax.tree.leaves((experiment.structure, experiment.noise))
    total = sum(jnp.sum(jnp.asarray(leaf, dtype=float)) * (i + 1) for i, leaf in enumerate(leaves))
    low, high = jax.lax.bitcast_convert_type(jnp.asarray(total), jnp.uint32)
    return jax.random.fold_in(jax.random.fold_in(key, low), high)


class KDE(IntegratingMarginal):
    """Placement integrated by a kernel density estimate of z given h, Eqs. (29) and (31).

    A way to treat placement when data are inferred from; the estimator of expected information that
    uses the same kernels is `information.KernelGain`.

    Parameters
    ----------
    placement_draws
        Draws of the placement, n_sim,p of the paper.
    kernel
        `soize` (kernel centres shrunk so that the estimate keeps the variance of the draws) or
        `silverman`; one bandwidth for each component of z.
    noise_draws
        None: Gaussian kernel plus Gaussian noise in closed form. A number: Eq. (29) literally,
        by that many draws of the noise.
    common
        True: the same placement draws for every h, so that the likelihood is smooth in h. False:
        independent draws for every h, as in the paper's Table 1.

    Raises
    ------
    InputError
        If there is no such kernel, or there are fewer than two draws.

    Examples
    --------
    >>> bp.marginals.KDE(placement_draws=400, kernel="silverman").settings()["marginal_kernel"]
    'silverman'
    """

    samples_placement = False
    placement_draws: int = eqx.field(static=True, default=800)
    kernel: str = eqx.field(static=True, default="soize")
    noise_draws: int | None = eqx.field(static=True, default=None)
    common: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        check_fields(self)
        check_count("noise_draws", self.noise_draws or 1, 1, "marginals.KDE(noise_draws=10)")
        check_count(
            "placement_draws", self.placement_draws, 1, "marginals.KDE(placement_draws=800)"
        )
        if self.kernel not in KERNELS:
            raise InputError(
                f"marginals.KDE has no kernel {self.kernel!r}. The kernels are "
                f"{' and '.join(KERNELS)}: KDE(kernel='soize')."
            )
        if self.placement_draws < 2:
            raise InputError(
                f"marginals.KDE(placement_draws={self.placement_draws}) was given; a spread needs "
                "at least two draws, and an estimate hundreds: KDE(placement_draws=800)."
            )

    def integrates(self, unknown: Unknown) -> bool:
        """All placement is."""
        return unknown.is_of_transducer

    def likelihood(self, experiment: Experiment, data: Data, key: Key) -> KernelDensity:
        """Likelihood by kernels about draws of the placement."""
        if not integrated(self, experiment):
            raise InputError(
                "marginals.KDE estimates the spread that unknown placement gives to z, but no "
                "position or angle is a distribution. Declare one, at=positions.Segment(0.25, "
                "within=0.04), or use marginals.Latent()."
            )
        return KernelDensity(
            data, jax_key(key), self.placement_draws, self.kernel, self.noise_draws, self.common
        )
