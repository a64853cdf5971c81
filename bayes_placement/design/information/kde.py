"""kde: in, an experiment; out, what it teaches by the paper's estimate, its Table 1.

Not known here: where else a transducer could sit.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._types import InfeasibleError, InputError
from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import JointDraws, draws_of
from ...inference.marginals.kernel_density import KERNELS, Kernel, kernel
from . import _modal_products, _points
from ._estimator import Estimator, Gain, Plan, divergence, placement_laws
from ._kernels import log_density
from ._knowledge import knowledge, typical

BATCH = 25
"""Draws of the parameters whose responses are held at once."""

FEW = 4
"""Products, at most, that are summed one after the other and not by a product of matrices."""


class KDE(Estimator):
    """Divergence for the nominal response, with a kernel density estimate over placements.

    Table 1 of the paper: the data are the response at nominal parameters and places; the
    likelihood of each draw of the parameters is estimated from draws of the placement, Eqs. (29)
    and (31); Eq. (33) follows. All placements of a map share their draws, so that differences
    between them are smooth. Where all modes are known, single precision and one product of
    matrices do.

    Parameters
    ----------
    draws, placement_draws
        Draws of the parameters, in all, and of the placement, for each replicate.
    kernel
        `soize` or `silverman`, see `marginals.KDE`.
    sampling
        `sobol` (scrambled, in replicates) or `plain`: independent draws, as in the paper.
    replicates
        Independent sets of points, whose spread is the error.
    after
        What `infer` returned for an earlier measurement: the map then tells what the next one
        would add. By default nothing is known but the prior.
    """

    draws: int = eqx.field(static=True, default=1000)
    placement_draws: int = eqx.field(static=True, default=800)
    kernel: str = eqx.field(static=True, default="soize")
    sampling: str = eqx.field(static=True, default="sobol")
    replicates: int = eqx.field(static=True, default=4)
    after: JointDraws | None = eqx.field(default=None, converter=draws_of)

    def __check_init__(self) -> None:
        if self.kernel not in KERNELS:
            raise InputError(
                f"information.KDE has no kernel {self.kernel!r}. The kernels are "
                f"{' and '.join(KERNELS)}: KDE(kernel='soize')."
            )

    def typical(self) -> dict[str, np.ndarray]:
        """Means after the earlier measurement."""
        return typical(self.after)

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        ValueError
            If no placement or no parameter is unknown, or the sizes are too small.
        """
        known = knowledge(experiment, self.after, moved)
        placed = placement_laws(experiment, known.names)
        if not placed:
            raise InfeasibleError(
                "information.KDE estimates the spread that unknown placement gives to z, but no "
                "position or angle is a distribution. Declare one, at=positions.Segment(0.25, "
                "within=0.04), or use information.Exact()."
            )
        each = _points.shares(self.draws, self.replicates, "draws")
        sizes = (self.replicates, each, known.dimension)
        normal = _points.scores(self.sampling, *sizes, seed)
        spread = (self.replicates, self.placement_draws, _points.dimension(placed))
        draws = _Draws(known.values(normal), _points.scores(self.sampling, *spread, seed + 1))
        unknown = experiment.unknown
        everywhere = not any(unknown[name].is_placement for name in known.names)
        if everywhere and _modal_products.factorise(experiment):
            return self._by_products(experiment, draws)
        return self._by_responses(experiment, draws)

    def _by_products(self, experiment: Experiment, draws: "_Draws") -> Plan:
        static = _has_static(experiment)
        spectra = _spectra(experiment, draws.parameters, static)
        # Products that no parameter changes are summed once for all of them.
        varies = np.any(spectra != spectra[:1, :1], axis=(0, 1, 3))
        moving = jnp.asarray(spectra[..., varies, :], jnp.complex64)
        still = jnp.asarray(spectra[0, 0, ~varies], jnp.complex64)

        def plan(one: Experiment, nominal: dict[str, Any]) -> Gain:
            measured, variance, own = self._measured(one, nominal)
            low = (measured.astype(jnp.float32), variance.astype(jnp.float32), own)
            placed = placement_laws(one, draws.parameters)

            def replicate(several: Any) -> Float[Array, "draw"]:
                scores, changing = several
                places = _points.values(placed, scores)
                residues = jax.vmap(
                    lambda values: _modal_products.residues(one.fix(values)), out_axes=-1
                )(places).astype(jnp.float32)
                return _log_likelihoods(one, residues, varies, (changing, still), low)

            return divergence(
                jax.lax.map(replicate, (jnp.asarray(draws.placement), moving)).astype(float)
            )

        return plan

    def _by_responses(self, experiment: Experiment, draws: "_Draws") -> Plan:
        def plan(one: Experiment, nominal: dict[str, Any]) -> Gain:
            given = self._measured(one, nominal)
            placed = placement_laws(one, draws.parameters)

            def replicate(several: Any) -> Float[Array, "draw"]:
                scores, parameters = several
                places = _points.values(placed, scores)

                def likelihood(values: dict[str, Any]) -> Float[Array, ""]:
                    at = one.fix(values)
                    z = jax.vmap(lambda place: at.fix(place).predict(), out_axes=-1)(places)
                    return log_density(z, *given)

                return jax.lax.map(likelihood, parameters, batch_size=BATCH)

            both = (jnp.asarray(draws.placement), draws.parameters)
            return divergence(jax.lax.map(replicate, both))

        return plan

    def _measured(
        self, one: Experiment, nominal: dict[str, Any]
    ) -> tuple[Float[Array, "*output"], Float[Array, "*output"], Kernel]:
        """Nominal outputs, the variance of their error, and the kernel."""
        z = one.fix(nominal).predict()
        variance = jnp.zeros_like(z)
        if one.noise is not None:
            variance = jnp.broadcast_to(one.noise.distribution(z, None).variance, z.shape)
        return z, variance, kernel(self.kernel, self.placement_draws, z.size)


