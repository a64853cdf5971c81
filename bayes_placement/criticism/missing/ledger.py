"""ledger: in, the steps of an improvement; out, a record of the falling error in words and JSON.

Not known here: how steps were found, figures.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from ..._files import write_atomically
from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import Alternative
from ._estimates import Estimate
from ._odds import NONE, NOTHING

DOUBTED = 0.5
"""Probability of none of the candidates above which the stated noise is in doubt."""


@dataclass(frozen=True)
class Step:
    """One model on the way, fitted.

    Parameters
    ----------
    added
        Name of the effect that was added; None for the model as it was given.
    effects
        Names of all its effects.
    parameters
        Every unknown with its uncertainty.
    chi2_per_datum
        Mean of |measured - predicted|^2 over E|error|^2; a right model gives 1.
    p_value
        Probability that a right model leaves as much.
    log_evidence
        Log of the evidence, by Laplace's method or confirmed by sampling.
    log_evidence_error
        Its standard error where sampling confirmed it, else None.
    held_out
        Mean log density of held-out data [nats a real datum].
    setting
        Which sensor or part of the structure the added effect is about, in words.
    """

    added: str | None
    effects: tuple[str, ...]
    parameters: dict[str, Estimate]
    chi2_per_datum: float
    p_value: float
    log_evidence: float
    log_evidence_error: float | None
    held_out: float
    setting: str = ""

    def found(self) -> str:
        """Say what was added: which sensor or part it is about, and its parameters."""
        if self.added is None:
            return ""
        own = [f"{one.word} {one}" for one in self.own_parameters().values()]
        return ", ".join([*([self.setting] if self.setting else []), *own])

    def own_parameters(self) -> dict[str, Estimate]:
        """Unknowns of the effect that was added; of the model, where none was."""
        if self.added is None:
            return self.parameters
        return {name: one for name, one in self.parameters.items() if one.effect == self.added}


@dataclass(frozen=True)
class Ledger:
    """Record of what was added to a model, and how its error fell.

    Parameters
    ----------
    steps
        The model as it was given, then with one more effect each time.
    verdict
        Kinds of the effects that are missing.
    probabilities
        Posterior probability of each kind, of `nothing_missing` and of `none_of_these`.
    confounded
        Pairs of kinds that these data cannot tell apart.
    unexplained
        Whether the last model still fails its check.
    seconds
        Time taken [s].
    experiment
        The experiment with the effects that were found.
    compared
        Every hypothesis that was fitted: kinds, chi2 per datum, log evidence, log odds.
    suspicion
        Suspicion map of the model as given; see `explain`.
    alternatives
        Explanations that survive; see `explain`.
    """

    steps: tuple[Step, ...]
    verdict: tuple[str, ...]
    probabilities: dict[str, float]
    confounded: tuple[tuple[str, str], ...]
    unexplained: bool
    seconds: float
    experiment: Experiment = field(repr=False)
    compared: pd.DataFrame = field(repr=False)
    suspicion: pd.DataFrame = field(repr=False)
    alternatives: tuple[Alternative, ...] = field(repr=False)

    def to_json(self) -> dict[str, Any]:
        """Return the ledger as numbers and words for a file."""
        return {
            "steps": [_step(one) for one in self.steps],
            "verdict": list(self.verdict),
            "probabilities": self.probabilities,
            "confounded": [list(pair) for pair in self.confounded],
            "unexplained": self.unexplained,
            "wall_seconds": self.seconds,
        }

    def write(self, path: str | Path) -> None:
        """Write the ledger as JSON, whole or not at all."""
        text = json.dumps(self.to_json(), indent=1, allow_nan=False)
        write_atomically(Path(path), lambda temporary: temporary.write_text(f"{text}\n"))

    def table(self) -> pd.DataFrame:
        """One row a step."""
        rows = [
            {
                "added": one.added or "as given",
                "chi2 per datum": f"{one.chi2_per_datum:.4g}",
                "p": f"{one.p_value:.2g}",
                "log evidence": f"{one.log_evidence:.1f}",
                "held out": f"{one.held_out:.3f}",
                "parameters": one.found(),
            }
            for one in self.steps
        ]
        return pd.DataFrame(rows).set_index("added")

    def sentence(self) -> str:
        """Say the verdict in one sentence."""
        last = self.steps[-1].chi2_per_datum
        if not self.verdict:
            if self.unexplained:
                return (
                    f"The model fails (chi2 per datum {last:.3g} where 1 is right), and no known "
                    "effect explains it."
                )
            passed = f"(chi2 per datum {last:.3g}, p = {self.steps[-1].p_value:.2g})"
            return (
                f"Nothing is claimed to be missing: the model as given passes its check {passed}."
            )
        named = " and ".join(
            f"{kind} ({self._about(kind)}{self._likely(kind)})" for kind in self.verdict
        )
        first = self.steps[0].chi2_per_datum
        rest = " Something else is missing still." if self.unexplained else ""
        return f"Missing: {named}; chi2 per datum falls from {first:.3g} to {last:.3g}.{rest}"

    def _about(self, kind: str) -> str:
        """Say which sensor or part of the structure an effect is about."""
        settings = (one.setting for one in self.steps if one.added == kind and one.setting)
        return "".join(f"{words}, " for words in settings)

    def _likely(self, kind: str) -> str:
        """Say how probable an effect is; where the noise is doubted, that it is the best known."""
        if self.probabilities[NONE] > DOUBTED:
            return "the best of the candidates"
        return f"probability {self.probabilities[kind]:.3g}"

    def words(self) -> list[str]:
        """Say the verdict, what cannot be told apart, and what remains."""
        said = [self.sentence()]
        likely = max(self.probabilities, key=lambda kind: self.probabilities[kind])
        if not self.verdict and not self.unexplained and likely not in (NOTHING, NONE):
            said.append(
                f"The evidence leans to {likely} (probability {self.probabilities[likely]:.2g}), "
                "but nothing is claimed while the model as given passes its check. More averages "
                "or lines would tell."
            )
        for one, other in self.confounded:
            said.append(
                f"These data cannot tell {one} from {other}: either explains them down to the "
                "noise."
            )
        if self.probabilities[NONE] > DOUBTED:
            said.append(
                "None of the candidates explains the data down to the stated noise (probability "
                f"{self.probabilities[NONE]:.2g}): add an effect of your own, or doubt the noise."
            )
        return said

    def __str__(self) -> str:
        """Lay out the steps and the words."""
        lines = self.table().to_string()
        return "\n".join([lines, "", *(f"- {line}" for line in self.words())])


def _step(step: Step) -> dict[str, Any]:
    chosen = {
        name: {
            "mean": one.mean,
            "standard_deviation": one.standard_deviation,
            "interval_99": [one.low, one.high],
            "unit": one.unit,
        }
        for name, one in step.parameters.items()
    }
    return {
        "added": step.added,
        "setting": step.setting,
        "parameters": chosen,
        "chi2_per_datum": step.chi2_per_datum,
        "p_value": step.p_value,
        "log_evidence": step.log_evidence,
        "held_out": step.held_out,
    }


__all__ = ["NONE", "NOTHING", "Ledger", "Step"]
