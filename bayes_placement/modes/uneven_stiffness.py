"""Modes of a structure whose stiffness differs a little from piece to piece."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._compiled import compiled
from .beams.uniform_line import UniformLine
from .changed import ChangedModes, DerivedModes, changed
from .finite_elements.nodal_modes import NodalModes, nodal_of
from .modes import Modes

_NODES = 8
"""Nodes of quadrature in a piece, besides four for each half-wave of the shortest mode in it."""


def energy_shares(modes: Modes, pieces: int) -> Float[np.ndarray, "piece mode mode"] | None:
    """Share of each piece in the strain energy between modes, over their natural frequencies.

    Parameters
    ----------
    modes
        Modes whose parameters are numbers.
    pieces
        Number of pieces of equal length of a uniform bar or beam. Those of a finite element model
        are its regions, as many as it has.

    Returns
    -------
    Float[np.ndarray, "piece mode mode"] or None
        Modal stiffness of each piece over omega_r omega_s [1], whose sum over the pieces of a line
        is one between a mode and itself and zero else; None where no piece is known.
    """
    base = _beneath(modes)
    if isinstance(base, UniformLine):
        return _of_line(base, pieces)
    nodal = nodal_of(base)
    return None if nodal is None or not nodal.regions.names else _of_regions(nodal)


def with_uneven_stiffness(modes: Modes, excess: Float[Array, "mode mode"]) -> ChangedModes:
    """Modes once the stiffness differs, in the span of the modes.

    Parameters
    ----------
    modes
        Modes of the even structure.
    excess
        Sum over the pieces of their relative excess of stiffness times their `energy_shares` [1].
    """
    return changed(modes, _over(modes, excess))


def _over(modes: Modes, excess: Float[Array, "mode mode"]) -> Float[Array, "mode mode"]:
    """Modal stiffness [(rad/s)^2] over modes, from what it is over those beneath them."""
    if isinstance(modes, DerivedModes):
        # Shapes that opened interfaces add to the span are left out: a model error is no more
        # exact than that.
        return modes.of_modes.T @ _over(modes.modes, excess) @ modes.of_modes
    natural = modes.angular_frequency()
    return natural[:, None] * excess * natural


def _beneath(modes: Modes) -> Modes:
    return _beneath(modes.modes) if isinstance(modes, DerivedModes) else modes


def _of_line(line: UniformLine, pieces: int) -> Float[np.ndarray, "piece mode mode"]:
    waves = line.wave_numbers[-1] / np.pi / pieces
    nodes, weights = np.polynomial.legendre.leggauss(_NODES + 4 * int(np.ceil(waves)))
    within = (np.arange(pieces)[:, None] + (nodes + 1) / 2) / pieces
    length = float(line.length)  # type: ignore[arg-type]
    shapes = np.asarray(compiled(_strains)(line, within.ravel() * length))
    strains = shapes.reshape(pieces, nodes.size, -1) / _elastic(line)
    weighted = strains * (weights * length / (2 * pieces))[:, None]
    return float(line.stiffness) * np.einsum("pnr,pns->prs", weighted, strains)  # type: ignore[arg-type]


def _strains(
    line: UniformLine, position: Float[np.ndarray | Array, "point"]
) -> Float[Array, "point mode"]:
    """Axial strains of a bar, curvatures of a beam."""
    return jax.vmap(lambda at: line.shapes(at, line.half_order)[0])(jnp.asarray(position))


def _of_regions(nodal: NodalModes) -> Float[np.ndarray, "piece mode mode"]:
    natural = _elastic(nodal)
    scale = float(nodal.stiffness_scale() / nodal.mass_scale())
    return np.asarray(nodal.regions.matrices) * scale / (natural[:, None] * natural)


def _elastic(modes: Modes) -> Float[np.ndarray, "mode"]:
    """Natural angular frequencies [rad/s], infinite for rigid-body modes, which strain nothing."""
    natural = np.array(compiled(_angular_frequency)(modes))
    natural[: modes.rigid_body_modes] = np.inf
    return natural


def _angular_frequency(modes: Modes) -> Float[Array, "mode"]:
    return modes.angular_frequency()
