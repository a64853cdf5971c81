"""Modes of a structure whose stiffness and mass differ a little from piece to piece."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.compiled import compiled
from .beams.waveguide import Waveguide
from .changed import ChangedModes, DerivedModes, changed, original
from .finite_elements._part_factors import CELLS
from .finite_elements.nodal_modes import NodalModes, nodal_of
from .modes import Modes, frequencies_of

AtPoints = Float[Array, "point mode"]
Energies = Float[Array, "mode mode"]

_NODES = 8
"""Nodes of quadrature in a piece, besides four for each half-wave of the shortest mode in it."""


class PieceShares(NamedTuple):
    """Share of each piece in the energies between modes."""

    stiffness: Float[np.ndarray | Array, "piece mode mode"]
    """Modal stiffness of each piece over omega_r omega_s [1]. Summed over the pieces of a line it
    is one between an elastic mode and itself, and zero else."""
    mass: Float[np.ndarray | Array, "piece mode mode"]
    """Modal mass of each piece [1], the same of all modes."""


class Excess(NamedTuple):
    """What uneven pieces add to the modal matrices of the structure beneath all changes.

    The modal stiffness is over omega_r omega_s [1], as the shares of a piece.
    """

    stiffness: Energies
    mass: Energies


def piece_shares(modes: Modes, pieces: int, count: int) -> PieceShares | None:
    """Share of each piece in the energies between some modes; None where no piece is known.

    Pieces of a uniform bar or beam are so many of equal length. Those of the mass of a finite
    element model are its cells; those of its stiffness are its regions, as many as it has, or the
    cells again where it has none. Of few nodes each is a cell, and the stiffness lies between them:
    no piece is known then. The modes that pieces mix are the lowest, rigid-body modes among them.
    """
    base = original(modes)
    nodal = nodal_of(base)
    if isinstance(base, Waveguide):
        shares = _of_waveguide(base, pieces)
    elif nodal is not None and (nodal.regions.names or len(nodal.cell_masses) >= CELLS):
        shares = _of_nodal(nodal)
    else:
        return None
    return PieceShares(*(share[:, :count, :count] for share in shares))


def with_uneven_pieces(modes: Modes, excess: Excess) -> ChangedModes:
    """Modes once stiffness and mass differ, in the span of as many of them as there are shares."""
    natural = original(modes).angular_frequency()[: len(excess.mass)]
    stiffness = natural[:, None] * excess.stiffness * natural
    return changed(modes, _over(modes, stiffness), _over(modes, excess.mass))


def _over(modes: Modes, matrix: Energies) -> Energies:
    """Matrix over modes, from what it is over those beneath them.

    Shapes that compliant interfaces add are left out: pieces are no more exact than that.
    """
    if not isinstance(modes, DerivedModes):
        return matrix
    combination = modes.of_modes[: len(matrix), : len(matrix)]
    return combination.T @ _over(modes.modes, matrix) @ combination


def _of_waveguide(waveguide: Waveguide, pieces: int) -> PieceShares:
    waves = waveguide.wave_numbers[-1] / np.pi / pieces
    nodes, weights = np.polynomial.legendre.leggauss(_NODES + 4 * int(np.ceil(waves)))
    within = (np.arange(pieces)[:, None] + (nodes + 1) / 2) / pieces
    length, area, density, stiffness = (
        float(value)  # type: ignore[arg-type]
        for value in (waveguide.length, waveguide.area, waveguide.density, waveguide.stiffness)
    )
    read = compiled(_shapes_and_strains)(waveguide, within.ravel() * length)
    shapes, strains = (np.asarray(rows).reshape(pieces, nodes.size, -1) for rows in read)
    strains = strains / _elastic(waveguide)
    weights = (weights * length / (2 * pieces))[:, None]
    return PieceShares(
        stiffness * np.einsum("pnr,pns->prs", weights * strains, strains),
        density * area * np.einsum("pnr,pns->prs", weights * shapes, shapes),
    )


def _shapes_and_strains(
    waveguide: Waveguide, position: Float[np.ndarray | Array, "point"]
) -> tuple[AtPoints, AtPoints]:
    """Shapes, and axial strains of a bar or curvatures of a beam."""

    def at(place: Float[Array, ""]) -> tuple[Array, Array]:
        return waveguide.shapes(place)[0], waveguide.shapes(place, waveguide.half_order)[0]

    return jax.vmap(at)(jnp.asarray(position))


def _of_nodal(nodal: NodalModes) -> PieceShares:
    natural, mass = _elastic(nodal), np.asarray(nodal.cell_masses)
    if not nodal.regions.names:
        return PieceShares(_strained_where_it_moves(mass, natural), mass)
    scale = float(nodal.stiffness_scale() / nodal.mass_scale())
    stiffness = np.asarray(nodal.regions.matrices) * scale / (natural[:, None] * natural)
    return PieceShares(stiffness, mass)


def _strained_where_it_moves(
    mass: Float[np.ndarray, "cell mode mode"], natural: Float[np.ndarray, "mode"]
) -> Float[np.ndarray, "cell mode mode"]:
    """Share of each cell in the strain energies where no stiffness is known cell by cell.

    It is that in the kinetic energies, as in a plate on simple supports away from its edges: modes
    close to one another are mixed alike, and by those the response changes.
    """
    elastic = np.isfinite(natural)
    return np.where(elastic & elastic[:, None], mass, 0.0)


def _elastic(modes: Modes) -> Float[np.ndarray, "mode"]:
    """Natural angular frequencies [rad/s], infinite for rigid-body modes, which strain nothing."""
    natural = 2 * np.pi * frequencies_of(modes)
    natural[: modes.rigid_body_modes] = np.inf
    return natural
