"""A fitted model for the record: its parameters, its misfit, its evidence."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..._shared.errors import SAMPLED
from ..._shared.files import Json
from ..._shared.labels import AS_GIVEN
from ..._shared.reprs import with_short_repr
from ...effects.attached import GivenLaw
from ...effects.beyond_prior import BeyondPrior
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...inference.chi2 import LEVEL
from ...inference.engines.about_mode import SampledPosterior, sampled_about
from ..kept_fits import stored_or_computed
from ..noise_needed import NoiseNeeded
from . import _beyond_in_words
from ._estimates import errors, estimates, sizes
from ._held_out import held_out
from ._hypotheses import Hypothesis, takes_long
from ._parameter_estimate import ParameterEstimate, number_or_none, spoken
from ._posterior_odds import STRONG, Comparison, p_value
from ._unknown_noise import noise_needed

FINALISTS = 3
"""Hypotheses, at most, whose evidence is computed by sampling."""

TIMES = {2: "twice", 3: "three times"}
"""How often a kind is missing, in words."""

Sampled = Mapping[int, SampledPosterior]
"""Hypotheses that were sampled, by identity."""


@with_short_repr
@dataclass(frozen=True)
class FittedModel:
    """An experiment with none, one or several effects, fitted.

    Parameters
    ----------
    added
        Name of the effect that was added; None for the model as it was given.
    effects
        Names of all its effects.
    parameters
        Every unknown with its uncertainty.
    chi2_per_datum
        Mean of |measured - predicted|^2 over E|error|^2; a correct model gives 1.
    p_value
        Probability that a correct model leaves as much; NaN where it has as many unknowns as data.
    log_evidence
        Log of the evidence, by Laplace's method or confirmed by sampling.
    log_evidence_error
        Its standard error where sampling confirmed it, else None.
    held_out
        Mean log density of held-out data [nats a real datum]; NaN where nothing can be held out.
    kind
        Kind of the effect that was added; empty for the model as it was given.
    setting
        Which sensor or part of the structure the added effect is about, in words.
    remark
        What its estimates mean, in words: a known wrong factor; mostly empty.
    model_error
        Sizes of the model error that it needs, by what they are the size of; empty for an exact
        model.
    errors
        Errors over their sizes at the best fit, and these sizes, by name.
    chi2_when_exact
        Chi2 per datum of the best fit without model error; NaN where there is none.
    experiment
        The experiment, its model error of the sizes above.
    noise_needed
        Noise that it needs, where the noise is not known; None where it is.
    noise_needed_when_exact
        Noise that the best fit without model error needs; None where there is none.
    about
        Setting and remark of each of its effects, in words.
    added_besides
        Names of effects that were added in the same step, where no model in between was fitted.

    Examples
    --------
    >>> step = ledger.steps[-1]
    >>> step.added, round(step.parameters["structure.effects.point_mass.mass"].mean, 2)
    ('point_mass', 0.5)
    """

    added: str | None
    effects: tuple[str, ...]
    parameters: dict[str, ParameterEstimate]
    chi2_per_datum: float
    p_value: float
    log_evidence: float
    log_evidence_error: float | None
    held_out: float
    kind: str = ""
    setting: str = ""
    remark: str = ""
    model_error: Mapping[str, ParameterEstimate] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict, repr=False)
    chi2_when_exact: float = float("nan")
    experiment: Experiment | None = field(default=None, repr=False)
    noise_needed: NoiseNeeded | None = None
    noise_needed_when_exact: NoiseNeeded | None = None
    about: Mapping[str, tuple[str, str]] = field(default_factory=dict, repr=False)
    added_besides: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Mean of each unknown, elements of arrays one by one."""
        means = {name: estimate.mean for name, estimate in self.parameters.items()}
        return means | dict(self.errors)

    @property
    def all_added(self) -> tuple[str, ...]:
        """Names of all effects that were added in this step."""
        return () if self.added is None else (*self.added_besides, self.added)

    @property
    def title(self) -> str:
        """What was added in this step, as a table names it."""
        return " + ".join(map(self.named, self.all_added)) or "as given"

    @property
    def label(self) -> str:
        """The model as figures name it, with all its effects."""
        return f"with {' and '.join(map(self.named, self.effects))}" if self.effects else AS_GIVEN

    def named(self, name: str) -> str:
        """Name of one of its effects; a law that was found is told by its elements."""
        present = () if self.experiment is None else self.experiment.effects
        laws = (each for each in present if each.name == name and isinstance(each, GivenLaw))
        return next(map(kind_of, laws), name)

    def description(self) -> str:
        """Say what was added: which sensor or part it is about, and its parameters."""
        return self.all_described(self.all_added)

    def all_described(self, names: Sequence[str]) -> str:
        """Say what effects are about, and their parameters; of several with names."""
        words = {name: self.described(name) for name in names}
        if len(words) < 2:
            return "".join(words.values())
        return "; ".join(f"{self.named(name)}: {said}" for name, said in words.items())

    def described(self, name: str) -> str:
        """Say which sensor or part one of its effects is about, and the parameters of that."""
        setting, remark = self.about.get(name, ("", ""))
        parameters = self.estimates_of(name).values()
        words = [f"{spoken(each.word)} {each.with_interval()}" for each in parameters]
        return ", ".join(filter(None, [setting, *words, remark]))

    def parameters_of_added(self) -> dict[str, ParameterEstimate]:
        """Unknowns of the effect that was added; of the model, where none was."""
        if self.added is None:
            return self.parameters
        return {
            name: estimate
            for name, estimate in self.parameters.items()
            if estimate.effect in self.all_added
        }

    def estimates_of(self, name: str) -> dict[str, ParameterEstimate]:
        """Unknowns of one of its effects, by their words within it."""
        return {item.word: item for item in self.parameters.values() if item.effect == name}

    def in_short(self, effect: Effect) -> str:
        """Say how large one of its effects is, and where: `0.4 kg at 370 mm`."""
        if isinstance(effect, BeyondPrior):
            return _beyond_in_words.in_short(effect, self.estimates_of(effect.name)["value"])
        setting, remark = self.about.get(effect.name, ("", ""))
        of_effect = self.estimates_of(effect.name).items()
        estimates = [(word, item) for word, item in of_effect if not item.is_of_channels]
        sizes = {word: item.in_short() for word, item in estimates if not _is_place(effect, item)}
        places = [
            f"{spoken(word)} {item.in_short()}"
            for word, item in estimates
            if _is_place(effect, item)
        ]
        what = [setting, *_named_sizes(kind_of(effect), sizes), remark]
        return " ".join(filter(None, [", ".join(filter(None, what)), ", ".join(places)]))

    @property
    def kinds(self) -> list[str]:
        """Kinds of its effects, each once."""
        present = () if self.experiment is None else self.experiment.effects
        return list(dict.fromkeys(kind_of(each) for each in present if each.name in self.effects))

    def of_kind(self, kind: str) -> list[Effect]:
        """Effects of a kind that were added, in the order of their places."""
        present = () if self.experiment is None else self.experiment.effects
        alike = [each for each in present if each.name in self.effects and kind_of(each) == kind]
        return sorted(alike, key=self.place_of)

    def in_words(self, kind: str) -> str:
        """Name the effects of a kind, how large each is and where."""
        alike = self.of_kind(kind)
        name = kind if len(alike) < 2 else f"{kind} {TIMES.get(len(alike), f'{len(alike)} times')}"
        *each, last = [*filter(None, map(self.in_short, alike))] or [""]
        return ", ".join(filter(None, [name, " and ".join(filter(None, [", ".join(each), last]))]))

    def explanation(self, kind: str) -> str:
        """Say what explains the data where nothing is missing but a prior ends too early."""
        beyond = [each for each in self.of_kind(kind) if isinstance(each, BeyondPrior)]
        sentence = " and ".join(
            _beyond_in_words.explanation(each, self.estimates_of(each.name)["value"])
            for each in beyond
        )
        return sentence[:1].upper() + sentence[1:]

    def claim(self, kind: str) -> str:
        """Say what is missing, or what explains the data though nothing is."""
        return self.explanation(kind) or f"Missing is {self.in_words(kind)}"

    def place_of(self, effect: Effect) -> list[float]:
        """Estimates of the place of one of its effects."""
        estimates = self.estimates_of(effect.name).values()
        return [estimate.mean for estimate in estimates if _is_place(effect, estimate)]

    def to_json(self) -> Json:
        """Return it as numbers and words for a file; None for numbers that are not finite."""
        return {
            "added": None if self.added is None else self.title,
            "names": list(self.all_added),
            "setting": self.setting,
            "remark": self.remark,
            "parameters": {name: estimate.to_json() for name, estimate in self.parameters.items()},
            "chi2_per_datum": number_or_none(self.chi2_per_datum),
            "p_value": number_or_none(self.p_value),
            "log_evidence": number_or_none(self.log_evidence),
            "held_out": number_or_none(self.held_out),
            "model_error": {
                word: [number_or_none(value) for value in (size.mean, size.low, size.high)]
                for word, size in self.model_error.items()
            },
            "chi2_per_datum_when_exact": number_or_none(self.chi2_when_exact),
            "noise_needed": _noise_to_json(self.noise_needed),
            "noise_needed_when_exact": _noise_to_json(self.noise_needed_when_exact),
        }


