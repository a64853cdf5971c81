"""marginals: in, an experiment and a measurement; out, a NumPyro model with placement in or out.

Placement is sampled along (Latent), summed where it is at nodes (Nodes) or integrated out
(Quadrature, KDE). Not known here: engines.
"""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpyro
from numpyro.distributions import Distribution

from .._random import jax_key
from .._sites import Unknown, is_finite, realise
from .._types import InfeasibleError, InputError, Key
from ..experiment.experiment import MEASURED, Experiment
from ..experiment.noise import Data
from . import _kernel_density, _tensor_quadrature

LEAST_NODES = 2.5
"""Least effective number of nodes along a coordinate that resolves an integral.

Nodes a distance d apart integrate a bell of standard deviation 0.7 d to a relative error of 1e-4,
and 2 sqrt(pi) 0.7 = 2.5 of them are effective under it.
"""

Model = Callable[[], None]


class Marginal(eqx.Module):
    """What becomes of the placement in the likelihood."""

    samples_placement: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def integrates(self, unknown: Unknown) -> bool:
        """Tell whether an unknown is taken out of the likelihood here."""

    def sampled(self, experiment: Experiment) -> list[Unknown]:
        """Return the unknowns that are left to the engine."""
        return [one for one in experiment.unknowns if not self.integrates(one)]

    @abc.abstractmethod
    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """NumPyro model whose unknowns are those that an engine is to sample."""

    @abc.abstractmethod
    def placement(self, experiment: Experiment, data: Data, key: Key) -> "Resolve | None":
        """How to draw the integrated placement back; None if nothing was integrated."""

    @abc.abstractmethod
    def settings(self) -> dict[str, Any]:
        """What determines the result, for the record."""


Resolve = Callable[[Experiment, Key], tuple[dict[str, Any], dict[str, Any]]]
"""From an experiment whose parameters are numbers, and a key: one placement drawn given data and
parameters, and how well the integral is resolved: `node_ess` along a coordinate, and for kernels
`kernel_over_noise`."""


class Latent(Marginal):
    """Sample the placement along with the parameters: exact, for any number of transducers."""

    samples_placement = True

    def integrates(self, unknown: Unknown) -> bool:
        """Nothing is."""
        return False

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return the experiment's own model."""
        return lambda: experiment.model(data)

    def placement(self, experiment: Experiment, data: Data, key: Key) -> None:
        """Nothing was integrated."""
        return

    def settings(self) -> dict[str, Any]:
        """Only the name."""
        return {"marginal": "Latent"}


class Nodes(Marginal):
    """Sum over all positions at nodes of a mesh: exact, with everything else left latent.

    Places of effects at nodes are summed as well. Given the nodes of the actuators, sensors are
    independent of each other, so the cost grows with the number of combinations of the actuators'
    nodes (or the sensors', whichever are fewer) times the nodes of one further instrument.
    """

    samples_placement = True

    def integrates(self, unknown: Unknown) -> bool:
        """Whatever has finitely many values."""
        return is_finite(unknown.distribution)

    def _mixture(self, experiment: Experiment) -> _tensor_quadrature.Nested:
        laws = _integrated(self, experiment)
        if not laws:
            raise InputError(
                "marginals.Nodes sums over positions at nodes, but none is unknown. Declare one, "
                "at=positions.Nodes(positions, positions.Box(...)), or use marginals.Latent()."
            )
        return _nested(self, experiment, laws, 1)

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which all but the nodes is sampled."""
        return _nested_model(self, experiment, data, self._mixture(experiment))

    def placement(self, experiment: Experiment, data: Data, key: Key) -> Resolve:
        """Draw nodes in proportion to their share of the likelihood."""
        nodes = self._mixture(experiment)
        return lambda one, draw_key: (
            _tensor_quadrature.resolve(one, data, nodes, draw_key)[0],
            {},
        )

    def settings(self) -> dict[str, Any]:
        """Only the name."""
        return {"marginal": "Nodes"}


class Quadrature(Marginal):
    """Integrate the placement by Gauss quadrature: exact once resolved, for few transducers.

    Given the places of the actuators, sensors are independent of each other, so the cost grows
    with points^(actuators + 1) (or sensors, whichever are fewer). Positions at nodes are summed.

    Parameters
    ----------
    points
        Gauss nodes for each continuous coordinate.
    """

    samples_placement = False
    points: int = eqx.field(static=True, default=64)

    def integrates(self, unknown: Unknown) -> bool:
        """All placement is."""
        return unknown.is_placement

    def _mixture(self, experiment: Experiment) -> _tensor_quadrature.Nested:
        return _nested(self, experiment, _integrated(self, experiment), self.points)

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which only parameters and output error are sampled."""
        return _nested_model(self, experiment, data, self._mixture(experiment))

    def placement(self, experiment: Experiment, data: Data, key: Key) -> Resolve:
        """Draw nodes in proportion to their share of the likelihood."""
        nodes = self._mixture(experiment)
        return lambda one, draw_key: _tensor_quadrature.resolve(one, data, nodes, draw_key)

    def settings(self) -> dict[str, Any]:
        """Name and number of nodes."""
        return {"marginal": "Quadrature", "marginal_points": self.points}


