"""The paper's estimate of the information gain (Table 1), by kernel densities of the response.

For known modes FRFs are sums of products of shapes and spectra. The first factor of each depends on
the placement only, the second on the damping only: so the FRFs of many dampings and many placements
are one product of matrices.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..._shared.arguments import check_fields
from ..._shared.compiled import compiled
from ..._shared.errors import InfeasibleError, InputError
from ..._shared.sites import Owner
from ...effects.effect import Modulus
from ...experiment.experiment import Experiment
from ...experiment.frf import modal_receptance
from ...inference.marginals.kde import KERNELS, Kernel, kernel
from ...modes.beams.waveguide import many_phases
from ...modes.points import Points, joined
from . import _sampling
from ._kernel_densities import log_density
from ._sampling import prior_knowledge
from .estimator import Gain, GainAboutParameters, Plan, Values, divergence, placement_distributions

BATCH = 25
"""Draws of the parameters whose responses are in memory at once."""

MOST_SUMMANDS = 4
"""Products, at most, that are summed one after the other and not by a product of matrices."""

RANGE = 30
"""Powers of two up to which single precision needs no scale: squares of outputs do not overflow."""


Numbers = TypeVar("Numbers", Array, np.ndarray)


class KernelGain(GainAboutParameters):
    """The paper's estimate of the information gain, by kernel densities of the response.

    It estimates the Kullback-Leibler divergence of the posterior of the parameters from their prior
    [nat], for data that equal the response at nominal parameters and positions. The steps are those
    of Table 1 of the paper:

    1. Draw the parameters from their prior, `draws` times.
    2. For each of these draws, compute the response at `placement_draws` draws of the unknown
       positions and angles. The kernel density estimate of these responses at the data is the
       likelihood of the parameters, Eq. (31). The variance of the noise is added to that of the
       kernels, where the paper averages over draws of the noise.
    3. Sum over the draws of the parameters, Eq. (33).

    The placements of a map share all draws, so that differences between them have small errors.
    Where all modes are known, FRFs are computed as a product of matrices in single precision. FRFs
    that are very small or large are scaled first, which changes neither bandwidths nor divergence.

    Parameters
    ----------
    draws
        Draws of the parameters, those of all replicates together.
    placement_draws
        Draws of the placement for each draw of the parameters. Those of a replicate share them.
    kernel
        `soize` or `silverman`, see `marginals.KDE`.
    sampling
        `sobol` (scrambled) or `plain`: independent draws, as in the paper.
    replicates
        Independent sets into which the draws are divided. Their spread gives the standard error.
    after
        Result of `infer` for an earlier measurement: the map is then the gain by the next one. By
        default only the prior is known.

    Examples
    --------
    >>> bp.information.KernelGain(draws=500, placement_draws=200)
    KernelGain(draws=500, placement_draws=200)
    """

    draws: int = eqx.field(static=True, default=1000)
    placement_draws: int = eqx.field(static=True, default=800)
    kernel: str = eqx.field(static=True, default="soize")

    def __check_init__(self) -> None:
        check_fields(self)
        if self.kernel not in KERNELS:
            raise InputError(
                f"information.KernelGain has no kernel {self.kernel!r}. The kernels are "
                f"{' and '.join(KERNELS)}: KernelGain(kernel='soize')."
            )

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        InputError
            If no placement or no parameter is unknown, or there are too few draws.
        """
        knowledge = prior_knowledge(experiment, self.after, moved)
        placed = placement_distributions(experiment, knowledge.names)
        if not placed:
            raise InfeasibleError(
                "information.KernelGain estimates the spread that unknown placement gives to z, "
                "but no position or angle is a distribution. Declare one, "
                "at=positions.Segment(0.25, within=0.04), or use information.Exact()."
            )
        count = _sampling.draws_of_replicate(self.draws, self.replicates)
        sizes = (self.replicates, count, knowledge.dimension)
        parameters = knowledge.values(_sampling.scores(self.sampling, *sizes, seed))
        sizes = (self.replicates, self.placement_draws, _sampling.dimension(placed))
        draws = _Draws(parameters, _sampling.scores(self.sampling, *sizes, seed + 1))
        unknown = experiment.unknown
        no_position_known = not any(unknown[name].is_of_transducer for name in knowledge.names)
        if no_position_known and _factorise(experiment):
            return _by_products(experiment, draws, self._kernel())
        return _ByResponses(draws, self._kernel())

    def _kernel(self) -> "_KernelName":
        return _KernelName(self.kernel, self.placement_draws)


