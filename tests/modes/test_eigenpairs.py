"""Derivatives of eigenpairs, also repeated ones, compared with differences and direct solutions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement.modes.changed import eigenpairs, with_coupling

SIZE, STEP = 7, 1e-6
APART = np.array([1.0, 2.0, 3.5, 5.0, 8.0, 13.0, 21.0])
REPEATED = np.array([1.0, 2.0, 2.0, 5.0, 5.0, 5.0, 21.0])
RIGID = np.array([0.0, 0.0, 0.0, 5.0, 5.0, 13.0, 21.0])
OMEGA = np.array([0.7, 1.3, 2.1, 4.9]) * (1 + 0.05j)  # squared, with some loss
SPECTRA = pytest.mark.parametrize("values", [APART, REPEATED, RIGID], ids=["apart", "pairs", "0"])


def symmetric(seed):
    matrix = np.random.default_rng(seed).normal(size=(SIZE, SIZE))
    return (matrix + matrix.T) / 2


def matrix(values, seed=1):
    turn = np.linalg.qr(symmetric(seed))[0]
    return turn * values @ turn.T


START, CHANGE = np.array([0.3, -0.2]), np.stack([symmetric(5), symmetric(6)])
TINY = 1e-4 * np.eye(2)
HERE, READ = np.zeros(2), np.random.default_rng(7).normal(size=(3, SIZE))


def changed(values, step):
    """The matrix of given eigenvalues where the step is 0."""
    return matrix(values) + jnp.tensordot(step, CHANGE, 1)


def resolvent(values, step, share=1.0):
    """P (A - omega^2)^-1 P^T by eigenpairs, with a share of what repeated ones leave out."""
    pairs = eigenpairs(changed(values, step))
    modal = 1 / (pairs.values[:, None] - OMEGA)
    read = READ @ pairs.vectors
    receptance = jnp.einsum("pm,mf,qm->pqf", read, modal, read)
    sides = read[:, :, None] * modal
    return with_coupling(receptance, share * pairs.coupling, sides, sides)


def norm(values, step):
    return jnp.sum(jnp.abs(resolvent(values, step)) ** 2)


solved = jax.jit(eigenpairs)
squares = jax.jit(lambda step: eigenpairs(changed(APART, step)).vectors ** 2)
slopes = jax.jit(jax.jacfwd(resolvent, argnums=1))


def direct(values, step):
    dense = np.asarray(changed(values, step))
    solutions = [READ @ np.linalg.solve(dense - shift * np.eye(SIZE), READ.T) for shift in OMEGA]
    return np.stack(solutions, axis=-1)


@SPECTRA
def test_pairs_are_those_of_the_matrix(values):
    pairs = solved(matrix(values))
    np.testing.assert_allclose(pairs.values, values, atol=1e-12)
    again = pairs.vectors * pairs.values @ pairs.vectors.T
    np.testing.assert_allclose(again, matrix(values), atol=1e-12)
    assert (np.asarray(pairs.coupling) == 0).all()


def test_a_diagonal_matrix_is_returned_bit_for_bit():
    pairs = solved(np.diag(REPEATED))
    np.testing.assert_array_equal(pairs.values, REPEATED)
    np.testing.assert_array_equal(np.abs(pairs.vectors), np.eye(SIZE))


@SPECTRA
def test_what_is_made_of_all_pairs_has_the_derivatives_of_a_direct_solution(values):
    derivatives = slopes(values, HERE)
    for number, step in enumerate(STEP * np.eye(2)):
        expected = (direct(values, step) - direct(values, -step)) / (2 * STEP)
        size = np.abs(expected).max()
        np.testing.assert_allclose(derivatives[..., number] / size, expected / size, atol=1e-8)


def test_reverse_mode_agrees_with_forward_mode():
    gradients = jax.jit(
        lambda *at: (jax.grad(norm, argnums=1)(*at), jax.jacfwd(norm, argnums=1)(*at))
    )
    for values in (APART, REPEATED, RIGID):
        back, ahead = gradients(values, HERE)
        np.testing.assert_allclose(back, ahead, rtol=1e-11)
        assert np.isfinite(back).all() and (np.abs(back) > 1e-3).all()


def test_without_the_coupling_a_pair_would_lose_part_of_its_derivative():
    part = jax.jit(jax.jacfwd(lambda step: resolvent(REPEATED, step, 0.0)))(HERE)
    total = slopes(REPEATED, HERE)
    assert np.abs(total - part).max() > 0.01 * np.abs(total).max()


@pytest.mark.parametrize("gap", [1e-4, 1e-5, 1e-7, 1e-9])
def test_nearly_repeated_values_pass_over_into_repeated_ones(gap):
    values = REPEATED.copy()
    values[2] += gap
    derivatives, expected = slopes(values, HERE), slopes(REPEATED, HERE)
    assert np.abs(derivatives - expected).max() < max(30 * gap, 1e-8) * np.abs(expected).max()


def test_vectors_apart_have_the_derivative_of_finite_differences():
    derivatives = jax.jit(jax.jacfwd(squares))(START)
    for number, step in enumerate(STEP * np.eye(2)):
        expected = (squares(START + step) - squares(START - step)) / (2 * STEP)
        np.testing.assert_allclose(derivatives[..., number], expected, atol=1e-8)


def test_second_derivatives_are_exact_where_no_value_is_repeated():
    hessian = jax.jit(jax.hessian(norm, argnums=1))(APART, HERE)

    def gradient(step):
        """Of the direct solution."""
        sides = [np.sum(np.abs(direct(APART, step + offset)) ** 2) for offset in (*TINY, *-TINY)]
        return (np.array(sides[:2]) - sides[2:]) / (2 * TINY[0, 0])

    expected = [(gradient(offset) - gradient(-offset)) / (2 * TINY[0, 0]) for offset in TINY]
    np.testing.assert_allclose(hessian, expected, rtol=1e-4)


def test_many_at_once_are_the_same_one_by_one():
    steps = np.random.default_rng(8).normal(size=(3, 2))
    batch = jax.jit(jax.vmap(slopes, in_axes=(None, 0)))(REPEATED, steps)
    np.testing.assert_allclose(batch[1], slopes(REPEATED, steps[1]), rtol=1e-9, atol=1e-9)
