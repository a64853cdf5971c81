"""Chains of the no-U-turn sampler."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from arviz_stats.base import array_stats
from jaxtyping import Array, Float
from numpyro.infer import NUTS as Kernel
from numpyro.infer.hmc import HMCState as State

from ..._shared.arguments import check_count, check_fields, check_positive
from ..._shared.compiled import compiled
from ..._shared.dimensions import Key
from ..._shared.progress import Progress
from .engine import Engine, EngineDraws, Flat, Positions, PosteriorDensity, Scalar

Start = Float[Array, "chain unknown"]
PerDraw = Float[Array, "chain draw"]
Samples = dict[str, Array]

R_HAT_OF_CHAINS = 1.01
"""Greatest R-hat of chains that have mixed (Vehtari et al., doi:10.1214/20-BA1221)."""

SEPARATE = 3.0
"""R-hat of chains at rest above which they sit in modes between which they do not hop."""

FIRST_LOOK = 3
"""Blocks after which chains are looked at for the first time."""

BLOCK = 100
"""Steps between two reports of the progress, at most."""


class NUTS(Engine):
    """No-U-turn sampler of NumPyro, its chains started from the prior.

    It does not hop between separate modes: chains that start in different ones show as an R-hat
    above one, and are stopped where they sit far apart and at rest in two blocks of steps in
    succession, since more steps would not mix them. SMC finds the modes' weights.

    Parameters
    ----------
    chains, warmup, draws
        Number of chains, of adaptation steps and of draws kept in each.
    target_accept
        Acceptance that the step size is adapted to.

    Examples
    --------
    >>> bp.engines.NUTS(chains=4, warmup=500, draws=500).settings()
    {'engine': 'NUTS', 'chains': 4, 'warmup': 500, 'draws': 500, 'target_accept': 0.9}
    """

    chains: int = eqx.field(static=True, default=4)
    warmup: int = eqx.field(static=True, default=1000)
    draws: int = eqx.field(static=True, default=1000)
    target_accept: float = eqx.field(static=True, default=0.9)

    def __check_init__(self) -> None:
        """Refuse numbers of chains or draws that sample nothing."""
        check_fields(self)
        check_positive(
            "target_accept", self.target_accept, "engines.NUTS(target_accept=0.9)", 0.999
        )
        check_count("chains", self.chains, 1, "engines.NUTS(chains=4)")
        check_count("warmup", self.warmup, 1, "engines.NUTS(warmup=1000)")
        check_count("draws", self.draws, 1, "engines.NUTS(draws=1000)")

    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Run all chains together, block by block."""
        start_key, chain_key = jax.random.split(key)
        start = posterior.sample_prior(start_key, self.chains)
        keys = jax.random.split(chain_key, self.chains)
        blocks, length = self._sample(posterior, keys, start, progress)
        stopped = len(blocks) * length < self.warmup + self.draws
        # Of chains that were stopped, the last block is at rest.
        span = slice(-length, None) if stopped else slice(self.warmup, self.warmup + self.draws)
        samples = {
            name: jnp.asarray(
                np.concatenate([block[name] for block in blocks])[span].swapaxes(0, 1)
            )
            for name in blocks[0]
        }
        # The chains know the density already: the likelihood is what the prior leaves of it.
        prior = compiled(_log_priors).bound(posterior, effort=0)(samples["position"])
        likelihood = samples["lp"] - prior
        return self._draws(samples, likelihood, len(blocks) * length if stopped else None)

    def _sample(
        self, posterior: PosteriorDensity, keys: Key, start: Start, progress: Progress
    ) -> tuple[list[dict[str, np.ndarray]], int]:
        """Statistics and positions [step, chain, ...] of each block, and its number of steps."""
        total = self.warmup + self.draws
        # Blocks of one length, so that only one is compiled; what is too much is cut off.
        count = -(-total // BLOCK)
        length = -(-total // count)
        state = compiled(NUTS.begun).bound(self, posterior, keys, start, effort=0)()  # runs once
        block = compiled(NUTS.continued).bound(self, posterior, length, effort=1)
        blocks: list[dict[str, np.ndarray]] = []
        for number in range(1, count + 1):
            state, statistics = block(keys, start, state)
            blocks.append(jax.tree.map(np.asarray, statistics))
            progress(number / count)
            if number >= FIRST_LOOK and all(map(_are_apart, blocks[-2:])):
                break
        return blocks, length

    def begun(self, posterior: PosteriorDensity, keys: Key, start: Start) -> State:
        """State of all chains before the first step."""
        return self._kernel(posterior, keys, start)[1]

    def continued(
        self, posterior: PosteriorDensity, length: int, keys: Key, start: Start, state: State
    ) -> tuple[State, Samples]:
        """State after a block of steps, and what is kept of each."""
        # Its state at the start is not used here, but a kernel must have been begun.
        kernel, _ = self._kernel(posterior, keys, start)

        def step(state: State, _: None) -> tuple[State, Samples]:
            state = kernel.sample(state, (), {})
            statistics = {
                "position": state.z,
                "diverging": state.diverging,
                "acceptance_rate": state.accept_prob,
                "n_steps": state.num_steps,
                "lp": -state.potential_energy,
                "energy": state.energy,
            }
            return state, statistics

        return jax.lax.scan(step, state, None, length=length)

    def _kernel(self, posterior: PosteriorDensity, keys: Key, start: Start) -> tuple[Kernel, State]:
        # Compiled on its own it is traced once, although the sampler calls it at many places.
        kernel = Kernel(
            potential_fn=compiled(_potential).bound(posterior),
            dense_mass=True,
            target_accept_prob=self.target_accept,
        )
        return kernel, kernel.init(keys, self.warmup, start, (), {})

    def _draws(self, samples: Samples, likelihood: PerDraw, stopped: int | None) -> EngineDraws:
        """Lay out the draws; `stopped` is the number of steps of chains that were stopped."""
        position = samples.pop("position")
        r_hat = float(np.max(array_stats.rhat(np.moveaxis(np.asarray(position), 2, 0))))
        divergences = int(np.sum(samples["diverging"]))
        return EngineDraws(
            position=position,
            log_likelihood=likelihood,
            stats=samples,
            attributes={"divergences": divergences},
            warnings=(
                _warnings(r_hat, divergences, position.shape[0] * position.shape[1])
                if stopped is None
                else (_words_on_stop(r_hat, stopped, self.warmup + self.draws),)
            ),
        )


def _potential(posterior: PosteriorDensity, flat: Flat) -> Scalar:
    """Minus the log posterior density."""
    return -(posterior.log_prior(flat) + posterior.log_likelihood(flat))


def _log_priors(posterior: PosteriorDensity, position: Positions) -> PerDraw:
    """Log prior densities [chain, draw] of draws [chain, draw, unknown]."""
    return jax.vmap(jax.vmap(posterior.log_prior))(position)


def _are_apart(block: dict[str, np.ndarray]) -> bool:
    """Whether chains sit far from each other, and none of them is still on its way."""
    log_density, position = block["lp"], block["position"]
    if position.shape[1] < 2:
        return False
    with np.errstate(over="ignore", invalid="ignore"):  # far from the mode it may be -1e200
        halves = np.array_split(log_density, 2)
        drift = np.abs(halves[1].mean(axis=0) - halves[0].mean(axis=0))
        deviation = log_density.std(axis=0)
    if not np.all(np.isfinite(deviation)) or np.any(drift > deviation):
        return False
    within = position.var(axis=0, ddof=1).mean(axis=0)
    between = position.mean(axis=0).var(axis=0, ddof=1)
    return bool(np.any(between > (SEPARATE**2 - 1) * within))


def _words_on_stop(r_hat: float, steps: int, total: int) -> str:
    return (
        f"The chains were stopped after {steps} of {total} steps: they sit in separate modes "
        f"(R-hat = {r_hat:.3g}), between which NUTS does not hop, so more steps would not mix "
        "them; use engines.SMC()."
    )


def _warnings(r_hat: float, divergences: int, draws: int) -> tuple[str, ...]:
    warnings = []
    if r_hat > R_HAT_OF_CHAINS:
        warnings.append(
            f"The chains have not mixed: R-hat = {r_hat:.3f} is above {R_HAT_OF_CHAINS}; the "
            "posterior may have separate modes, which NUTS does not hop between, so use "
            "engines.SMC(), or run longer chains."
        )
    if divergences > 0.01 * draws:
        warnings.append(
            f"{divergences} of {draws} NUTS transitions diverged, so a narrow region may be "
            "missing; raise target_accept, or use engines.SMC()."
        )
    return tuple(warnings)
