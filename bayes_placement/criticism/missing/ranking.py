"""Which effect a model may lack: every kind of candidate with its probability."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from ..._shared.files import Json, write_json
from ..._shared.reprs import notebook_html
from ...inference.alternative_explanation import Alternative
from ..noise_needed import TOO_FEW
from ..reach.reach import Reach, only_port
from ._claims import SCHEMA
from ._narrow_text import gained, narrow
from ._parameter_estimate import number_or_none
from ._standing import Standing
from ._verdict_in_words import (
    LEFT,
    UNEXPLAINED_BASELINE,
    alone_in_words,
    better_than_errors,
    exact_fails,
    fails_in_words,
    fall,
    sizes_in_words,
    what_is_known,
)
from ._weighed import NONE, NOTHING
from .decide import is_missing, is_unexplained
from .fitted_model import FittedModel, number_or_blank
from .ledger import confounded_sentence, misfit_columns
from .table import AS_STATED, TableOfFits


@dataclass(frozen=True, repr=False)
class Ranking:
    """Which effect may be missing.

    Parameters
    ----------
    steps
        The model as given, and with the best variant of each kind of effect, by falling odds.
    probabilities
        Posterior probability of each kind, of `nothing_missing` and of `none_of_these`.
    confounded
        Pairs of kinds that these data do not distinguish.
    suspicion
        Score test of every candidate along its places: `kind`, `variant`, `setting` in words, `at`
        [m] along a line, `x`, `y`, `z` [m] in space, `score`, and `p_value` corrected for all the
        places that were tested.
    alternatives
        Hypotheses that the next measurement should distinguish, with draws of their unknowns: those
        of nearly the best odds and those that pass the test of chi2. `information.Separation`
        finds where to measure.
    claimed
        The effect for which the evidence is strong, if any; none where the model as given passes
        its check.
    baseline
        The model fitted to the earlier state alone, see `Ledger`; None where there is only one
        state. Effects are then what is new since.
    baseline_as_given
        The model as given, fitted to the earlier state alone.
    record
        Where it comes from: versions, date, seed, hashes of experiment and measurement, units.
    effects
        An entry for the claimed effect, see `Ledger`.
    reach
        What laws at each place could remove of the misfit; None where the model as given passes its
        check, or no law can be read.
    standing
        What makes the claim doubtful, and where the model fails.
    rows
        Numbers of every fitted hypothesis, by which `decide` decides.

    Examples
    --------
    >>> ranking = bp.explain(experiment, surprise, candidates=library, model_error=None)
    >>> ranking.words()[0].split(";")[0]
    'Missing is point_mass, 0.4992 kg at 401.5 mm (probability 0.998)'
    """

    steps: tuple[FittedModel, ...]
    probabilities: dict[str, float]
    confounded: tuple[tuple[str, str], ...]
    suspicion: pd.DataFrame = field(repr=False)
    alternatives: tuple[Alternative, ...] = field(repr=False)
    claimed: tuple[str, ...] = ()
    baseline: FittedModel | None = None
    baseline_as_given: FittedModel | None = None
    record: Json = field(default_factory=dict, repr=False)
    effects: tuple[Json, ...] = field(default=(), repr=False)
    reach: Reach | None = field(default=None, repr=False)
    standing: Standing = field(default_factory=Standing, repr=False)
    rows: TableOfFits = field(default=TableOfFits([]), repr=False)

    @property
    def port(self) -> str | None:
        """Kind of port on which the claimed effect acts; None as for `z`."""
        return only_port(self.reach, [effect["acts_on"] for effect in self.effects])

    @property
    def z(self) -> pd.DataFrame | None:
        """Law as measured at the port of the claimed effect, see `Reach.law_as_measured`.

        None where no effect or several are claimed, or the effect acts on no port: a law that is
        read on the model as given takes up all that this lacks.
        """
        read = self.reach if self.port else None
        return read.law_as_measured(self.port) if read else None

    def to_json(self) -> Json:
        """Return the ranking as numbers and words for a file."""
        return {
            "schema": SCHEMA,
            "effects": [dict(effect) for effect in self.effects],
            "reach": None if self.reach is None else self.reach.to_json(),
            "explanations": [step.to_json() for step in self.steps],
            "baseline": None if self.baseline is None else self.baseline.to_json(),
            "claimed": list(self.claimed),
            "probabilities": {
                kind: number_or_none(share) for kind, share in self.probabilities.items()
            },
            "confounded": [list(pair) for pair in self.confounded],
            "table": self.rows.to_json(),
            "record": dict(self.record),
        }

    def write(self, path: str | Path) -> None:
        """Write the ranking as JSON, atomically."""
        write_json(path, self.to_json())

    @property
    def _as_given(self) -> FittedModel:
        return next((step for step in self.steps if not step.kind), self.steps[0])

    def table(self) -> pd.DataFrame:
        """One row for each kind, the most probable first."""
        p_values = self.suspicion.groupby("kind")["p_value"].min().to_dict()
        as_given = self._as_given
        rows = [
            {
                "effect": step.kind or NOTHING,
                "probability": f"{self.probabilities[step.kind or NOTHING]:.3g}",
                **misfit_columns(step),
                **gained(step, as_given),
                "held out": number_or_blank(step.held_out, ".3f"),
                "p of score": number_or_blank(p_values.get(step.kind, float("nan")), ".2g"),
                "parameters": step.description(),
            }
            for step in self.steps
        ]
        none = {"effect": NONE, "probability": f"{self.probabilities[NONE]:.3g}"}
        return pd.DataFrame([*rows, none]).fillna("").set_index("effect")

    def words(self) -> list[str]:
        """The most probable effect, and which effects the data do not distinguish."""
        best = self.steps[0]
        noise = best.noise_needed
        sentences = [
            self._verdict(best) if self.baseline is None else self._verdict_on_new(best),
            "" if noise is None else f"The noise is not known; the best needs noise of {noise}.",
            TOO_FEW if noise is not None and noise.is_misfit_alike else "",
            sizes_in_words(best) if best.model_error else "",
            "" if self.baseline is None else alone_in_words(self),
            *(confounded_sentence(*pair) for pair in self.confounded),
        ]
        return [sentence for sentence in sentences if sentence]

    def _verdict(self, best: FittedModel) -> str:
        """Name an effect where the evidence is strong, and else say how the model fails."""
        likely = max(self.probabilities, key=lambda kind: self.probabilities[kind])
        share = self.probabilities[likely]
        falls = fall(self._as_given, best)
        if best.kind and best.kind in self.claimed and (best.model_error or best.noise_needed):
            left = f" {LEFT}" if self._is_misfit_left(likely, best) else ""
            if best.model_error and not self._is_missing(best):
                only = f"{best.in_words(best.kind)}{self._but(best)} reduces the misfit"
                return f"{exact_fails(self._as_given)} {only}; {falls}.{left}"
            better = better_than_errors(best, "larger error")
            return f"{best.claim(best.kind)}{self._but(best)}{better}; {falls}.{left}"
        if likely not in (NOTHING, NONE) and share >= AS_STATED.doubted:
            if likely in self.claimed:
                but = self._but(best, f"probability {share:.3g}")
                left = f" {LEFT}" if best.p_value < AS_STATED.level else ""
                return f"{best.claim(likely)}{but}; {falls}.{left}"
            return f"The evidence favours {likely} (probability {share:.3g}), but not clearly."
        also = f" {best.in_words(best.kind)} also reduces the misfit." if best.kind else ""
        if self.standing.exact_fails:
            return self._failure(likely, best)
        if likely == NOTHING and share >= AS_STATED.doubted:
            return f"Nothing is missing, with probability {share:.3g}."
        return f"No effect is clearly missing.{also}"

    def _is_missing(self, best: FittedModel) -> bool:
        """Whether the best effect is more than the best of several, as of a ledger."""
        fit = bool(best.model_error), best.noise_needed is None, best.p_value < AS_STATED.level
        return is_missing(*fit, self.probabilities[best.kind], AS_STATED)

    def _but(self, best: FittedModel, odds: str = "") -> str:
        """Probability of an effect, and what makes it doubtful, in brackets."""
        doubts = " and ".join(self.standing.doubts_of(best.effects))
        is_doubtful = odds and (doubts or best.p_value < AS_STATED.level)
        among = f"{odds} among the candidates" if is_doubtful else odds
        words = ", but ".join(filter(None, [among, doubts]))
        return f" ({words})" if words else ""

    def _failure(self, likely: str, best: FittedModel) -> str:
        """Say how the model fails, and what was nearest."""
        as_given = self._as_given
        if as_given.model_error:
            also = "" if best.kind else " A model error explains the data better than any effect."
            clear = f"No effect is clearly missing.{also}"
            parts = [exact_fails(as_given), self.standing.where, clear, self.standing.untried]
            return " ".join(filter(None, parts))
        odds = f" (probability {self.probabilities[NONE]:.3g})" if likely == NONE else ""
        fails = fails_in_words(as_given, odds)
        known = what_is_known(as_given, self._with_nearest(), self.reach)
        return " ".join([fails, *known, "improve tries two effects at once."])

    def _with_nearest(self) -> Standing:
        nearest = next((step for step in self.steps if step.kind), None)
        return replace(self.standing, nearest=nearest)

    def _is_misfit_left(self, likely: str, best: FittedModel) -> bool:
        """Whether the best one does not explain all: no candidate does, or it fails its check."""
        return likely == NONE or best.p_value < AS_STATED.level

    def _verdict_on_new(self, best: FittedModel) -> str:
        """Name an effect that is new in the later of two states, where the evidence is strong."""
        if best.kind and best.kind in self.claimed:
            share = self.probabilities[best.kind]
            odds = self._but(best, f"probability {share:.3g}" if share >= AS_STATED.doubted else "")
            more = " Something else is new as well." if best.p_value < AS_STATED.level else ""
            return f"New since the baseline is {best.in_words(best.kind)}{odds}.{more}"
        if is_unexplained(self.rows.baseline, AS_STATED):
            return UNEXPLAINED_BASELINE
        share = self.probabilities[NOTHING]
        if share >= AS_STATED.doubted:
            return f"Nothing is new since the baseline was measured, with probability {share:.3g}."
        also = f" {best.kind} also reduces the misfit." if best.kind else ""
        return f"No effect is clearly new since the baseline was measured.{also}"

    def __repr__(self) -> str:
        """State the verdict."""
        return f"Ranking: {self.words()[0]}"

    def _repr_html_(self) -> str:
        verdict, *further = self.words()
        return notebook_html(verdict, self.table(), further)

    def __str__(self) -> str:
        """Table of the kinds, then the sentences."""
        lines = [f"- {line}" for line in self.words()]
        return "\n".join([narrow(self.table()), "", *lines])
