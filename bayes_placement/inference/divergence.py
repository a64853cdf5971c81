"""Kullback-Leibler divergence of a posterior from its prior, with its standard error."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree
from scipy.special import gammaln, logsumexp, psi

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from .estimates import Weighting, standard_error


@with_short_repr
class Divergence(NamedTuple):
    """Kullback-Leibler divergence [nat] and its standard error.

    Examples
    --------
    >>> gain = bp.information.from_evidence(12.0, 0.1, 9.5, 0.2)
    >>> gain.kl, round(gain.error, 3)  # nat
    (2.5, 0.224)
    """

    kl: float
    error: float


@arguments_checked
def from_prior_draws(
    log_likelihood: Float[np.ndarray, "draw"],
    log_prior_weight: Float[np.ndarray, "draw"] | None = None,
) -> Divergence:
    """Divergence from likelihoods at draws from the prior or at quadrature nodes, Eq. (33).

    Parameters
    ----------
    log_likelihood
        Log likelihood [draw] at draws from the prior, or at nodes of a quadrature over it.
    log_prior_weight
        Logs of the weights of the nodes, whose sum is 1; None for draws.

    Returns
    -------
    Divergence
        E{l log l} / E{l} - log E{l}, with the standard error of independent draws.

    Examples
    --------
    >>> nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    >>> log_weight = np.log(weights / weights.sum())
    >>> gain = bp.information.from_prior_draws(-0.5 * nodes**2, log_weight)  # variance 1 to 1 / 2
    >>> round(gain.kl, 4)  # (log 2 - 1 / 2) / 2
    0.0966
    """
    size = log_likelihood.size
    if log_prior_weight is not None and log_prior_weight.shape != log_likelihood.shape:
        raise InputError(
            f"log_prior_weight has the shape {log_prior_weight.shape} and log_likelihood "
            f"{log_likelihood.shape}; one weight for each node is needed, since they are "
            "multiplied. Leave it out for draws from the prior."
        )
    weight = np.full(size, -np.log(size)) if log_prior_weight is None else log_prior_weight
    evidence = logsumexp(log_likelihood + weight)
    relative = np.exp(log_likelihood - evidence)
    finite = np.where(relative > 0, log_likelihood, 0.0)  # l log l vanishes with l
    mean = float(np.sum(np.exp(weight) * relative * finite))
    influence = relative * (finite - mean) - (relative - 1)
    return Divergence(mean - float(evidence), float(np.std(influence) / np.sqrt(size)))


@arguments_checked
def from_evidence(
    log_likelihood: float, log_likelihood_error: float, evidence: float, evidence_error: float
) -> Divergence:
    """Divergence from the posterior mean of the log likelihood and the log evidence.

    Parameters
    ----------
    log_likelihood, log_likelihood_error
        Posterior mean of the log likelihood and its standard error.
    evidence, evidence_error
        Log evidence and its standard error.

    Returns
    -------
    Divergence
        The first less the second, with its standard error.

    Examples
    --------
    >>> bp.information.from_evidence(12.0, 0.1, 9.5, 0.2).kl
    2.5
    """
    error = float(np.hypot(log_likelihood_error, evidence_error))
    return Divergence(log_likelihood - evidence, error)


@arguments_checked
def from_posterior_draws(
    vectors: Float[np.ndarray, "*chain draw unknown"],
    log_prior: Float[np.ndarray, "*chain draw"],
    *,
    neighbours: int = 4,
) -> Divergence:
    """Divergence from draws of the posterior, by a nearest-neighbour density estimate.

    Parameters
    ----------
    vectors
        Draws [chain, draw, unknown] in an unbounded space, where no edge truncates a neighbourhood.
    log_prior
        Log prior density at the draws [chain, draw], in the same space.
    neighbours
        Number of the neighbour from whose distance the density is estimated (Kozachenko and
        Leonenko; Kraskov et al., doi:10.1103/PhysRevE.69.066138).

    Returns
    -------
    Divergence
        Minus the entropy of the draws, less the mean log prior. Its error consists of the standard
        error of the mean and of the bias, estimated from the change with twice as many neighbours.
        NaN where there are not more draws than unknowns: these span no volume.

    Examples
    --------
    >>> draws = np.random.default_rng(0).normal(0.0, 0.5, (2000, 1))
    >>> log_prior = -0.5 * (draws[:, 0] ** 2 + np.log(2 * np.pi))  # standard normal
    >>> round(bp.information.from_posterior_draws(draws, log_prior).kl, 1)  # log 2 - 3 / 8
    0.3
    """
    if vectors.shape[:-1] != log_prior.shape or not 1 <= neighbours < log_prior.size:
        raise InputError(
            f"vectors of shape {vectors.shape}, log_prior of shape {log_prior.shape} and "
            f"neighbours={neighbours} were given; a vector for each log prior and fewer neighbours "
            "than draws are needed, since the density at a draw follows from those near it: "
            "neighbours=4."
        )
    flat = vectors.reshape(-1, vectors.shape[-1])
    unique, first, inverse = np.unique(flat, axis=0, return_index=True, return_inverse=True)
    if len(unique) <= max(vectors.shape[-1], 2 * neighbours):
        return Divergence(float("nan"), float("nan"))
    prior = log_prior.reshape(-1)[first]
    log_ratio = _log_density(unique, neighbours) - prior
    coarse = _log_density(unique, 2 * neighbours) - prior
    # The bias grows with the squared radius of the neighbourhood.
    growth = 2 ** (2 / vectors.shape[-1]) - 1
    bias = (np.mean(log_ratio) - np.mean(coarse)) / growth
    influence = (log_ratio - np.mean(log_ratio))[inverse.ravel()].reshape(log_prior.shape)
    spread = standard_error(np.atleast_2d(influence), Weighting())
    return Divergence(float(np.mean(log_ratio)), float(np.hypot(spread, bias)))


def _log_density(vectors: np.ndarray, neighbours: int) -> np.ndarray:
    """Log density at each draw, from the distance to its neighbour of this number."""
    size, dimension = vectors.shape
    variances, axes = np.linalg.eigh(np.atleast_2d(np.cov(vectors.T)))
    whitened = (vectors - vectors.mean(0)) @ (axes / np.sqrt(variances))
    distance = cKDTree(whitened).query(whitened, k=neighbours + 1)[0][:, -1]
    log_unit_ball = dimension / 2 * np.log(np.pi) - gammaln(dimension / 2 + 1)
    log_volume = log_unit_ball + dimension * np.log(distance) + 0.5 * np.sum(np.log(variances))
    return psi(neighbours) - psi(size) - log_volume