class KDE(Marginal):
    """Estimate the density of z given h from draws of the placement, Eqs. (29) and (31).

    Parameters
    ----------
    draws
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
    """

    samples_placement = False
    draws: int = eqx.field(static=True, default=800)
    kernel: str = eqx.field(static=True, default="soize")
    noise_draws: int | None = eqx.field(static=True, default=None)
    common: bool = eqx.field(static=True, default=True)

    def integrates(self, unknown: Unknown) -> bool:
        """All placement is."""
        return unknown.is_placement

    def __check_init__(self) -> None:
        if self.kernel not in _kernel_density.SHRINKAGE:
            raise InputError(
                f"marginals.KDE has no kernel {self.kernel!r}. The kernels are "
                f"{' and '.join(_kernel_density.SHRINKAGE)}: KDE(kernel='soize')."
            )
        if self.draws < 2:
            raise InputError(
                f"marginals.KDE(draws={self.draws}) was given; a spread needs at least two draws, "
                "and an estimate hundreds: KDE(draws=800)."
            )

    def _estimate(
        self, experiment: Experiment, data: Data, key: Key
    ) -> _kernel_density.KernelDensity:
        if not any(unknown.is_placement for unknown in experiment.unknowns):
            raise InputError(
                "marginals.KDE estimates the spread that unknown placement gives to z, but no "
                "position or angle is a distribution. Declare one, at=positions.Segment(0.25, "
                "within=0.04), or use marginals.Latent()."
            )
        return _kernel_density.KernelDensity(
            data, jax_key(key), self.draws, self.kernel, self.noise_draws, self.common
        )

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which only parameters and output error are sampled."""
        estimate = self._estimate(experiment, data, key)
        return _marginal_model(self, experiment, estimate.log_likelihood)

    def placement(self, experiment: Experiment, data: Data, key: Key) -> Resolve:
        """Draw placements in proportion to the share of their kernels in the likelihood."""
        return self._estimate(experiment, data, key).resolve

    def settings(self) -> dict[str, Any]:
        """Name, sizes and options."""
        return {
            "marginal": "KDE",
            "marginal_draws": self.draws,
            "marginal_kernel": self.kernel,
            "marginal_noise_draws": self.noise_draws or 0,
            "marginal_common": int(self.common),
        }


def _integrated(marginal: Marginal, experiment: Experiment) -> dict[str, Distribution]:
    return {one.name: one.distribution for one in experiment.unknowns if marginal.integrates(one)}


def _marginal_model(
    marginal: Marginal, experiment: Experiment, log_likelihood: Callable[[Experiment], jax.Array]
) -> Model:
    integrated = _integrated(marginal, experiment)

    def model() -> None:
        one = realise(experiment, where=lambda unknown: unknown.name not in integrated)
        numpyro.factor(MEASURED, log_likelihood(one))

    return model


def _nested(
    marginal: Marginal, experiment: Experiment, laws: dict[str, Distribution], points: int
) -> _tensor_quadrature.Nested:
    _check_noise(experiment, type(marginal).__name__)
    _check_independent(experiment, type(marginal).__name__)
    return _tensor_quadrature.nested(experiment, laws, points)


def _nested_model(
    marginal: Marginal, experiment: Experiment, data: Data, nodes: _tensor_quadrature.Nested
) -> Model:
    return _marginal_model(
        marginal, experiment, lambda one: _tensor_quadrature.log_likelihood(one, data, nodes)
    )


def _check_independent(experiment: Experiment, name: str) -> None:
    effect = next(iter(experiment.instrument_effects), None)
    if effect is not None:
        raise InfeasibleError(
            f"marginals.{name} was given an experiment with the effect "
            f'"{effect}" on its instruments, but it needs sensors that are '
            "independent of each other once the actuators are placed, and such an effect may "
            "couple them. Use marginals.Latent()."
        )


def _check_noise(experiment: Experiment, name: str) -> None:
    if experiment.noise is None:
        raise InfeasibleError(
            f"marginals.{name} integrates a density of the measured outputs, which noise=None "
            "lacks. Give noise.Gaussian(sigma), or use marginals.KDE(), whose kernel is a density."
        )