class _Draws(NamedTuple):
    """Parameters by name [replicate, draw], and scores of the placement [replicate, draw, .]."""

    parameters: dict[str, Any]
    placement: np.ndarray


def _has_static(experiment: Experiment) -> bool:
    """Tell whether the static flexibility is known."""
    nominal = experiment.nominal()
    found = jax.eval_shape(lambda: _modal_products.residues(nominal))
    modes = jax.eval_shape(lambda: nominal.structure.proper_modes().angular_frequency())
    return bool(found.shape[-1] > modes.shape[0])


def _spectra(experiment: Experiment, parameters: dict[str, Any], static: bool) -> np.ndarray:
    """Spectra [replicate, draw, product, frequency]."""

    def one(values: dict[str, Any]) -> Array:
        return _modal_products.spectra(experiment.fix(values), static)

    return np.asarray(jax.jit(jax.vmap(jax.vmap(one)))(parameters))


def _log_likelihoods(
    one: Experiment,
    residues: Float[Array, "sensor actuator product place"],
    varies: np.ndarray,
    spectra: tuple[Array, Array],
    given: Any,
) -> Float[Array, "draw"]:
    """Log likelihood of each draw of the parameters, a batch of them at a time."""
    moving, still = (jnp.moveaxis(residues[:, :, kept], 2, 0) for kept in (varies, ~varies))
    changing, constant = spectra
    base = [_summed(part(constant), still) for part in (jnp.real, jnp.imag)]

    def likelihood(spectrum: Array) -> Float[Array, ""]:
        real, imaginary = (
            known + _summed(part(spectrum), moving)
            for known, part in zip(base, (jnp.real, jnp.imag), strict=True)
        )
        frf = jax.lax.complex(real, imaginary)
        return log_density(jax.vmap(one.observe.output, -1, -1)(frf), *given)

    return jax.lax.map(likelihood, changing, batch_size=BATCH)


def _summed(
    spectrum: Float[Array, "product frequency"],
    residues: Float[Array, "product sensor actuator place"],
) -> Float[Array, "sensor actuator frequency place"]:
    """Sum of products, the placements last."""
    if len(residues) > FEW:
        return jnp.einsum("pf,psax->safx", spectrum, residues)
    # Term by term, which goes together with what follows.
    total = jnp.zeros((*residues.shape[1:3], spectrum.shape[1], residues.shape[3]), residues.dtype)
    for line, residue in zip(spectrum, residues, strict=True):
        total = total + line[:, None] * residue[:, :, None]
    return total
