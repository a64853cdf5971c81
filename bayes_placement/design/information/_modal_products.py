"""FRFs as sums of products of shapes and spectra, for known modes.

The first factor of each product depends on the placement only, the second on the damping only: so
the FRFs of many dampings and many placements are one product of matrices.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ..._shared.sites import Owner
from ...effects.effect import Modulus
from ...experiment.experiment import Experiment
from ...experiment.frf import modal_receptance
from ...modes.beams.waveguide import many_phases
from ...modes.points import Points, joined


def factorise(experiment: Experiment) -> bool:
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


def residues(experiment: Experiment) -> Float[Array, "sensor actuator product"]:
    """Products of shapes [1/kg], and the static flexibility [m/N] where it is known."""
    modes = experiment.structure.proper_modes()
    read, driven = (_points(side, modes.axes) for side in (experiment.sensor, experiment.actuator))
    with many_phases():
        shapes = read.shapes(modes)[:, None] * driven.shapes(modes)
    static = read.static_flexibility(modes, driven)
    return shapes if static is None else jnp.concatenate([shapes, static[..., None]], axis=-1)


def spectra(experiment: Experiment) -> Complex[Array, "product frequency"]:
    """FRF of the observed quantity for a unit residue, for known damping."""
    omega = 2 * jnp.pi * jnp.asarray(experiment.frequency)
    factors = modal_receptance(experiment.structure, experiment.structure.proper_modes(), omega)
    products = factors.modal
    if _has_static_flexibility(experiment):
        products = jnp.concatenate([factors.beyond_static, factors.relative_compliance[None]])
    return experiment.observe.frf(products[:, None] + 0j, omega)[:, 0]


def _has_static_flexibility(experiment: Experiment) -> bool:
    nominal = experiment.nominal()
    products = jax.eval_shape(lambda: residues(nominal)).shape[-1]
    modes = jax.eval_shape(lambda: nominal.structure.proper_modes().angular_frequency()).shape[0]
    return bool(products > modes)


def _points(side: dict, axes: tuple[int, ...]) -> Points:
    return joined([transducer.points(axes) for transducer in side.values()])
