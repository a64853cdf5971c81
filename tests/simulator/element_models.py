"""Nodes with degrees of freedom, and reference readings of their interpolation."""

import json
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy import sparse


def nodes(position, directions):
    """Nodes numbered from 11 down, so that neither ids nor their order are indices."""
    count, position = len(position), np.asarray(position, dtype=float)
    ids = 10 * np.arange(count, 0, -1) + 1
    dof = np.array([(node, direction) for node in ids for direction in directions])
    return SimpleNamespace(node=ids, position=position, dof=dof)


def chain(count):
    return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


def handed_over(shared_data, name):
    folder = shared_data / "cases" / "models" / name
    arrays = np.load(folder / "nominal.npz")
    return SimpleNamespace(
        node=arrays["node_ids"],
        position=arrays["nodes"],
        dof=arrays["dofs"],
        shape=arrays["modes"],
        elements=np.searchsorted(arrays["node_ids"], arrays["elements"]),
        mass=sparse.load_npz(folder / "M.npz"),
        region=lambda number: sparse.load_npz(folder / f"K_region_{number:02d}.npz"),
        about=json.loads((folder / "model.json").read_text())["structure"],
    )


@eqx.filter_jit
def _readings(interpolation, position):
    return jax.vmap(interpolation.at)(position)


@eqx.filter_jit
def _closest(interpolation, position):
    return jax.vmap(interpolation.closest)(position)


@eqx.filter_jit
def _slopes(interpolation, position):
    return jax.vmap(jax.jacfwd(lambda place: interpolation.at(place).weight))(position)


def closest(interpolation, position):
    return np.asarray(_closest(interpolation, jnp.asarray(position, dtype=float)))


def weights(interpolation, position, size):
    """Dense weights [place, axis, dof]."""
    reading = _readings(interpolation, jnp.asarray(position, dtype=float))
    return _dense(reading.rows, reading.weight, size)


def slopes(interpolation, position, size):
    """Their dense derivatives in the place [place, axis, coordinate, dof]."""
    place = jnp.asarray(position, dtype=float)
    weight = jnp.moveaxis(_slopes(interpolation, place), -1, 2)
    return _dense(_readings(interpolation, place).rows, weight, size)


def _dense(rows, weight, size):
    dense = np.zeros((*weight.shape[:-1], size))
    for matrix, row, values in zip(dense, np.asarray(rows), np.asarray(weight), strict=True):
        np.add.at(matrix, (..., row), values)
    return dense
