"""_knowledge: in, an experiment and what was measured; out, points of what is known before.

That is the prior of the parameters, or what an earlier measurement left of it. Not known here: how
information is estimated, where else a transducer could sit.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr

from ..._sites import Role
from ..._types import InfeasibleError, InputError
from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import JointDraws
from . import _points


class Prior(NamedTuple):
    """Laws of independent unknowns, by name."""

    laws: dict[str, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is to be learnt."""
        return tuple(self.laws)

    @property
    def dimension(self) -> int:
        """Scores of a point."""
        return _points.dimension(self.laws)

    def values(self, scores: Any) -> dict[str, Any]:
        """Values by name at scores [..., score]."""
        return _points.values(self.laws, scores)


class Posterior(NamedTuple):
    """Draws of unknowns that depend on each other."""

    draws: JointDraws

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is to be learnt."""
        return tuple(self.draws)

    @property
    def dimension(self) -> int:
        """One: the score of a draw is its number."""
        return 1

    def values(self, scores: Any) -> dict[str, Any]:
        """Values by name at scores [..., 1]."""
        count = len(next(iter(self.draws.values())))
        number = jnp.floor(ndtr(jnp.asarray(scores)[..., 0]) * count).astype(int)
        chosen = jnp.clip(number, 0, count - 1)
        return {name: jnp.asarray(values)[chosen] for name, values in self.draws.items()}

    def halves(self) -> tuple["Posterior", "Posterior"]:
        """Every other draw, and the rest."""
        first, second = ({n: v[k::2] for n, v in self.draws.items()} for k in (0, 1))
        return Posterior(first), Posterior(second)


Knowledge: TypeAlias = Prior | Posterior


def knowledge(experiment: Experiment, after: JointDraws | None, moved: Sequence[str]) -> Knowledge:
    """What is known of the parameters and, after a measurement, of places that stay.

    A transducer that stays mounted sits where it sat: its place is known as well as the
    measurement tells, together with the parameters, and more of it is learnt like of them.

    Raises
    ------
    ValueError
        If nothing but placement is unknown, or the draws lack a parameter.
    """
    laws = {
        unknown.name: unknown.distribution
        for unknown in experiment.unknowns
        if unknown.role is Role.PARAMETER
    }
    if not laws:
        raise InputError(
            "A map of information was asked for, but the structure has no unknown parameter; at "
            "least one is needed, since the information is about it. Declare one: "
            "damping.Modal([dist.Uniform(0.02, 0.06)])."
        )
    if after is None:
        return Prior(laws)
    missing = [name for name in laws if name not in after]
    if missing:
        raise InfeasibleError(
            f"Draws of {', '.join(after)} were given, but the experiment has the unknown "
            f"{missing[0]} as well. Give the posterior of the same structure: "
            "after=bp.infer(experiment, measured)."
        )
    stays = [
        unknown.name
        for unknown in experiment.unknowns
        if unknown.is_placement and unknown.name in after and unknown.owner.name not in moved
    ]
    return Posterior({name: after[name] for name in [*laws, *stays]})


def typical(after: JointDraws | None) -> dict[str, np.ndarray]:
    """Mean of each unknown after a measurement; nothing without one."""
    return {name: np.asarray(np.mean(values, axis=0)) for name, values in (after or {}).items()}