def _noise_to_json(noise: NoiseNeeded | None) -> Mapping[str, float | None] | None:
    return None if noise is None else noise.to_json()


def sampled_finalists(comparison: Comparison, hypotheses: Sequence[Hypothesis]) -> Sampled:
    """Sample the posteriors of the hypotheses whose evidence is similar, if they pass their check.

    Where a model fails, its posterior says nothing of the structure.
    """
    least = max(map(comparison.log_odds, hypotheses)) - 3 * STRONG
    close = [hypothesis for hypothesis in hypotheses if comparison.log_odds(hypothesis) > least]
    sampled = {
        id(hypothesis): _sampled(hypothesis)
        for hypothesis in close[:FINALISTS]
        # Of a model error there are too many unknowns to sample; Laplace's method stands.
        if not (hypothesis.has_errors or p_value(hypothesis) < LEVEL)
    }
    return {number: posterior for number, posterior in sampled.items() if posterior is not None}


def not_sampled(hypothesis: Hypothesis, sampled: Sampled) -> tuple[str, ...]:
    """Say so where draws about the mode of a model that passes its check could not be trusted."""
    if id(hypothesis) in sampled or hypothesis.has_errors or p_value(hypothesis) < LEVEL:
        return ()
    return (
        "Intervals are those of a Gaussian about the best fit, although the posterior is none: "
        f"these data tell less than they say. {SAMPLED.python} samples it, in minutes.",
    )


