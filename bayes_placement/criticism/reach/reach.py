"""What laws at each place, and factors of channels, could remove of a misfit, and the best."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import pandas as pd
from jaxtyping import Float
from scipy.special import chdtrc, logsumexp

from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.reprs import notebook_html
from ...inference.chi2 import LEVEL
from ...inference.engines.levenberg_marquardt import Fit
from ...inference.residuals import Problem
from ...inference.units import probability_in_words, three_digits
from ._as_measured import as_measured
from ._at_port import ReachOfPort, ends_in_metres, subject_in_words, where
from ._channels import CHANNELS, NOWHERE
from ._free_law import tells_phase
from ._in_bands import OF_LAW, LeftInBands, left_in_bands
from ._named_laws import STRONG, NamedLaw, simplest
from ._of_modes import ReachOfEffect
from ._reached_channels import reached_channels

Reached: TypeAlias = ReachOfPort | ReachOfEffect
"""What laws at a port can do, or of modal parameters effects."""

OF_AMPLITUDES = (
    "From amplitudes only laws of few numbers are tried, and no factors of channels: a law that is "
    "free at each line has two unknowns there, and each channel gives one equation. Measure the "
    "phase to read the law line by line."
)

OF_MODES = (
    "From modal parameters no law over frequency can be read, and no factor of a channel: at each "
    "place a mass, a spring, a dashpot or a local loss of stiffness is tried. Measure FRFs to read "
    "the law."
)

NONE_ALONE = (
    "None of these laws alone leaves nothing but noise: this says how much each removes, not where "
    "something acts."
)

HALF = 0.5
"""Share of the misfit below which what removes it explains less than what is left does."""


@dataclass(frozen=True, repr=False)
class Reach:
    """What laws at each place, and factors of channels, could remove of the misfit of a model.

    Parameters
    ----------
    curves
        A row for each kind of port and place: `acts_on` (`displacement`, `rotation`, `cut`,
        `relative`, `region`, `structure`, `channel` or `all_channels`), `setting` in words, `x`,
        `y`, `z` [m] and the other end of a strut or a region `to_x`, `to_y`, `to_z` [m], NaN where
        there is none; two shares of the misfit above noise [1]: what `any_law` there could remove,
        and what a passive one of `few_numbers` does; and the `log_evidence` of the latter. Of the
        structure the law is added to its modulus, of channels it is a factor on their FRFs. Any
        factor on a sensor with one actuator removes all misfit of that sensor: there `few_numbers`
        decides. From amplitudes and modal parameters `any_law` is NaN and channels are not tried.
    laws
        A row for the best laws, fitted in full with their places: `acts_on`, `setting` and place as
        above, the `law`, `few_numbers` [1], `chi2_per_datum`, and `probability` [1] among them.
    chi2_per_datum
        Of the model as given.
    measured
        The law as measured at each kind of port, see `law_as_measured`; of complex FRFs.
    fails
        Whether the model as given misses the data by more than noise; None of unknown noise.
    one_explains
        Whether the best law, alone, leaves nothing but noise; None of unknown noise. If not, the
        probabilities are of laws none of which is right, and no words or figures tell them.
    is_new
        Whether laws act in the later of two states alone: what is new since the baseline.
    limits
        What such data do not tell, in words; empty of complex FRFs.
    in_bands
        What any law leaves of a band, see `any_law_within`: of `bp.reach` from complex FRFs of one
        state, where laws were fitted at all lines.

    Examples
    --------
    >>> found = bp.reach(experiment, surprise)
    >>> found.kinds().index[0], round(float(found.laws["x"].iloc[0]), 2)
    ('displacement', 0.4)
    """

    curves: pd.DataFrame
    laws: pd.DataFrame
    chi2_per_datum: float
    measured: Mapping[str, pd.DataFrame] = field(repr=False)
    fails: bool | None
    one_explains: bool | None = None
    is_new: bool = False
    limits: str = ""
    in_bands: LeftInBands | None = field(default=None, repr=False)

    def kinds(self) -> pd.DataFrame:
        """Best law of each kind of port, and the probability of the kind; the greatest first."""
        shares = self.laws.groupby("acts_on")["probability"].sum()
        most = self.curves.groupby(["acts_on", "setting"])["any_law"].max().rename("any_law")
        best = self.laws.drop_duplicates("acts_on").join(most, on=["acts_on", "setting"])
        table = best.set_index("acts_on").assign(probability=shares)
        # Curves are of places on a grid, the best law of a place of its own.
        table["any_law"] = table[["any_law", "few_numbers"]].max(axis=1, skipna=False)
        return table.sort_values("probability", ascending=False)

    def as_good(self, acts_on: str) -> pd.DataFrame:
        """Places of a kind of port that the data do not tell from the best one that was tried.

        Parameters
        ----------
        acts_on
            Kind of port at one place: `displacement`, `rotation` or `cut`.

        Returns
        -------
        DataFrame
            The rows of `curves` at which laws of few numbers have a log evidence that is less by
            no more than what is strong evidence, a factor of twenty in odds.
        """
        rows = self.curves[self.curves["acts_on"] == acts_on]
        return rows[rows["log_evidence"] >= rows["log_evidence"].max() - STRONG]

    def law_as_measured(self, acts_on: str | None = None) -> pd.DataFrame:
        """Law that the data ask for at a kind of port, line by line.

        Place and unknowns are those of the best law of that kind, fitted in full; what they leave
        open is in the deviations.

        Parameters
        ----------
        acts_on
            Kind of port, or `channel` or `all_channels`; by default the most probable one.

        Returns
        -------
        DataFrame
            A row for each line: `frequency` [Hz]; `real` and `imaginary` part of the dynamic
            stiffness, of a cut of its compliance; their standard deviations `deviation_real` and
            `deviation_imaginary`, and their `covariance`; and the `unit`: N/m, of a rotation
            N m/rad, of a cut m/N or rad/(N m). Of channels the factor on their FRFs, with unit 1.

        Raises
        ------
        InputError
            If the structure has no such port, or no complex FRFs were measured.
        """
        if not self.measured:
            raise InputError(
                "Reach of amplitudes or modes was given; complex FRFs are needed, since a law has "
                "two parts at each line: observe=bp.observe.Complex()."
            )
        kind = str(self.laws["acts_on"].iloc[0]) if acts_on is None else acts_on
        if kind not in self.measured:
            raise InputError(
                f"acts_on={acts_on!r} was given; a kind of port that the structure has is needed, "
                f"one of {', '.join(self.measured)}, since a law is read at its port: "
                "reach.law_as_measured()."
            )
        return self.measured[kind].copy()

    def any_law_within(self, low: float, high: float) -> Float[np.ndarray, "row"]:
        """Share of the misfit of a part of the band that any law could remove.

        All unknowns are refitted to that part, to first order about their fits to the whole band:
        it takes milliseconds.

        Parameters
        ----------
        low
            Least frequency [Hz]. Of many lines and unknowns a group of lines is taken as a whole.
        high
            Greatest frequency [Hz].

        Returns
        -------
        array
            A share [1] for each row of `curves`; zero where the model reaches the noise, and where
            there is no line.

        Raises
        ------
        InputError
            If no complex FRFs of one state were measured.
        """
        if self.in_bands is None:
            raise InputError(
                "Reach of amplitudes, modes, two states, many lines or a search was given; "
                "complex FRFs of one state at fewer lines are needed, since a law has two parts at "
                "each line: bp.reach(experiment, measurement) with observe=bp.observe.Complex()."
            )
        return self.in_bands.any_law(low, high)

    def to_json(self) -> list[Json]:
        """Return both curves over places for each kind of port, and its best law, for a file."""
        return [
            {
                "acts_on": acts_on,
                "best": {
                    "setting": str(row["setting"]),
                    "place_m": ends_in_metres(row),
                    "law": repr(row["law"]),
                    "law_tree": row["law"].tree(),
                    "probability": float(row["probability"]),
                    "chi2_per_datum": float(row["chi2_per_datum"]),
                },
                "curve": [
                    {
                        "setting": str(at["setting"]),
                        "place_m": ends_in_metres(at),
                        "any_law": float(at["any_law"]) if np.isfinite(at["any_law"]) else None,
                        "few_numbers": float(at["few_numbers"]),
                    }
                    for _, at in self.curves[self.curves["acts_on"] == acts_on].iterrows()
                ],
            }
            for acts_on, row in self.kinds().iterrows()
        ]

    def words(self) -> list[str]:
        """Where something may act, kind by kind, and how much it would explain.

        Where nothing of few numbers removes half of the misfit, that is told first; where the model
        reaches the noise, that alone.
        """
        if self.fails is False:
            what = "new since the baseline" if self.is_new else "missing"
            return [f"Nothing is seen to be {what}: the model reaches the noise without it."]
        kinds = self.kinds()
        first, *others = [
            *self._none_explains(kinds),
            *(
                f"{subject_in_words(acts_on, row)}: {row['law'].in_words()} removes "
                f"{row['few_numbers']:.0%} of the misfit"
                f"{self.chance(row['probability'])}{_by_any_law(row)}"
                f"{self._as_well(str(acts_on))}."
                for acts_on, row in kinds.iterrows()
            ),
            *([NONE_ALONE] if self.one_explains is False else []),
            *filter(None, [self.limits]),
        ]
        return [f"New since the baseline: {first}" if self.is_new else first, *others]

    def chance(self, share: float) -> str:
        """A probability in words and brackets; nothing where no law alone is right."""
        return "" if self.one_explains is False else f" ({probability_in_words(share)})"

    def _as_well(self, acts_on: str) -> str:
        """Between which places along a line the data do not tell where it acts, in words."""
        rows = self.as_good(acts_on)
        is_along = rows["y"].isna().all() and rows["to_x"].isna().all()
        low, high = rows["x"].min(), rows["x"].max()
        if not (is_along and low < high):
            return ""
        return f"; these data do not tell where between {1e3 * low:.0f} and {1e3 * high:.0f} mm"

    def _none_explains(self, kinds: pd.DataFrame) -> list[str]:
        if not self.fails or kinds["few_numbers"].max() >= HALF:
            return []
        few, any_law = kinds.drop(index=[*NOWHERE], errors="ignore")[
            ["few_numbers", "any_law"]
        ].max()
        found = (
            f"No single attachment explains this, whatever its law: the best place removes "
            f"{any_law:.0%}."
            if any_law < HALF
            else f"No single attachment of few numbers explains this: the best place removes "
            f"{few:.0%}{_by_any_law({'any_law': any_law})}."
        )
        return [f"{found} Look at supports, dimensions and further modes."]

    def __repr__(self) -> str:
        return f"Reach: reduced chi-square {three_digits(self.chi2_per_datum)}; {self.words()[0]}"

    def _repr_html_(self) -> str:
        return notebook_html(repr(self), self.kinds(), self.words()[1:])


def _by_any_law(row: Mapping[str, float] | pd.Series) -> str:
    """What any law could remove, in words; nothing of amplitudes."""
    return f", any law up to {row['any_law']:.0%}" if np.isfinite(row["any_law"]) else ""


def only_port(reach: Reach | None, acts_on: Sequence[str]) -> str | None:
    """Kind of port of one claimed effect, whose law was read; None of none, or of several.

    With several the law that is read on the model as given takes up what the others do. The factor
    of a channel is that of the most probable one, which need not be that of the effect.

    It is told by what each claimed effect acts on.
    """
    if reach is None or len(acts_on) != 1 or acts_on[0] in CHANNELS:
        return None
    return acts_on[0] if acts_on[0] in reach.measured else None


def reach_of(
    problem: Problem,
    fit: Fit,
    ports: Sequence[Reached],
    laws: Sequence[NamedLaw],
    with_bands: bool = False,
) -> Reach:
    """Lay out what laws at ports can do, and what factors on channels do.

    The laws are the best of them, fitted in full. What is left of bands takes slopes at all places.
    """
    channels, filters = reached_channels(problem, fit, laws)
    squares, reaches = fit.squares, [*ports, *channels]
    frees = {id(each.port): each.free for each in reaches if isinstance(each, ReachOfPort)}
    misses = fails(problem, squares)
    above = squares - (0 if misses is None else problem.count)
    curves = pd.concat([_curve(reached, squares, above) for reached in reaches])
    of_port = {id(reached.port): reached for reached in reaches}
    told = sorted(simplest([*laws, *filters]), key=lambda law: law.log_odds, reverse=True)
    table = pd.DataFrame([_law(law, of_port[id(law.port)], squares, above) for law in told])
    odds = np.array([law.log_odds for law in told])
    table["probability"] = np.exp(odds - logsumexp(odds))
    best = dict[str, NamedLaw]()
    for law in told:
        best.setdefault(law.port.acts_on, law)
    measured = {
        kind: as_measured(law, frees[id(law.port)].released())
        for kind, law in best.items()
        if tells_phase(problem)
    }
    chi2_per_datum = squares / problem.count
    leaves = fails(problem, told[0].fit.squares)
    return Reach(
        curves.reset_index(drop=True),
        table,
        chi2_per_datum,
        measured,
        misses,
        None if leaves is None else not leaves,
        is_new=problem.baseline is not None,
        limits=_limits(problem),
        in_bands=left_in_bands(problem, fit.point, reaches) if with_bands else None,
    )


def _limits(problem: Problem) -> str:
    """What data of this kind do not tell."""
    if problem.experiment.observe.is_modal:
        return OF_MODES
    return "" if tells_phase(problem) else OF_AMPLITUDES


def fails(problem: Problem, squares: float) -> bool | None:
    """Whether a sum of squares is more than that of noise; None where its level is unknown."""
    noise = problem.experiment.noise
    if noise is None or noise.deviation(problem.data) is None:
        return None
    return bool(chdtrc(problem.count, squares) < LEVEL)


def _curve(reached: Reached, squares: float, above: float) -> pd.DataFrame:
    """Rows of one kind of port on one piece."""
    freed, count = OF_LAW * reached.problem.data.z.shape[-1], reached.problem.count
    # What it takes of noise is known, or as large a share of what is left as of the data.
    by_noise = reached.squares * count / max(count - freed, 1)
    by_any = _share(reached.squares + freed if above < squares else by_noise, squares, above)
    by_few = _share(reached.squares_of_law, squares, above)
    places = where(reached.port, reached.problem, reached.points)
    evidence = reached.log_evidence
    return places.assign(any_law=by_any, few_numbers=by_few, log_evidence=evidence)


def _law(law: NamedLaw, reached: Reached, squares: float, above: float) -> dict[str, object]:
    """Row of a law that was fitted in full."""
    place = where(law.port, reached.problem, law.point[None]).iloc[0].to_dict()
    return {str(name): value for name, value in place.items()} | {
        "law": law.law,
        "few_numbers": float(_share(law.fit.squares, squares, above)),
        "chi2_per_datum": law.fit.squares / reached.problem.count,
    }


def _share(left: float | np.ndarray, squares: float, above: float) -> float | np.ndarray:
    """Share of the misfit above noise that is removed; zero where there is none.

    Of unknown noise, which the model may have taken for a misfit, that of all residuals.
    """
    return np.clip((squares - left) / above, 0.0, 1.0) if above > 0 else 0.0 * left
