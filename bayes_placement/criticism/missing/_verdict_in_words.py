"""The verdict of a ledger in words: what is missing, how large and where; or how it fails."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...experiment.model_error import OF_WHAT
from ...inference.units import percent, three_digits
from ..noise_needed import TOO_FEW
from ..reach.reach import Reach
from ._standing import Standing
from ._weighed import NONE, numbered_kind
from .decide import decide, is_missing, is_unexplained
from .fitted_model import FittedModel

if TYPE_CHECKING:
    from .ledger import Ledger
    from .ranking import Ranking

UNEXPLAINED = "no single cause that we know explains it"

SEEN_FROM = {"frequency": 1e-4, "runs": 1e-4, "damping": 1e-2}
"""Sizes of model error [1] from which a response shows them."""

SHAPES_SEEN_FROM = 1e-3
"""The same of all others."""

BY_ITSELF = {
    "damping": "Its damping differs from mode to mode ({}): give each mode in the band a ratio of "
    "its own, damping=bp.damping.Modal([dist.LogUniform(1e-3, 0.1) for _ in range(6)]) for six.",
    "gain": "Its sensitivities differ from those recorded ({}): give each transducer one of its "
    "own, bp.Sensor(..., gain=dist.Normal(1.0, 0.1)).",
}
"""What to write in the model where errors of one kind alone explain the data, and these errors."""

MOST_ERRORS = 12
"""Errors of one kind that are told."""

LEFT = "The model still fails its check: something else is missing as well."
"""What is said where an effect does not explain all."""

UNEXPLAINED_BASELINE = (
    "Nothing is claimed to be new: this model does not explain the baseline itself, and with no "
    "effect that was tried it does, so that nothing can be said of what came since. Look at "
    "supports and dimensions first."
)


def verdict_in_words(ledger: Ledger) -> str:
    """Say the verdict, the answer first."""
    if ledger.baseline is not None:
        return _of_two_states(ledger)
    sentences = _of_claims(ledger) if ledger.verdict else _of_nothing(ledger)
    return " ".join(filter(None, sentences))


def _of_claims(ledger: Ledger) -> list[str]:
    """What is missing, or reduces the misfit, how far that falls, and where something is left."""
    first, last = ledger.steps[0], ledger.steps[-1]
    where, untried = ledger.standing.where, ledger.standing.untried
    left = [LEFT, where, untried] if ledger.unexplained else []
    falls = [f"{_named(ledger)}; {fall(first, last)}."]
    if last.model_error:
        better = better_than_errors(last, "larger model error") if _claimed(ledger) else ""
        sizes = sizes_in_words(last, first)
        falls = [f"{_named(ledger)}{better}.", _fall_with_errors(first, last), sizes]
    if ledger.unexplained and not _claimed(ledger):
        return [fails_in_words(first), reach_in_words(ledger.reach), *falls, where, untried]
    return [*falls, *left]


def _of_nothing(ledger: Ledger) -> list[str]:
    """Whether the model passes its check, or how it fails and what was nearest."""
    last, stands = ledger.steps[-1], ledger.standing
    if last.model_error:
        return _of_errors_alone(ledger)
    if ledger.unexplained:
        return [fails_in_words(last), *what_is_known(last, stands, ledger.reach)]
    if last.noise_needed is not None:
        return [
            "Nothing is claimed to be missing. The noise is not known, so that the reduced "
            f"chi-square decides nothing; the model needs noise of {last.noise_needed}.",
            TOO_FEW if last.noise_needed.is_misfit_alike else "",
        ]
    if np.isnan(last.p_value):
        return ["Whether the model explains the data cannot be decided: as many unknowns as data."]
    return [
        "Nothing is claimed to be missing: the model as given passes its check "
        f"({misfit_in_words(last)}, p = {last.p_value:.2g})."
    ]


def _of_errors_alone(ledger: Ledger) -> list[str]:
    """Where a model error is the rival of every effect, and none is claimed beside it."""
    last, stands = ledger.steps[-1], ledger.standing
    reason = _why_not(ledger) or "a model error explains the data better than any candidate"
    why = f"Nothing is claimed to be missing: {reason}. {sizes_in_words(last)}"
    fails = ["The model still fails its check."] if ledger.unexplained else []
    if not stands.exact_fails:
        return [why, *fails]
    reach = ledger.reach if ledger.unexplained else None  # of the exact model: no rival of errors
    near = what_is_known(last, replace(stands, where=""), reach)
    return [exact_fails(last), stands.where, why, *fails, *near]


def fails_in_words(step: FittedModel, odds: str = "") -> str:
    """Say that the model fails and that nothing explains it."""
    return f"The model fails ({misfit_in_words(step)}); {UNEXPLAINED}{odds}."


def exact_fails(step: FittedModel) -> str:
    """Say that the model fails where it is taken for exact."""
    chi2 = step.chi2_when_exact
    is_told = np.isfinite(chi2) and step.noise_needed is None
    return (
        f"The exact model fails{f' (reduced chi-square {three_digits(chi2)})' if is_told else ''}."
    )


def what_is_known(step: FittedModel, stands: Standing, reach: Reach | None) -> list[str]:
    """What laws at any place could do, what was nearest, and where the model fails."""
    near = "" if stands.nearest is None else _near(step, stands.nearest)
    return [*filter(None, [reach_in_words(reach), near, stands.where, stands.untried])]


def reach_in_words(reach: Reach | None) -> str:
    """What the best law at any place could do; nothing where that was not looked for."""
    return "" if reach is None else f"Reach: {reach.words()[0]}"


def _near(step: FittedModel, nearest: FittedModel) -> str:
    """Say what was nearest; nothing of what takes away too little of the misfit to be read."""
    before, after = step.chi2_when_exact, nearest.chi2_when_exact
    if np.isfinite(before) and three_digits(before) == three_digits(after):
        return ""
    words = f"Nearest was {' and '.join(map(nearest.in_words, nearest.kinds))}"
    if step.model_error:
        exact = _fall_with_errors(step, nearest)
        return f"{words}. {exact}".rstrip()
    return f"{words}: {fall(step, nearest)}."


def _why_not(ledger: Ledger) -> str:
    """Say why nothing is claimed where a model error is allowed, or nothing is new."""
    return "; ".join(decide(ledger.rows, ledger.policy).reasons)


def none_in_words(ledger: Ledger) -> list[str]:
    """Say that no candidate explains the data, where that is more probable than not.

    Nor does a model error, of which the verdict itself says that it explains them.
    """
    share = ledger.probabilities[NONE]
    is_explained = ledger.steps[-1].model_error and not ledger.unexplained
    if share <= ledger.policy.doubted or is_explained:
        return []
    if ledger.steps[-1].noise_needed is None:
        return [
            "None of the candidates explains the data within the stated noise (probability "
            f"{share:.2g}): add an effect of your own, or check the noise."
        ]
    return [
        "None of the candidates explains what is smooth along the lines, and thus no noise "
        f"(probability {share:.2g}): add an effect of your own."
    ]


def _of_two_states(ledger: Ledger) -> str:
    """Say what is new in the later of two states."""
    alone = alone_in_words(ledger)
    if is_unexplained(ledger.rows.baseline, ledger.policy):
        return f"{UNEXPLAINED_BASELINE} {alone}"
    if not ledger.verdict:
        why = _why_not(ledger)
        fails = " The model still fails its check." if ledger.unexplained else ""
        since = f"since the baseline was measured{why and f': {why}'}"
        return f"Nothing is claimed to be new {since}.{fails} {alone}"
    new = " and ".join(_with_odds(ledger, kind) for kind in _kinds(ledger))
    remark = " Something else is new as well." if ledger.unexplained else ""
    falls = fall(ledger.steps[0], ledger.steps[-1], " of both states")
    return f"New since the baseline: {new}; {falls}.{remark} {alone}"


def better_than_errors(step: FittedModel, errors: str) -> str:
    """Say that what is missing is better than larger errors; of a value nothing is missing."""
    beyond = any(map(step.explanation, step.kinds))
    return "" if beyond else f", which explains the data better than a {errors}"


def _named(ledger: Ledger) -> str:
    """Say which effects are missing, and which are only the best of several."""
    claimed = _claimed(ledger)
    unclaimed = [kind for kind in _kinds(ledger) if kind not in claimed]
    beyond = [kind for kind in claimed if ledger.steps[-1].explanation(kind)]
    effects = [kind for kind in claimed if kind not in beyond]
    missing, explaining, reducing = (
        " and ".join(_with_odds(ledger, kind) for kind in some)
        for some in (effects, beyond, unclaimed)
    )
    parts = [f"Missing: {missing}"] if effects else []
    parts += [explaining] if beyond else []
    is_one = sum(map(ledger.verdict.count, unclaimed)) == 1
    verb = "reduces" if is_one else "reduce"
    return "; ".join(parts + ([f"{reducing} also {verb} the misfit"] if unclaimed else []))


def _is_claimed(ledger: Ledger, kind: str) -> bool:
    """Whether an effect is more than the best of several, see `decide.is_missing`."""
    last = ledger.steps[-1]
    fit = bool(last.model_error), last.noise_needed is None, ledger.unexplained
    return is_missing(*fit, _probability(ledger, kind), ledger.policy)


def _kinds(ledger: Ledger) -> list[str]:
    """Kinds of the verdict, each once."""
    return list(dict.fromkeys(ledger.verdict))


def _claimed(ledger: Ledger) -> list[str]:
    return [kind for kind in _kinds(ledger) if _is_claimed(ledger, kind)]


def _probability(ledger: Ledger, kind: str) -> float:
    """Probability that as many of a kind are missing as the verdict has, or more."""
    return ledger.probabilities[numbered_kind(kind, ledger.verdict.count(kind))]


def _with_odds(ledger: Ledger, kind: str) -> str:
    """Name an effect, how large it is and where, its probability, and what makes that doubtful."""
    last = ledger.steps[-1]
    names = [effect.name for effect in last.of_kind(kind)]
    doubts = " and ".join(ledger.standing.doubts_of(names))
    if ledger.probabilities[NONE] <= ledger.policy.doubted:
        among = " among the candidates" if doubts or ledger.unexplained else ""
        odds = f"probability {_probability(ledger, kind):.3g}{among}"
    else:
        odds = "" if _is_claimed(ledger, kind) else "the best of the candidates"
    odds = ", but ".join(filter(None, [odds, doubts]))
    named = (_is_claimed(ledger, kind) and last.explanation(kind)) or last.in_words(kind)
    return f"{named} ({odds})" if odds else named


def _fall_with_errors(first: FittedModel, last: FittedModel) -> str:
    """Say how the misfit of the exact models falls, or the noise that is needed."""
    before, after = first.chi2_when_exact, last.chi2_when_exact
    if last.noise_needed is not None:
        return f"{fall(first, last).capitalize()}."
    if not (np.isfinite(before) and np.isfinite(after)):
        return ""
    falls = f"falls from {three_digits(before)} to {three_digits(after)}"
    return f"Without model error the reduced chi-square {falls}."


def sizes_in_words(step: FittedModel, before: FittedModel | None = None) -> str:
    """Say how much model error a model needs, and how much it needed before.

    Of errors that it hardly needs only that; of those of one kind alone how they become a part of
    the model.
    """
    parts, needed = [], []
    for kind, size in step.model_error.items():
        earlier = None if before is None else before.model_error[kind].mean
        if max(size.mean, earlier or 0.0) >= SEEN_FROM.get(kind, SHAPES_SEEN_FROM):
            was = "" if earlier is None else f" (before: {percent(earlier)})"
            parts.append(f"{OF_WHAT[kind]} by {percent(size.mean)}{was}")
            needed.append(kind)
    if not parts:
        return "The model hardly needs to err."
    rest = ["hardly in anything else"] if len(needed) < len(step.model_error) else []
    said = f"The model needs to err: {', '.join(parts + rest)}."
    if len(needed) > 1 or needed[0] not in BY_ITSELF or step.kinds:
        return said
    return f"{said} {BY_ITSELF[needed[0]].format(', '.join(_errors_of(step, needed[0])))}"


def _errors_of(step: FittedModel, kind: str) -> list[str]:
    """Errors of single modes or channels in words, but those that no response shows."""
    before, size = f"model_error.{kind}.standard", step.model_error[kind].mean
    least = SEEN_FROM.get(kind, SHAPES_SEEN_FROM)
    told = []
    for name, standard in step.errors.items():
        error = size * standard if kind == "gain" else np.expm1(size * standard)
        if name.startswith(before) and abs(error) >= least:
            owner, _, number = name.removeprefix(before).partition("[")
            whose = owner.strip(".").replace(".", " ") or f"mode {int(number[:-1]) + 1}"
            told.append(f"{whose} {100 * error:+.2g} %")
    return told[:MOST_ERRORS]


def alone_in_words(answer: Ledger | Ranking) -> str:
    """Say how well the model explains the earlier state alone, and by what it was completed."""
    baseline, as_given = answer.baseline, answer.baseline_as_given
    assert baseline is not None
    if not baseline.effects or as_given is None:
        return _explains_alone(f"The baseline alone {_misfit_alone(baseline)}", baseline)
    effects = " and ".join(map(baseline.in_words, baseline.kinds))
    return (
        f"{_explains_alone(f'As given, the baseline alone {_misfit_alone(as_given)}', as_given)} "
        "That does not explain it, so that the model was completed by what explains the baseline "
        f"best: {effects}. "
        f"{_explains_alone(f'With that it {_misfit_alone(baseline)}', baseline)}"
    )


def _misfit_alone(baseline: FittedModel) -> str:
    if baseline.noise_needed is None:
        return f"has a reduced chi-square of {three_digits(baseline.chi2_per_datum)}"
    return f"needs noise of {baseline.noise_needed}"


def _explains_alone(misfit: str, baseline: FittedModel) -> str:
    errors = f" {sizes_in_words(baseline)}" if baseline.model_error else ""
    return f"{misfit}.{errors}"


def misfit_in_words(step: FittedModel) -> str:
    """Say how large the misfit is: chi2, or where the noise is not known, what noise is needed."""
    if step.noise_needed is None:
        return f"reduced chi-square {three_digits(step.chi2_per_datum)}"
    return f"it needs noise of {step.noise_needed}"


def fall(first: FittedModel, last: FittedModel, of: str = "") -> str:
    """Say how the misfit falls: chi2, or where the noise is not known, the noise that is needed."""
    if last.noise_needed is None:
        before, after = first.chi2_per_datum, last.chi2_per_datum
        return f"reduced chi-square{of} falls from {three_digits(before)} to {three_digits(after)}"
    return f"the noise that the model needs is {last.noise_needed} (before: {first.noise_needed})"