class _KernelName(NamedTuple):
    """Name of a kernel, and the draws of the placement that it smooths."""

    name: str
    draws: int

    def of(self, outputs: int) -> Kernel:
        """Kernel for so many outputs."""
        return kernel(self.name, self.draws, outputs)


class _Draws(NamedTuple):
    """Parameters by name [replicate, draw], and scores of the placement [replicate, draw, .]."""

    parameters: dict[str, Array]
    placement: np.ndarray


class _ByProducts(eqx.Module):
    """The estimate where all modes are known, in single precision."""

    known: tuple[str, ...] = eqx.field(static=True)
    """Names of the parameters."""
    varies: tuple[bool, ...] = eqx.field(static=True)
    """Which products depend on the parameters; the others are summed once for all draws."""
    scales: np.ndarray
    """Scale of each product, by which its residues are divided."""
    varying: Array
    constant: Array
    """Spectra of the products that depend on the parameters [replicate, draw, product, frequency],
    and of the others [product, frequency]."""
    placement: Array
    """Scores of the placement [replicate, draw, .]."""
    kernel: _KernelName = eqx.field(static=True)
    """The kernel."""

    def __call__(self, at: Experiment, nominal: Values) -> Gain:
        """Information gain of an experiment."""
        unit, target = _scaled_target(at, nominal, self.kernel)
        placed, varies = placement_distributions(at, self.known), np.array(self.varies)

        def replicate(inputs: tuple[Array, Array]) -> Float[Array, "draw"]:
            scores, varying = inputs
            positions = _sampling.values(placed, scores)
            residues = jax.vmap(lambda values: _residues(at.fix(values)), out_axes=-1)(positions)
            scaled = (residues * (unit / self.scales)[:, None]).astype(jnp.float32)
            scaled = jax.lax.optimization_barrier(scaled)  # not to be computed for each batch
            return _log_likelihoods(at, scaled, varies, (varying, self.constant), target)

        return divergence(jax.lax.map(replicate, (self.placement, self.varying)).astype(float))


class _ByResponses(eqx.Module):
    """The estimate from responses, where modes depend on parameters."""

    draws: _Draws
    kernel: _KernelName = eqx.field(static=True)

    def __call__(self, at: Experiment, nominal: Values) -> Gain:
        """Information gain of an experiment."""
        z = at.fix(nominal).predict()
        target = (z, _error_variance(at, z), self.kernel.of(z.size))
        placed = placement_distributions(at, self.draws.parameters)

        def replicate(inputs: tuple[Array, dict[str, Array]]) -> Float[Array, "draw"]:
            scores, parameters = inputs
            positions = _sampling.values(placed, scores)

            def likelihood(values: dict[str, Array]) -> Float[Array, ""]:
                fixed = at.fix(values)
                z = jax.vmap(lambda place: fixed.fix(place).predict(), out_axes=-1)(positions)
                return log_density(z, *target)

            return jax.lax.map(likelihood, parameters, batch_size=BATCH)

        inputs = (jnp.asarray(self.draws.placement), self.draws.parameters)
        return divergence(jax.lax.map(replicate, inputs))


