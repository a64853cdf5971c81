"""Record of an improvement: the error that falls step by step, in words and JSON."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..._files import write_json
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...experiment.model_error import OF_WHAT
from ...inference.alternative_explanation import Alternative
from ...inference.units import percent
from ...positions.reprs import notebook_html
from ..reach.reach import Reach
from ._claims import SCHEMA
from ._estimates import number_or_none
from ._narrow_text import gained, narrow
from ._posterior_odds import NONE, NOTHING, numbered_kind
from .fitted_model import FittedModel, number_or_blank

DOUBTED = 0.5
"""Probability of none of the candidates above which the stated noise is in doubt."""

TIMES = {2: "twice", 3: "three times"}
"""How often a kind is missing, in words."""


@dataclass(frozen=True, repr=False)
class Ledger:
    """Record of what was added to a model, and how its error fell.

    Parameters
    ----------
    steps
        The model as it was given, then with one more effect each time.
    verdict
        Kinds of the effects that are missing; a kind of which several are is there several times.
    probabilities
        Posterior probability of each kind, of `nothing_missing` and of `none_of_these`. Where two
        of a kind were tried, that of at least two is named `point_mass_2`, and so on.
    confounded
        Pairs of kinds that these data do not distinguish.
    unexplained
        Whether the last model still fails its check.
    seconds
        Time taken [s].
    experiment
        The experiment with the effects that were added.
    compared
        Every hypothesis that was fitted: its effects, chi2 per datum, log evidence, log odds.
    suspicion
        Score test of every candidate on the model as given; see `explain`.
    alternatives
        Hypotheses that the next measurement should distinguish; see `explain`.
    cautions
        What to doubt in the last step: priors piled up at an edge, a fit reached from one start.
    baseline
        The model as given, fitted to the earlier state alone; None where there is only one state.
    record
        Where it comes from: versions, date, seed, hashes of experiment and measurement, units.
    effects
        An entry for each effect that is claimed: what it acts on and where, its law, and what else
        explains the data as well.
    reach
        What laws at each place could remove of the misfit; see `explain`.

    Examples
    --------
    >>> ledger.verdict, len(ledger.steps)
    (('point_mass',), 2)
    >>> ledger.sentence()
    'Missing: point_mass (probability 0.998); chi2 per datum falls from 91.7 to 0.703.'
    """

    steps: tuple[FittedModel, ...]
    verdict: tuple[str, ...]
    probabilities: dict[str, float]
    confounded: tuple[tuple[str, str], ...]
    unexplained: bool
    seconds: float
    experiment: Experiment = field(repr=False)
    compared: pd.DataFrame = field(repr=False)
    suspicion: pd.DataFrame = field(repr=False)
    alternatives: tuple[Alternative, ...] = field(repr=False)
    cautions: tuple[str, ...] = ()
    baseline: FittedModel | None = None
    record: Mapping[str, Any] = field(default_factory=dict, repr=False)
    effects: tuple[Mapping[str, Any], ...] = field(default=(), repr=False)
    reach: Reach | None = field(default=None, repr=False)

    def to_json(self) -> dict[str, Any]:
        """Return the ledger as numbers and words for a file."""
        return {
            "schema": SCHEMA,
            "effects": [dict(effect) for effect in self.effects],
            "reach": None if self.reach is None else self.reach.to_json(),
            "steps": [step.to_json() for step in self.steps],
            "verdict": list(self.verdict),
            "probabilities": {
                kind: number_or_none(share) for kind, share in self.probabilities.items()
            },
            "confounded": [list(pair) for pair in self.confounded],
            "unexplained": self.unexplained,
            "cautions": list(self.cautions),
            "wall_seconds": self.seconds,
            "record": dict(self.record),
        }

    def write(self, path: str | Path) -> None:
        """Write the ledger as JSON. The file changes only once all of it is written."""
        write_json(path, self.to_json())

    def table(self) -> pd.DataFrame:
        """One row a step."""
        exact = all(np.isfinite(step.chi2_when_exact) for step in self.steps)
        rows = [
            {
                "added": step.added or "as given",
                **misfit_columns(step),
                "p": number_or_blank(step.p_value, ".2g"),
                **gained(step, self.steps[0]),
                "held out": number_or_blank(step.held_out, ".3f"),
                **_model_error_columns(step, exact),
                "parameters": step.description(),
            }
            for step in self.steps
        ]
        return pd.DataFrame(rows).set_index("added")

    def sentence(self) -> str:
        """Say the verdict in one sentence."""
        first, last = self.steps[0], self.steps[-1]
        if self.baseline is not None:
            return self._sentence_of_two_states(last)
        if last.model_error:
            return self._sentence_with_model_error(first, last)
        if self.verdict:
            remark = " Something else is still missing." if self.unexplained else ""
            return f"{self._claims()}; {_fall(first, last)}.{remark}"
        if last.noise_needed is not None:
            fails = " That is more than independent errors need: the model fails, and no candidate "
            return (
                "Nothing is claimed to be missing. The noise is not known, so that chi2 decides "
                f"nothing; the model needs noise of {last.noise_needed}."
                + (f"{fails}explains it." if self.unexplained else "")
            )
        if self.unexplained:
            return (
                f"The model fails (chi2 per datum is {last.chi2_per_datum:.3g}; a correct model "
                "has 1), and no candidate explains it."
            )
        if np.isnan(last.p_value):
            return (
                "Whether the model explains the data cannot be decided: as many unknowns as data."
            )
        return (
            "Nothing is claimed to be missing: the model as given passes its check (chi2 per datum "
            f"{last.chi2_per_datum:.3g}, p = {last.p_value:.2g})."
        )

    def _claims(self) -> str:
        """Say which effects are missing, and which are only the best of several."""
        claimed = [kind for kind in self._kinds if self._is_claimed(kind)]
        unclaimed = [kind for kind in self._kinds if kind not in claimed]
        missing = " and ".join(map(self._with_odds, claimed))
        reducing = " and ".join(map(self._with_odds, unclaimed))
        parts = [f"Missing: {missing}"] if claimed else []
        is_one = sum(map(self.verdict.count, unclaimed)) == 1
        verb = "reduces" if is_one else "reduce"
        return "; ".join(parts + ([f"{reducing} also {verb} the misfit"] if unclaimed else []))

    def _sentence_of_two_states(self, last: FittedModel) -> str:
        """Say what is new in the later of two states."""
        assert self.baseline is not None
        alone = alone_in_words(self.baseline)
        if not self.verdict:
            return f"Nothing is claimed to be new since the baseline was measured. {alone}"
        new = " and ".join(map(self._with_odds, self._kinds))
        remark = " Something else is new as well." if self.unexplained else ""
        falls = _fall(self.steps[0], last, " of both states")
        return f"New since the baseline: {new}; {falls}.{remark} {alone}"

    def _sentence_with_model_error(self, first: FittedModel, last: FittedModel) -> str:
        """Say the verdict where a model error is the rival of every effect."""
        if not self.verdict:
            fails = " The model still fails its check." if self.unexplained else ""
            why = f"{self._why_not()}. {sizes_in_words(last)}{fails}"
            return f"Nothing is claimed to be missing: {why}"
        remark = " Something else is still missing." if self.unexplained else ""
        before, after = first.chi2_when_exact, last.chi2_when_exact
        if last.noise_needed is not None:
            before, after = float("nan"), float("nan")
            remark = f" {_fall(first, last).capitalize()}.{remark}"
        falls = (
            f" Without model error chi2 per datum falls from {before:.3g} to {after:.3g}."
            if np.isfinite(before) and np.isfinite(after)
            else ""
        )
        return (
            f"{self._claims()}, which explains the data better than a larger model error."
            f"{falls} {sizes_in_words(last, first)}{remark}"
        )

    def _why_not(self) -> str:
        """Say why nothing is claimed where a model error is allowed."""
        if self.confounded:
            return (
                "besides a model error, more than one effect also reduces the misfit, and these "
                "data do not tell which"
            )
        best = self.compared["effects"].iloc[0]
        if best == "none":
            return "a model error explains the data better than any candidate"
        return (
            f"{best} also reduces the misfit, but leaves more of it to the model error than it "
            "explains, or predicts held-out data no better"
        )

    def _is_claimed(self, kind: str) -> bool:
        """Whether an effect is more than the best of several.

        Where a model error is allowed it is: held-out data confirm it, and a larger model error is
        among the rivals already. Where the noise is not known, it is if the residuals scatter as
        noise does.
        """
        last = self.steps[-1]
        if last.noise_needed is not None and not last.model_error:
            return not self.unexplained
        return bool(last.model_error) or self._probability(kind) >= DOUBTED

    @property
    def _kinds(self) -> list[str]:
        """Kinds of the verdict, each once."""
        return list(dict.fromkeys(self.verdict))

    def _probability(self, kind: str) -> float:
        """Probability that as many of a kind are missing as the verdict has, or more."""
        return self.probabilities[numbered_kind(kind, self.verdict.count(kind))]

    def _with_odds(self, kind: str) -> str:
        """Name an effect: which part it is about, and its probability where the noise is right.

        Of several of a kind, how large each is and where.
        """
        count = self.verdict.count(kind)
        name = kind if count == 1 else f"{kind} {TIMES.get(count, f'{count} times')}"
        settings = [*self._settings(kind)] if count == 1 else [self._each(kind)]
        if self.probabilities[NONE] <= DOUBTED:
            settings.append(f"probability {self._probability(kind):.3g}")
        elif not self._is_claimed(kind):
            settings.append("the best of the candidates")
        return f"{name} ({('; ' if count > 1 else ', ').join(settings)})" if settings else name

    def _each(self, kind: str) -> str:
        """Say of each effect of a kind how large it is and where, in the order of the places."""
        last = self.steps[-1]
        effects = [
            effect
            for effect in self.experiment.effects
            if effect.name in last.effects and kind_of(effect) == kind
        ]
        *words, word = map(last.in_short, sorted(effects, key=last.place_of))
        return f"{', '.join(words)} and {word}"

    def _settings(self, kind: str) -> Iterator[str]:
        """Which part an effect is about in the last model, and what its estimates mean.

        On the way there another variant of the same kind may have been the best.
        """
        final = self.steps[-1].about
        for step in self.steps:
            if step.kind == kind:
                yield from filter(None, final.get(step.added or "", (step.setting, step.remark)))

    def words(self) -> list[str]:
        """The verdict, which effects the data do not distinguish, and what remains unexplained."""
        sentences = [self.sentence()]
        likely = max(self.probabilities, key=lambda kind: self.probabilities[kind])
        passes = not self.unexplained and not self.steps[-1].model_error
        if not self.verdict and passes and likely not in (NOTHING, NONE):
            sentences.append(
                f"The evidence favours {likely} (probability {self.probabilities[likely]:.2g}), "
                "but no effect is claimed, since the model as given passes its check. More "
                "averages or lines would decide."
            )
        sentences += [confounded_sentence(*pair, self.verdict) for pair in self.confounded]
        if self.probabilities[NONE] > DOUBTED and self.steps[-1].noise_needed is None:
            sentences.append(
                "None of the candidates explains the data within the stated noise (probability "
                f"{self.probabilities[NONE]:.2g}): add an effect of your own, or check the noise."
            )
        return [*sentences, *self.cautions]

    def __repr__(self) -> str:
        """State the verdict."""
        return f"Ledger: {self.sentence()}"

    def _repr_html_(self) -> str:
        verdict, *further = self.words()
        return notebook_html(verdict, self.table(), further)

    def __str__(self) -> str:
        """Table of the steps, then the sentences."""
        return "\n".join([narrow(self.table()), "", *(f"- {line}" for line in self.words())])


def sizes_in_words(step: FittedModel, before: FittedModel | None = None) -> str:
    """Say how much model error a model needs, and how much it needed before."""
    parts = []
    for kind, size in step.model_error.items():
        was = "" if before is None else f" (before: {percent(before.model_error[kind].mean)})"
        parts.append(f"{OF_WHAT[kind]} by {percent(size.mean)}{was}")
    return f"The model needs to err: {', '.join(parts)}."


def alone_in_words(baseline: FittedModel) -> str:
    """Say how well the model explains the earlier state alone."""
    needed = (
        f"chi2 per datum {baseline.chi2_per_datum:.3g}"
        if baseline.noise_needed is None
        else f"noise of {baseline.noise_needed}"
    )
    verb = "has" if baseline.noise_needed is None else "needs"
    errors = f" {sizes_in_words(baseline)}" if baseline.model_error else ""
    return f"The baseline alone {verb} {needed}.{errors}"


def _fall(first: FittedModel, last: FittedModel, of: str = "") -> str:
    """Say how the misfit falls: chi2, or where the noise is not known, the noise that is needed."""
    if last.noise_needed is None:
        before, after = first.chi2_per_datum, last.chi2_per_datum
        return f"chi2 per datum{of} falls from {before:.3g} to {after:.3g}"
    return f"the noise that the model needs is {last.noise_needed} (before: {first.noise_needed})"


def misfit_columns(step: FittedModel) -> dict[str, str]:
    """Chi2, or where the noise is not known, the noise that is needed and its comparisons."""
    noise = step.noise_needed
    if noise is None:
        return {"chi2 per datum": number_or_blank(step.chi2_per_datum, ".4g")}
    return {
        "noise needed": percent(noise.relative),
        "over coherence": number_or_blank(noise.over_coherence, ".2g"),
        "over scatter": number_or_blank(noise.over_scatter, ".2g"),
    }


def _model_error_columns(step: FittedModel, exact: bool) -> dict[str, str]:
    """Sizes of the model error, and chi2 without it where all steps were fitted without as well.

    With a baseline, effects are fitted with the model error alone.
    """
    if not step.model_error:
        return {}
    is_shown = exact and step.noise_needed is None
    chi2 = {"exact chi2": f"{step.chi2_when_exact:.4g}"} if is_shown else {}
    return chi2 | {kind: percent(size.mean) for kind, size in step.model_error.items()}


def confounded_sentence(kind: str, other: str, verdict: Sequence[str] = ()) -> str:
    """Say that the data do not distinguish two effects, of which the first is in the verdict."""
    one = f"one {kind} of {verdict.count(kind)}" if verdict.count(kind) > 1 else kind
    another = f"one more {other}" if other in verdict else other
    return f"These data do not distinguish {one} from {another}: either of them explains the data."


__all__ = ["NONE", "NOTHING", "FittedModel", "Ledger", "confounded_sentence"]
