"""_repeated: in, stiffness between modes of one frequency; out, its part in the receptance.

Not known here: where that stiffness comes from, sensors. Its value is zero; its derivative is what
eigenvectors of a repeated frequency cannot carry.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

Left = Inexact[Array, "to mode frequency"]
Right = Inexact[Array, "from mode frequency"]
Matrix = Complex[Array, "to from frequency"]


@jax.custom_jvp
def carried(coupling: Float[Array, "mode mode"], to: Left, come_from: Right) -> Matrix:
    """First-order change of a receptance, - to C come_from, by a coupling C [(rad/s)^2] of zero.

    Parameters
    ----------
    coupling
        Zero, with a derivative.
    to, come_from
        Modal receptances times the shapes at points.
    """
    return jnp.zeros((to.shape[0], come_from.shape[0], to.shape[-1]), complex)


@carried.defjvp
def _carried_jvp(primals: Any, tangents: Any) -> tuple[Any, Any]:
    _, to, come_from = primals
    change = -jnp.einsum("pnf,nm,qmf->pqf", to, tangents[0], come_from)
    return carried(*primals), change
