"""Record of an improvement: the error that falls step by step, in words and JSON."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from ..._shared.files import Json, write_json
from ..._shared.labels import AS_DRAWN, AS_GIVEN
from ..._shared.reprs import notebook_html
from ...experiment.experiment import Experiment, Measurements
from ...experiment.modal_parameters import ModalParameters
from ...inference.alternative_explanation import Alternative
from ...inference.units import percent
from ...positions.vectors import Recorded
from ..fitted import fitted, in_scalars
from ..fitted_modes import fitted_modes
from ..locations import effect_locations
from ..reach.reach import Reach, only_port
from ._claims import SCHEMA
from ._narrow_text import gained, narrow
from ._parameter_estimate import number_or_none
from ._standing import Standing
from ._verdict_in_words import none_in_words, verdict_in_words
from ._weighed import NONE, NOTHING
from .fitted_model import FittedModel, number_or_blank
from .table import AS_STATED, Policy, TableOfFits

NOISE_EXPLAINS = "what is left scatters as noise does"
"""Why nothing is claimed where the noise is not known."""


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
    given, measurement
        The experiment as it was given, and what was measured.
    compared
        Every hypothesis that was fitted: its effects, reduced chi-square, log evidence, log odds.
    suspicion
        Score test of every candidate on the model as given; see `explain`.
    alternatives
        Hypotheses that the next measurement should distinguish; see `explain`.
    cautions
        What to doubt in the last step: priors piled up at an edge, a fit reached from one start.
    baseline
        The model fitted to the earlier state alone, with the effects by which it is completed where
        as given it does not explain that state; None where there is only one state.
    baseline_as_given
        The model as given, fitted to the earlier state alone.
    record
        Where it comes from: versions, date, seed, hashes of experiment and measurement, units.
    effects
        An entry for each effect that is claimed: what it acts on and where, its law, and what else
        explains the data as well.
    reach
        What laws at each place could remove of the misfit; see `explain`.
    standing
        What makes the claims doubtful, where the model fails, and what was nearest.
    rows
        Numbers of every fitted hypothesis, by which `decide` decides.
    policy
        Thresholds by which it was decided.

    Examples
    --------
    >>> ledger.verdict, len(ledger.steps)
    (('point_mass',), 2)
    >>> ledger.sentence().split("; ")
    ['Missing: point_mass, 0.4992 kg at 401.5 mm (probability 0.998)',
     'reduced chi-square falls from 91.7 to 0.703.']
    """

    steps: tuple[FittedModel, ...]
    verdict: tuple[str, ...]
    probabilities: dict[str, float]
    confounded: tuple[tuple[str, str], ...]
    unexplained: bool
    seconds: float
    experiment: Experiment = field(repr=False)
    given: Experiment = field(repr=False)
    measurement: Measurements = field(repr=False)
    compared: pd.DataFrame = field(repr=False)
    suspicion: pd.DataFrame = field(repr=False)
    alternatives: tuple[Alternative, ...] = field(repr=False)
    cautions: tuple[str, ...] = ()
    baseline: FittedModel | None = None
    baseline_as_given: FittedModel | None = None
    record: Json = field(default_factory=dict, repr=False)
    effects: tuple[Json, ...] = field(default=(), repr=False)
    reach: Reach | None = field(default=None, repr=False)
    standing: Standing = field(default_factory=Standing, repr=False)
    rows: TableOfFits = field(default=TableOfFits([]), repr=False)
    policy: Policy = field(default=AS_STATED, repr=False)

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

    @cached_property
    def fits(self) -> dict[str, xr.Dataset]:
        """What the model predicts as drawn, as given and with all effects, beside the data.

        As drawn, positions are those recorded and all else has the mean of its prior; as given, all
        that is unknown was fitted. See `criticism.fitted.fitted`, and of modal parameters, which
        are not compared as drawn, `criticism.fitted_modes.fitted_modes`.
        """
        first, last = self.steps[0], self.steps[-1]
        models = {AS_GIVEN: (first.experiment or self.given, first.values)}
        if last.effects:
            models[last.label] = (last.experiment or self.experiment, last.values)
        if isinstance(self.measurement, ModalParameters):
            modes = self.measurement
            return {n: fitted_modes(model, modes, values) for n, (model, values) in models.items()}
        models = {AS_DRAWN: (self.given, in_scalars(self.given.nominal_values())), **models}
        return {n: fitted(model, self.measurement, values) for n, (model, values) in models.items()}

    @property
    def places(self) -> dict[str, Recorded]:
        """Where the effects that were added are [m], by name; those without a place not."""
        return effect_locations(self.experiment, self.steps[-1].values)

    def to_json(self) -> Json:
        """Return the ledger as numbers and words for a file."""
        return {
            "schema": SCHEMA,
            "effects": [dict(effect) for effect in self.effects],
            "reach": None if self.reach is None else self.reach.to_json(),
            "steps": [step.to_json() for step in self.steps],
            "baseline": None if self.baseline is None else self.baseline.to_json(),
            "verdict": list(self.verdict),
            "probabilities": {
                kind: number_or_none(share) for kind, share in self.probabilities.items()
            },
            "confounded": [list(pair) for pair in self.confounded],
            "unexplained": self.unexplained,
            "cautions": list(self.cautions),
            "wall_seconds": self.seconds,
            "table": self.rows.to_json(),
            "policy": asdict(self.policy),
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
                "added": step.title,
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
        """Say the verdict: what is missing, how large and where; or how the model fails."""
        return verdict_in_words(self)

    def words(self) -> list[str]:
        """The verdict, which effects the data do not distinguish, and what remains unexplained."""
        sentences = [self.sentence()]
        likely = max(self.probabilities, key=lambda kind: self.probabilities[kind])
        passes = not self.unexplained and not self.steps[-1].model_error
        if not self.verdict and passes and likely not in (NOTHING, NONE):
            noise = self.steps[-1].noise_needed
            why = "the model as given passes its check" if noise is None else NOISE_EXPLAINS
            sentences.append(
                f"The evidence favours {likely} (probability {self.probabilities[likely]:.2g}), "
                f"but no effect is claimed, since {why}. More averages or lines would decide."
            )
        sentences += [confounded_sentence(*pair, self.verdict) for pair in self.confounded]
        sentences += none_in_words(self)
        return [*sentences, *self.cautions]

    def __repr__(self) -> str:
        """State the verdict."""
        return f"Ledger: {self.sentence()}"

    def _repr_html_(self) -> str:
        verdict, *further = self.words()
        return notebook_html(verdict, self.table(), further)

    def __str__(self) -> str:
        """Table of the steps, the parameters of all effects together, then the sentences."""
        table, last = self.table(), self.steps[-1]
        together = table.assign(parameters=[_together(step, last) for step in self.steps])
        return "\n".join([narrow(together), "", *(f"- {line}" for line in self.words())])


def _together(step: FittedModel, last: FittedModel) -> str:
    """Parameters of what a step added, in the last model where that has it by the same name."""
    names = step.all_added
    is_there = [*map(step.named, names)] == [*map(last.named, names)]
    return (last if is_there else step).all_described(names)


def misfit_columns(step: FittedModel) -> dict[str, str]:
    """Reduced chi-square; where the noise is not known, the noise needed and its comparisons."""
    noise = step.noise_needed
    if noise is None:
        return {"reduced chi-square": number_or_blank(step.chi2_per_datum, ".4g")}
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
    chi2 = {"without model error": f"{step.chi2_when_exact:.4g}"} if is_shown else {}
    return chi2 | {kind: percent(size.mean) for kind, size in step.model_error.items()}


def confounded_sentence(kind: str, other: str, verdict: Sequence[str] = ()) -> str:
    """Say that the data do not distinguish two effects, of which the first is in the verdict."""
    one = f"one {kind} of {verdict.count(kind)}" if verdict.count(kind) > 1 else kind
    another = f"one more {other}" if other in verdict else other
    return f"These data do not distinguish {one} from {another}: either of them explains the data."


__all__ = ["NONE", "NOTHING", "FittedModel", "Ledger", "confounded_sentence"]
