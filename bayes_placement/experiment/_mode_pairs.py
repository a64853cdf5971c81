"""Which mode of the model each measured mode is: by shape and frequency, each once."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Inexact, Int

FREQUENCY_TOLERANCE = 0.1
"""Relative difference of natural frequencies that a model may well have."""

SHAPE_TOLERANCE = 0.05
"""Part that a model may well lack of a modal assurance criterion of 1, besides what noise takes."""

SAME = 0.02
"""Relative difference below which two estimates of one branch are the same mode."""


FAR = 1e20
"""Distance of a mode that is another one already."""


class MeasuredShapes(NamedTuple):
    """Natural angular frequencies [rad/s] and shapes, zero where nothing was measured."""

    omega: Float[Array, "mode"]
    shape: Float[Array, "mode channel"]
    deviation: Float[Array, "mode channel"]
    present: Bool[Array, "mode channel"]


def paired(
    measured: MeasuredShapes,
    omega: Float[Array, "mode branch"],
    shapes: Inexact[Array, "mode channel branch"],
) -> Int[Array, "mode"]:
    """Number of the branch of each measured mode, the nearest pair first.

    Natural angular frequencies [rad/s] and shapes of all branches are those seen from the frequency
    of each measured mode.
    """
    shift = jnp.log(omega / measured.omega[:, None])
    criterion, lost = jax.vmap(assurance)(measured, shapes)
    distance = (shift / FREQUENCY_TOLERANCE) ** 2
    distance += (1 - criterion) / (SHAPE_TOLERANCE + lost[:, None])
    count = omega.shape[1]

    def take(state: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], None]:
        distance, chosen = state
        mode, branch = jnp.divmod(jnp.argmin(distance), count)
        same_branch = jnp.abs(jnp.log(omega[:, branch] / omega[mode, branch])) < SAME
        distance = distance.at[:, branch].set(
            distance[:, branch] + jnp.where(same_branch, FAR, 0.0)
        )
        return (distance.at[mode].set(jnp.inf), chosen.at[mode].set(branch)), None

    start = jnp.nan_to_num(distance, nan=FAR, posinf=FAR), jnp.zeros(len(omega), int)
    (_, chosen), _ = jax.lax.scan(take, start, length=len(omega))
    return chosen


def assurance(
    measured: MeasuredShapes, shapes: Inexact[Array, "channel branch"]
) -> tuple[Float[Array, "branch"], Float[Array, ""]]:
    """Modal assurance criterion with each branch, and what noise takes from that of the right one.

    Of n errors of deviation s, n - 1 turn a shape of length L: 1 - MAC is about (n - 1) s^2 / L^2.
    """
    seen = jnp.where(measured.present[:, None], shapes, 0.0)
    product = jnp.abs(measured.shape @ seen) ** 2
    length = jnp.sum(measured.shape**2)
    sizes = length * jnp.sum(jnp.abs(seen) ** 2, axis=0)
    count = jnp.sum(measured.present)
    lost = jnp.sum(measured.deviation**2) * (count - 1) / jnp.maximum(count * length, 1e-300)
    return product / jnp.where(sizes > 0, sizes, 1.0), lost