def _by_products(experiment: Experiment, draws: _Draws, kernel: _KernelName) -> _ByProducts:
    spectra = np.asarray(compiled(_spectra_of_draws)(experiment, draws.parameters))
    scales = _power_of_two(np.abs(spectra).max(axis=(0, 1, 3)))
    spectra = spectra * scales[:, None]
    varies = np.any(spectra != spectra[:1, :1], axis=(0, 1, 3))
    return _ByProducts(
        tuple(draws.parameters),
        tuple(varies.tolist()),
        scales,
        jnp.asarray(spectra[..., varies, :], jnp.complex64),
        jnp.asarray(spectra[0, 0, ~varies], jnp.complex64),
        jnp.asarray(draws.placement),
        kernel,
    )


def _scaled_target(
    at: Experiment, nominal: Values, kernel: _KernelName
) -> tuple[Array, tuple[Array, Array, Kernel]]:
    """Scale of the FRFs, and in that unit the nominal outputs, their variance, the kernel."""
    frf = at.fix(nominal).frf()
    unit = _power_of_two(jnp.abs(frf).max())
    z, scaled = at.observe.output(frf), at.observe.output(frf * unit)
    ones = jnp.ones(frf.shape)
    ratio = at.observe.deviation(frf * unit, ones * unit**2) / at.observe.deviation(frf, ones)
    variance = _error_variance(at, z) * ratio**2
    single = (scaled.astype(jnp.float32), variance.astype(jnp.float32))
    return unit, (*single, kernel.of(z.size))


def _error_variance(experiment: Experiment, z: Float[Array, "*output"]) -> Float[Array, "*output"]:
    """Variance of the output error, zero for none."""
    if experiment.noise is None:
        return jnp.zeros_like(z)
    return jnp.broadcast_to(experiment.noise.distribution(z, None).variance, z.shape)


def _power_of_two(magnitude: Numbers) -> Numbers:
    """Power of two that scales a magnitude to about 1; 1 where no scale is needed."""
    xp = jnp if isinstance(magnitude, jax.Array) else np
    exponent = xp.frexp(magnitude)[1]
    return xp.ldexp(1.0, xp.where(xp.abs(exponent) > RANGE, -exponent, 0))


def _spectra_of_draws(experiment: Experiment, parameters: dict[str, Array]) -> Array:
    """Spectra [replicate, draw, product, frequency]."""

    def spectra(values: dict[str, Array]) -> Array:
        return _spectra(experiment.fix(values))

    return jax.vmap(jax.vmap(spectra))(parameters)


