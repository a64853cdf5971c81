"""finite_elements: in, stiffness and mass matrices and how to read between nodes; out, modes.

Not known here: files, damping, effects, probability. Everything sparse is solved here, once.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from . import nodal_modes
from ._types import Parameter
from .interpolation import Interpolation
from .matrices import Matrices
from .nodal_modes import NodalModes
from .supports import Support

MOST_ROWS = 6000
"""Rows between which the static flexibility is kept: a dense matrix of 300 MB."""


def modes(
    matrices: Matrices,
    interpolation: Interpolation,
    *,
    up_to: float,
    pieces: Sequence[Support] = (),
    members: Mapping[str, Any] | None = None,
    youngs_modulus: Parameter = 1.0,
    density: Parameter = 1.0,
    nominal: tuple[float, float] = (1.0, 1.0),
) -> NodalModes:
    """Modes of a finite element model, with the static flexibility of all that are left out.

    With it, modes up to three times the band are enough for 0.5 % of the receptance.

    Parameters
    ----------
    matrices
        Stiffness and mass.
    interpolation
        How shapes are read between nodes, `interpolation.frame(matrices, elements)` for one. A
        large model is read only where it matters: `interpolation.near(position, radius)`.
    up_to
        All modes up to this frequency are kept [Hz].
    pieces
        Supports that make up the structure, `supports.Member` or `supports.Patch`: where effects
        may sit. By default the box around all nodes, read at the closest place.
    members
        Geometric stiffness of each member under a unit tension [1/m], by name: sparse matrices,
        `interpolation.frame_geometric_stiffness`. They serve `effects.axial_preload`.
    youngs_modulus, density
        Young's modulus [Pa] and density [kg/m3] of the whole structure, numbers or laws; by
        default relative ones [1].
    nominal
        Their values in the matrices.

    Raises
    ------
    ValueError
        If more rows are read than a dense flexibility can hold, or the matrices have no mode
        that low.
    """
    rows = interpolation.used_rows()
    if len(rows) > MOST_ROWS:
        raise ValueError(
            f"The interpolation reads {len(rows)} degrees of freedom; at most {MOST_ROWS} can have "
            "a static flexibility between all of them. Read only where transducers may sit: "
            "interpolation.near(position, radius)."
        )
    model = matrices.modes(up_to=up_to)

    def over_modes(parts: Mapping[str, Any]) -> dict[str, Float[np.ndarray, "mode mode"]]:
        return {name: model.shape.T @ (one @ model.shape) for name, one in parts.items()}

    return nodal_modes.modes(
        model,
        interpolation,
        pieces=pieces,
        youngs_modulus=youngs_modulus,
        density=density,
        nominal=nominal,
        flexibility=matrices.static_flexibility(rows),
        regions=over_modes(matrices.regions),
        members=over_modes(members or {}),
        mass=_mass(matrices),
    )


def _mass(matrices: Matrices) -> float:
    """Mass that a rigid translation moves [kg]."""
    direction = int(np.min(matrices.dof[:, 1]))
    field = (matrices.dof[:, 1] == direction).astype(float)
    return float(field @ (matrices.mass @ field))