NOT_SAMPLED = SampledPosterior(np.zeros((0, 0)), float("nan"), float("nan"))
"""What is kept of a posterior that could not be sampled."""


@functools.lru_cache(maxsize=2 * FINALISTS)  # `improve` asks for those of `explain` again
def _sampled(hypothesis: Hypothesis) -> SampledPosterior | None:
    problem, fit = hypothesis.problem, hypothesis.fit

    def sampled() -> SampledPosterior:
        return sampled_about(problem.squares, fit, is_slow=takes_long(hypothesis)) or NOT_SAMPLED

    kept = stored_or_computed(sampled, NOT_SAMPLED, problem, fit.point)
    return kept if len(kept.points) else None


def fitted_model(
    hypothesis: Hypothesis, sampled: Sampled, added: Sequence[str] = (), in_full: bool = True
) -> FittedModel:
    """Lay out a hypothesis for the record.

    The last of its effects is new in it by default. In full, the record says how well it predicts
    held-out data and what noise it needs, which takes time.
    """
    posterior = sampled.get(id(hypothesis))
    parameters = estimates(hypothesis, None if posterior is None else posterior.points)
    experiment, exact = hypothesis.problem.experiment, hypothesis.exact
    names = [effect.name for effect in hypothesis.effects]
    added = added or names[-1:]
    name = added[-1] if added else None
    effect = next((effect for effect in experiment.effects if effect.name == name), None)
    about = {
        present.name: _about(present, experiment, parameters)
        for present in experiment.effects
        if present.name in names
    }
    setting, remark = about.get(name or "", ("", ""))
    return FittedModel(
        added=name,
        effects=tuple(names),
        parameters=parameters,
        chi2_per_datum=hypothesis.chi2_per_datum,
        p_value=p_value(hypothesis),
        log_evidence=float((posterior or hypothesis.fit).log_evidence + hypothesis.log_orders),
        log_evidence_error=None if posterior is None else posterior.log_evidence_error,
        held_out=held_out(hypothesis) if in_full else float("nan"),
        kind="" if effect is None else kind_of(effect),
        setting=setting,
        remark=remark,
        model_error=sizes(hypothesis),
        errors=errors(hypothesis) | hypothesis.problem.sizes,
        chi2_when_exact=hypothesis.chi2_when_exact,
        experiment=hypothesis.problem.at_fixed_sizes,
        noise_needed=noise_needed(hypothesis) if in_full else None,
        noise_needed_when_exact=noise_needed(exact) if in_full and exact else None,
        about=about,
        added_besides=tuple(added[:-1]),
    )


def _about(
    effect: Effect, experiment: Experiment, parameters: Mapping[str, ParameterEstimate]
) -> tuple[str, str]:
    """Which part an effect is about, and what its estimates mean."""
    setting = effect.setting(experiment.structure.modes, experiment.instruments)
    return setting, effect.remark(_of_effect(effect.name, parameters))


def _of_effect(
    name: str, parameters: Mapping[str, ParameterEstimate]
) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of the unknowns of an effect, by field."""
    return {
        estimate.word: (estimate.mean, estimate.standard_deviation)
        for estimate in parameters.values()
        if estimate.effect == name
    }


def _is_place(effect: Effect, estimate: ParameterEstimate) -> bool:
    return estimate.field in effect.place_fields


def _named_sizes(kind: str, sizes: Mapping[str, str]) -> list[str]:
    """Name each size, unless the kind does so: `0.4 kg` of a point_mass."""
    if len(sizes) == 1 and kind.endswith(next(iter(sizes))):
        return list(sizes.values())
    names = [spoken(word).rpartition(".")[2].replace("_", " ") for word in sizes]
    fields = [name.partition("along ")[0] for name in names]
    told = [
        (field in fields[:place] and name.removeprefix(field)) or name
        for place, (field, name) in enumerate(zip(fields, names, strict=True))
    ]
    return [f"{name} {size}" for name, size in zip(told, sizes.values(), strict=True)]


def number_or_blank(value: float, form: str) -> str:
    """Write a number; nothing where it is not finite."""
    return format(value, form) if np.isfinite(value) else ""