def _log_likelihoods(
    experiment: Experiment,
    residues: Float[Array, "sensor actuator product placement"],
    varies: np.ndarray,
    spectra: tuple[Array, Array],
    target: tuple[Array, Array, Kernel],
) -> Float[Array, "draw"]:
    """Log likelihood of each draw of the parameters, a batch of them at a time."""
    varying, constant = spectra
    changed, fixed = (jnp.moveaxis(residues[:, :, chosen], 2, 0) for chosen in (varies, ~varies))
    base = [_summed(part(constant), fixed) for part in (jnp.real, jnp.imag)]

    def outputs(spectrum: Array) -> Float[Array, "*output placement"]:
        real, imaginary = (
            constant_part + _summed(part(spectrum), changed)
            for constant_part, part in zip(base, (jnp.real, jnp.imag), strict=True)
        )
        frf = _at_force_levels(experiment, jax.lax.complex(real, imaginary))
        return jax.vmap(experiment.observe.output, -1, -1)(frf)

    def likelihoods(batch: Array) -> Float[Array, "draw"]:
        return jax.vmap(lambda z: log_density(z, *target))(_one_by_one(outputs, batch))

    count = len(varying)
    rows = np.minimum(np.arange(-(-count // BATCH) * BATCH), count - 1)  # the last is filled up
    return jax.lax.map(likelihoods, varying[rows.reshape(-1, BATCH)]).ravel()[:count]


def _one_by_one(function: Callable[[Array], Array], inputs: Array) -> Array:
    """Outputs of a function, computed once; on a GPU all at once.

    What the compiler fuses with several others it computes for each of them anew, but not what
    comes from a loop.
    """
    if jax.default_backend() == "cpu":
        return jax.lax.map(function, inputs)
    return jax.vmap(function)(inputs)


def _at_force_levels(experiment: Experiment, frf: Array) -> Array:
    """FRF with an axis of force levels, where these are stated: it is the same at all of them."""
    levels = experiment.force_levels
    return frf if levels is None else jnp.repeat(frf[:, :, None], len(levels), axis=2)


def _summed(
    spectrum: Float[Array, "product frequency"],
    residues: Float[Array, "product sensor actuator placement"],
) -> Float[Array, "sensor actuator frequency placement"]:
    """Sum of products, the draws of the placement last."""
    if len(residues) > MOST_SUMMANDS:
        # Placements last in memory too, since what follows goes along them.
        total = spectrum.T @ residues.reshape(len(residues), -1)
        return jnp.moveaxis(total.reshape(-1, *residues.shape[1:]), 0, 2)
    # Term by term, which the compiler fuses with what follows.
    total = jnp.zeros((*residues.shape[1:3], spectrum.shape[1], residues.shape[3]), residues.dtype)
    for line, residue in zip(spectrum, residues, strict=True):
        total = total + line[:, None] * residue[:, :, None]
    return total


def _factorise(experiment: Experiment) -> bool:
    """Return whether FRFs are such products: no attachments, and all modes known."""
    structure = experiment.structure
    if experiment.instrument_effects:
        return False
    if experiment.model_error is not None:
        return False
    if structure.attachments or structure.amplitude_attachments or _recording(experiment):
        return False
    moduli = [Owner("effects", modulus.name) for modulus in structure.of_kind(Modulus)]
    owners = [unknown.owner for unknown in experiment.unknowns if not unknown.is_of_transducer]
    return all(owner in (Owner("damping"), *moduli) for owner in owners)


def _recording(experiment: Experiment) -> bool:
    """Tell whether a gain or a delay of a transducer is not exact."""
    transducers = [*experiment.sensor.values(), *experiment.actuator.values()]
    return any(
        transducer.gain is not None or transducer.delay is not None for transducer in transducers
    )


def _residues(experiment: Experiment) -> Float[Array, "sensor actuator product"]:
    """Products of shapes [1/kg], and the static flexibility [m/N] where it is known."""
    modes = experiment.structure.proper_modes()
    read, driven = (_points(side, modes.axes) for side in (experiment.sensor, experiment.actuator))
    with many_phases():
        shapes = read.shapes(modes)[:, None] * driven.shapes(modes)
    static = read.static_flexibility(modes, driven)
    return shapes if static is None else jnp.concatenate([shapes, static[..., None]], axis=-1)


def _spectra(experiment: Experiment) -> Complex[Array, "product frequency"]:
    """FRF of the observed quantity for a unit residue, for known damping."""
    omega = 2 * jnp.pi * jnp.asarray(experiment.frequency)
    factors = modal_receptance(experiment.structure, experiment.structure.proper_modes(), omega)
    products = factors.modal
    if _has_static_flexibility(experiment):
        products = jnp.concatenate([factors.beyond_static, factors.relative_compliance[None]])
    return experiment.observe.frf(products[:, None] + 0j, omega)[:, 0]


def _has_static_flexibility(experiment: Experiment) -> bool:
    nominal = experiment.nominal()
    products = jax.eval_shape(lambda: _residues(nominal)).shape[-1]
    modes = jax.eval_shape(lambda: nominal.structure.proper_modes().angular_frequency()).shape[0]
    return bool(products > modes)


def _points(side: dict, axes: tuple[int, ...]) -> Points:
    return joined([transducer.points(axes) for transducer in side.values()])
