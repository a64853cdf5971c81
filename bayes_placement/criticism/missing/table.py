"""What is decided by: one row of numbers for each fitted hypothesis, and the thresholds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.special import chdtrc, ndtr

from ..._shared.arguments import check_positive
from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.reprs import with_short_repr
from ...inference.chi2 import LEVEL
from ..check._edges import EDGE, PILED
from ._outliers import p_value

NAN = float("nan")


@with_short_repr
@dataclass(frozen=True)
class Policy:
    """Every threshold and prior probability by which `decide` decides.

    Parameters
    ----------
    level
        Probability that a correct model fails its check, or has so many outliers [1].
    strong
        Bayes factor of strong evidence for an effect [1]: Kass and Raftery,
        doi:10.1080/01621459.1995.10476572.
    strong_where_passing
        The same twice, where the model passes its check without the effect [1]: chi2 over many
        lines passes although an effect shows in a few.
    prior_of_further_effect
        Prior probability that a further effect is missing [1].
    prior_of_none
        That the error is larger than stated, for a reason that no candidate has [1].
    largest_factor
        Greatest factor on the stated deviation, log-uniform from 1 [1].
    held_out_errors
        Standard errors by which held-out data are predicted better, or worse, with an effect [1].
    explained
        Share of the misfit of the exact model that an effect explains beside a model error [1].
    piled_up
        Posterior over prior probability at the edge of a prior, of a size that is doubted [1].
    doubted
        Probability of `none_of_these` from which on the stated noise is in doubt, and of an effect
        below which it only reduces the misfit [1].
    one_place
        Share of the size of a structure within which effects act at one place [1].
    outlier
        Probability from which on a datum is told to be an outlier [1].

    Examples
    --------
    >>> bp.decide(ledger.rows, bp.Policy(strong=1e9)).kinds
    ('point_mass',)
    """

    level: float = LEVEL
    strong: float = 20.0
    strong_where_passing: float = 400.0
    prior_of_further_effect: float = 0.5
    prior_of_none: float = 0.05
    largest_factor: float = 1e3
    held_out_errors: float = 2.0
    explained: float = 0.5
    piled_up: float = PILED
    doubted: float = 0.5
    one_place: float = 0.1
    outlier: float = 0.99

    def __post_init__(self) -> None:
        """Refuse what is no number above zero, and probabilities of one and more."""
        for each in fields(self):
            most = 0.999 if each.default < 1 else np.inf  # type: ignore[operator]
            instead = f"Policy({each.name}={each.default})"
            check_positive(each.name, vars(self)[each.name], instead, most)
        if self.largest_factor <= 1:
            raise InputError(
                f"largest_factor={self.largest_factor} was given; more than 1 is needed, since the "
                "error may be larger than stated by it: Policy(largest_factor=1000.0)."
            )


AS_STATED = Policy()


Box: TypeAlias = tuple[tuple[float, ...], tuple[float, ...]]
"""Least and greatest coordinates over the size of the structure [1]."""


class Row(NamedTuple):
    """Numbers of a fitted hypothesis; NaN stands for what there is not.

    `kinds`, sorted, and `effects` are kinds and names of its effects, `variants` what they are
    about where others of their kind may stand for them, sorted. The log prior is that among
    hypotheses of as many effects. `squares` are of residuals over their deviations, `determined` is
    the number of unknowns that the data determine.

    The level of the noise is known where it is stated, or read from the data. If not, `neumann` is
    von Neumann's ratio of the residuals, or the share of noise by the record if that is smaller,
    and the inverse of its deviation (`share_of_noise`); `outliers` is their expected number, and
    `gain_with_outliers` the log likelihood gained where a few data may be some. `noise` is its
    median over the amplitude [1].

    `sizes` of a model error are name, size, and the share of the prior below. Values when exact are
    without model error: chi2 per datum, and of the model as given the p-value of its check.
    `states` share all other unknowns: 2 with a baseline. `on_structure` says that not all effects
    are of instruments or of the record. `held_out` is the mean log density of a
    datum of each block that was held out; `edges` are of sizes of effects: the effect, side, and
    posterior over prior probability at that edge. `places` are of effects, by their kinds: 95 %
    intervals, of a part of its middle.
    """

    kinds: tuple[str, ...]
    log_evidence: float
    squares: float
    data: int
    determined: float
    log_prior: float = 0.0
    effects: tuple[str, ...] = ()
    is_noise_known: bool = True
    neumann: tuple[float, float] = (NAN, NAN)
    outliers: float = 0.0
    gain_with_outliers: float = 0.0
    noise: float = NAN
    has_errors: bool = False
    sizes: tuple[tuple[str, float, float], ...] = ()
    chi2_when_exact: float = NAN
    p_value_when_exact: float = NAN
    states: int = 1
    on_structure: bool = False
    held_out: tuple[float, ...] = ()
    edges: tuple[tuple[str, str, float], ...] = ()
    variants: tuple[str, ...] = ()
    places: tuple[tuple[str, Box], ...] = ()

    def place_of(self, kind: str) -> Box | None:
        """Where the effect of a kind acts; None where that is not known, or there are several."""
        boxes = [box for of, box in self.places if of == kind]
        return boxes[0] if len(boxes) == 1 else None

    @property
    def p_value(self) -> float:
        """Probability that a correct model has at least as large a sum of squares.

        NaN where the data determine as many unknowns as there are data. Where the noise is not
        known, that its residuals exceed the scatter of neighbouring lines as much.
        """
        if not self.is_noise_known:
            ratio, certainty = self.neumann
            return float(ndtr((ratio - 1) * certainty))
        free = self.data - self.determined
        return float(chdtrc(free, self.squares)) if free > 0 else NAN

    @property
    def misfit(self) -> float:
        """Mean square of what is no noise: of the exact model, in variances of the noise.

        Where that is not known, the part of the residuals that is smooth along the lines, in
        squares of the amplitude. NaN where it is not known.
        """
        if self.is_noise_known:
            return self.chi2_when_exact - 1.0
        return self.noise**2 * (1.0 - self.neumann[0])

    @property
    def p_value_of_outliers(self) -> float:
        """Probability of at least as many outliers, of the share that a mixture assumes.

        More of them are a misfit at many lines, which an effect may explain.
        """
        return p_value(self.outliers, self.data)

    def passes(self, policy: Policy) -> bool:
        """Whether it passes its check; where the noise is unknown, no check is possible."""
        return self.is_noise_known and not self.p_value < policy.level

    def explains(self, policy: Policy) -> bool:
        """Whether it leaves nothing but noise, so that no more effects are looked for.

        It passes its check; or, where the noise is unknown, its residuals are no larger than the
        scatter of neighbouring lines, and no more of them are outliers than assumed. That alone
        does not say that a model is right: at lines far from each other any misfit scatters, and
        the scatter of other lines of the record tells that only where these are known.
        """
        if self.is_noise_known:
            return self.passes(policy)
        return min(self.p_value, self.p_value_of_outliers) >= policy.level

    def fails(self, policy: Policy) -> bool:
        """Whether it leaves more than noise; not where too few lines tell what noise is."""
        told = [self.p_value] if self.is_noise_known else [self.p_value, self.p_value_of_outliers]
        return any(p_value < policy.level for p_value in told)

    @property
    def errors_at_edge(self) -> tuple[str, ...]:
        """Sizes of the model error that are as large as their priors allow."""
        return tuple(name for name, _, share in self.sizes if share >= 1 - EDGE)

    def gain_of_larger_error(self, largest: float) -> float:
        """Gain of log evidence where the error may be larger by an unknown factor s.

        Laplace's method in log s about s^2 = squares per degree of freedom; where this is below 1,
        about s = 1 with the lower half of the Gaussian cut off. Posterior deviations of parameters
        grow by s. An error that is not stated is none that could be larger.
        """
        if not self.is_noise_known:
            return -np.inf
        free = max(self.data - self.determined, 1.0)
        factor = max(self.squares / free, 1.0)
        gain = 0.5 * self.squares * (1 - 1 / factor) - 0.5 * free * np.log(factor)
        width = np.sqrt(np.pi / free) * (1.0 if factor > 1 else 0.5)
        return float(gain + np.log(width / np.log(largest)))

    def gain_of_none(self, largest: float) -> float:
        """Gain of log evidence where something is missing that no candidate is.

        A stated noise may be too small by a factor. One that is not stated takes up the misfit by
        itself, which then is larger than the scatter of neighbouring lines.
        """
        if self.is_noise_known:
            return self.gain_of_larger_error(largest)
        return gain_of_smooth_misfit(*self.neumann, largest)


def gain_of_smooth_misfit(ratio: float, certainty: float, largest: float) -> float:
    """Gain of log evidence where the residuals may be a factor s larger than the noise.

    What is left of a misfit is smooth: it multiplies von Neumann's ratio by 1 / s^2. The ratio is
    normal, log s uniform between 0 and the log of the largest factor, as with known noise; by
    Laplace's method about s^2 = 1 / ratio; where this is below 1, about s = 1 with the half above
    it. Zero where the ratio tells nothing.
    """
    if np.isnan(ratio):
        return 0.0
    below = min(ratio, 1.0)
    width = np.sqrt(2 * np.pi) / (2 * below * certainty) * (1.0 if ratio < 1 else 0.5)
    share = min(float(width / np.log(largest)), 1.0)
    return float(0.5 * ((1 - below) * certainty) ** 2 + np.log(share))


@with_short_repr
class TableOfFits(NamedTuple):
    """Rows of all fitted hypotheses in any order, one of them without effects.

    Kinds were tried, fitted or not. The baseline is the model fitted to an earlier state alone.
    """

    rows: Sequence[Row]
    kinds: tuple[str, ...] = ()
    baseline: Row | None = None

    def to_json(self) -> Json:
        """Return it as numbers and words for a file; None for numbers that are not finite."""
        rows = [_row_to_json(row) for row in self.rows]
        baseline = None if self.baseline is None else _row_to_json(self.baseline)
        return {"kinds": list(self.kinds), "rows": rows, "baseline": baseline}

    @classmethod
    def from_json(cls, content: Json) -> "TableOfFits":
        """Return what `to_json` wrote."""
        try:
            rows = [_row_of_json(row) for row in content["rows"]]
            baseline = content.get("baseline")
            before = None if baseline is None else _row_of_json(baseline)
            return cls(rows, tuple(content["kinds"]), before)
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(
                f"A table of {', '.join(map(repr, content)) or 'nothing'} was given; 'kinds' and "
                "'rows' with all fields of each are needed, since they decide: "
                "bp.decide(json.load(open('ledger.json'))['table'])."
            ) from error


def _row_to_json(row: Row) -> Json:
    return {name: _plain(value) for name, value in row._asdict().items()}


def _row_of_json(row: Json) -> Row:
    return Row(**{name: _read(value) for name, value in row.items()})


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _read(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_read(part) for part in value)
    return NAN if value is None else value
