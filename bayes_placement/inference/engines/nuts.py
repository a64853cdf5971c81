"""Chains of the no-U-turn sampler."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from arviz_stats.base import array_stats
from numpyro.infer import NUTS as Kernel

from ..._compiled import compiled
from ..._types import Key, Progress, check_count
from .engine import Engine, EngineDraws, PosteriorDensity

GOOD_R_HAT = 1.01
BLOCK = 100
"""Steps between two reports of the progress, at most."""


class NUTS(Engine):
    """No-U-turn sampler of NumPyro, its chains started from the prior.

    It does not hop between separate modes: chains that start in different ones show as an R-hat
    above one. SMC finds the modes' weights.

    Parameters
    ----------
    chains, warmup, draws
        Number of chains, of adaptation steps and of draws kept in each.
    target_accept
        Acceptance that the step size is adapted to.
    """

    chains: int = eqx.field(static=True, default=4)
    warmup: int = eqx.field(static=True, default=1000)
    draws: int = eqx.field(static=True, default=1000)
    target_accept: float = eqx.field(static=True, default=0.9)

    def __check_init__(self) -> None:
        """Refuse numbers of chains or draws that sample nothing."""
        check_count("chains", self.chains, 1, "engines.NUTS(chains=4)")
        check_count("warmup", self.warmup, 1, "engines.NUTS(warmup=1000)")
        check_count("draws", self.draws, 1, "engines.NUTS(draws=1000)")

    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Run all chains together, block by block."""
        start_key, chain_key = jax.random.split(key)
        start = posterior.sample_prior(start_key, self.chains)
        keys = jax.random.split(chain_key, self.chains)
        kept = self._sample(posterior, keys, start, progress)
        likelihood = compiled(_log_likelihoods)(posterior, kept["position"])
        return self._draws(kept, likelihood)

    def _sample(
        self, posterior: PosteriorDensity, keys: Any, start: Any, progress: Progress
    ) -> dict[str, Any]:
        """Statistics and positions of the draws [chain, draw, ...], by name."""
        total = self.warmup + self.draws
        # Blocks of one length, so that only one is compiled; what is too much is cut off.
        count = -(-total // BLOCK)
        length = -(-total // count)
        state = compiled(NUTS.begun)(self, posterior, keys, start)
        block = compiled(NUTS.continued).bound(self, posterior, length)
        blocks = []
        for number in range(1, count + 1):
            state, kept = block(keys, start, state)
            blocks.append(jax.tree.map(np.asarray, kept))
            progress(number / count)
        return {
            name: jnp.asarray(
                np.concatenate([kept[name] for kept in blocks])[self.warmup : total].swapaxes(0, 1)
            )
            for name in blocks[0]
        }

    def begun(self, posterior: PosteriorDensity, keys: Any, start: Any) -> Any:
        """State of all chains before the first step."""
        return self._kernel(posterior, keys, start)[1]

    def continued(
        self, posterior: PosteriorDensity, length: int, keys: Any, start: Any, state: Any
    ) -> tuple[Any, dict[str, Any]]:
        """State after a block of steps, and what is kept of each."""
        # Its state at the start is not used here, but a kernel must have been begun.
        kernel, _ = self._kernel(posterior, keys, start)

        def step(state: Any, _: None) -> tuple[Any, dict[str, Any]]:
            state = kernel.sample(state, (), {})
            kept = {
                "position": state.z,
                "diverging": state.diverging,
                "acceptance_rate": state.accept_prob,
                "n_steps": state.num_steps,
                "lp": -state.potential_energy,
            }
            return state, kept

        return jax.lax.scan(step, state, None, length=length)

    def _kernel(self, posterior: PosteriorDensity, keys: Any, start: Any) -> tuple[Kernel, Any]:
        def potential(flat: Any) -> Any:
            return -(posterior.log_prior(flat) + posterior.log_likelihood(flat))

        kernel = Kernel(
            potential_fn=potential, dense_mass=True, target_accept_prob=self.target_accept
        )
        return kernel, kernel.init(keys, self.warmup, start, (), {})

    def _draws(self, kept: dict[str, Any], likelihood: Any) -> EngineDraws:
        position = kept.pop("position")
        r_hat = float(np.max(array_stats.rhat(np.moveaxis(np.asarray(position), 2, 0))))
        divergences = int(np.sum(kept["diverging"]))
        return EngineDraws(
            position=position,
            log_likelihood=likelihood,
            stats=kept,
            attributes={"divergences": divergences},
            warnings=_warnings(r_hat, divergences, position.shape[0] * position.shape[1]),
        )

    def settings(self) -> dict[str, Any]:
        """Name and sizes."""
        sizes = {"chains": self.chains, "warmup": self.warmup, "draws": self.draws}
        return {"engine": "NUTS", **sizes, "target_accept": self.target_accept}


def _log_likelihoods(posterior: PosteriorDensity, position: Any) -> Any:
    """Log likelihoods [chain, draw] of draws [chain, draw, unknown]."""
    return jax.vmap(jax.vmap(posterior.log_likelihood))(position)


def _warnings(r_hat: float, divergences: int, draws: int) -> tuple[str, ...]:
    warnings = []
    if r_hat > GOOD_R_HAT:
        warnings.append(
            f"The chains have not mixed: R-hat = {r_hat:.3f} is above {GOOD_R_HAT}; the posterior "
            "may have separate modes, which NUTS does not hop between, so use engines.SMC(), or "
            "run longer chains."
        )
    if divergences > 0.01 * draws:
        warnings.append(
            f"{divergences} of {draws} NUTS transitions diverged, so a narrow region may be "
            "missing; raise target_accept, or use engines.SMC()."
        )
    return tuple(warnings)
