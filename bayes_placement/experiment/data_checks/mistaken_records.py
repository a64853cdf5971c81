"""Mistaken records: those far more like responses of the structure once a mistake is undone."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.special import logsumexp

from ...positions.channel import Channel
from .._noise_level import FEWEST_LINES
from ..observe import LogAmplitude
from ..quantities import quantity_of
from .mistakes import AS_GIVEN, Mistake, Records, like_nothing, log_likelihoods, mistakes, swapped
from .record import Fault, Pair, Record, prior_responses

MISTAKEN = 0.01
"""Prior probability that a record is mistaken, shared by all mistakes."""

LEAST_ODDS = 20.0
"""Posterior odds, against the record as given, from which on a mistake is named."""

MOST = 0.5
"""Share of pairs above which it is most of them."""

MOST_VALUES = 8000
"""Most values of a record that are compared: of more lines every second, or third, is."""

Pairs = Bool[np.ndarray, "pair"]
Rows = Sequence[int]
Likelihoods = Float[np.ndarray, "draw pair"]
Responses = Complex[np.ndarray, "draw sensor actuator frequency"]


class _Hypothesis(NamedTuple):
    """A mistake of some pairs, and the logarithm of the likelihood of all pairs with it."""

    mistake: Mistake
    pairs: Pairs
    log_likelihood: Likelihoods


class _Compared(NamedTuple):
    """Records at the places of their channels, beside responses of the model at draws by axis."""

    frf: Records
    frequency: Float[np.ndarray, "frequency"]
    places: Int[np.ndarray, "pair 2"]
    has_phase: bool
    resonant: Pairs
    responses: dict[float, Responses]

    def log_likelihood(self, mistake: Mistake) -> Likelihoods:
        """Logarithm of the likelihood of each pair, if each has a mistake."""
        model = self.responses[mistake.axis][:, self.places[:, 0], self.places[:, 1]]
        return log_likelihoods(self.frf, self.frequency, model, mistake, self.has_phase)

    def of(self, pairs: Pairs, places: Int[np.ndarray, "pair 2"]) -> "_Compared":
        """Some of the pairs, compared with responses at the places of others."""
        return self._replace(
            frf=self.frf[pairs], places=places[pairs], resonant=self.resonant[pairs]
        )


def can_check(record: Record) -> bool:
    """Tell whether there are lines enough."""
    return int((record.frequency > 0).sum()) >= FEWEST_LINES and bool(_present(record).any())


def check(record: Record) -> Iterator[Fault]:
    """Find the mistake that makes a record far more like responses of the model once undone.

    Each is a hypothesis, whose likelihood is that at draws from the priors, with an error of the
    model, a gain and a polarity of each pair that are unknown. It must hold for most of its pairs,
    and beat the record as given and one like no response, a power of the frequency.
    """
    compared, names = _compared(record), mistakes(record.measurement.quantity)
    as_given = compared.log_likelihood(AS_GIVEN)
    nothing = like_nothing(compared.frf, compared.frequency, compared.has_phase).sum()
    known = np.logaddexp(_evidence(as_given), nothing)
    hypotheses = [
        *_of_all_and_parts(compared, names, as_given),
        *_of_swapped(record, compared, as_given),
    ]
    prior = np.log(MISTAKEN / len(hypotheses))
    likely = [
        (_evidence(hypothesis.log_likelihood) - known + prior, hypothesis)
        for hypothesis in hypotheses
        if _holds_for_most(hypothesis, as_given)
    ]
    log_odds, best = max(likely, key=lambda item: item[0], default=(-np.inf, None))
    if best is not None and log_odds > np.log(LEAST_ODDS):
        yield _fault(record, compared, best, log_odds / np.log(10))


def _present(record: Record) -> Bool[np.ndarray, "sensor actuator"]:
    return record.measured & np.any(np.nan_to_num(record.frf), axis=-1)


def _compared(record: Record) -> _Compared:
    present = _present(record)
    lines = np.flatnonzero(record.frequency > 0)
    lines = lines[:: 1 + int(present.sum()) * lines.size // MOST_VALUES]
    frequency = record.frequency[lines]
    frf = _without_zeros(record.frf[present][:, lines])
    axes = sorted({mistake.axis for mistake in mistakes(record.measurement.quantity)})
    return _Compared(
        frf,
        frequency,
        np.argwhere(present),
        not isinstance(record.experiment.observe, LogAmplitude),
        _resonant(frf, frequency, quantity_of(record.measurement.quantity).derivative),
        _responses(record, frequency, axes),
    )


def _resonant(frf: Records, frequency: Float[np.ndarray, "frequency"], derivative: int) -> Pairs:
    """Whether a pair has lines within the half-power bandwidth of a resonance.

    There displacement is more in quadrature with the force than in phase, at amplitudes above the
    median; where such lines were left out, a lag of the instruments alone tells the sense of time.
    """
    displacement = frf / (2j * np.pi * frequency) ** derivative
    in_quadrature = np.abs(displacement.imag) >= np.abs(displacement.real)
    size = np.abs(displacement)
    return np.any(in_quadrature & (size > np.median(size, axis=-1, keepdims=True)), axis=-1)


def _responses(
    record: Record, frequency: Float[np.ndarray, "frequency"], axes: list[float]
) -> dict[float, Responses]:
    """Responses of the model at draws, where lines of the record are those of each axis."""
    nominal, draws = prior_responses(record, np.concatenate([frequency / axis for axis in axes]))
    by_axis = np.split(np.stack([nominal, *draws]), len(axes), axis=-1)
    return {axis: _without_zeros(frf) for axis, frf in zip(axes, by_axis, strict=True)}


def _without_zeros(frf: np.ndarray) -> np.ndarray:
    """Values whose logarithm is finite: a part of 1e-9 of the greatest for zero."""
    return np.where(frf == 0, 1e-9 * np.abs(frf).max() + np.finfo(float).tiny, frf)


def _of_all_and_parts(
    compared: _Compared, names: list[Mistake], as_given: Likelihoods
) -> Iterator[_Hypothesis]:
    """Each mistake of all pairs, and of those of one sensor or actuator channel."""
    for mistake in names:
        likelihood = compared.log_likelihood(mistake)
        for pairs in _parts(compared.places) if mistake.is_of_parts else _all(compared.places):
            if not mistake.turns_time or compared.resonant[pairs].mean() > MOST:
                yield _Hypothesis(mistake, pairs, np.where(pairs, likelihood, as_given))


def _all(places: Int[np.ndarray, "pair 2"]) -> list[Pairs]:
    return [np.ones(len(places), bool)]


def _parts(places: Int[np.ndarray, "pair 2"]) -> list[Pairs]:
    channels = [side == number for side in places.T for number in np.unique(side)]
    return [*_all(places), *(pairs for pairs in channels if not pairs.all())]


def _of_swapped(
    record: Record, compared: _Compared, as_given: Likelihoods
) -> Iterator[_Hypothesis]:
    """Each two transducers, or channels of one, of which each has the record of the other."""
    for side, channels in enumerate((record.measurement.sensors, record.measurement.actuators)):
        for mistake, rows, others in _exchanged("sensor" if side == 0 else "actuator", channels):
            order = np.arange(len(channels))
            order[[*rows, *others]] = [*others, *rows]
            places = compared.places.copy()
            places[:, side] = order[places[:, side]]
            pairs = places[:, side] != compared.places[:, side]
            if pairs.any():  # else neither of the two was measured
                likelihood = as_given.copy()
                likelihood[:, pairs] = compared.of(pairs, places).log_likelihood(AS_GIVEN)
                yield _Hypothesis(mistake, pairs, likelihood)


def _exchanged(side: str, channels: Sequence[Channel]) -> Iterator[tuple[Mistake, Rows, Rows]]:
    """Two transducers with as many channels, or two channels of one, and their numbers."""
    rows: dict[str, list[int]] = {}
    for row, channel in enumerate(channels):
        rows.setdefault(channel.name, []).append(row)
    for first, second in combinations(rows, 2):
        if len(rows[first]) == len(rows[second]):
            yield swapped(first, second, side), rows[first], rows[second]
    for of_one in rows.values():
        for row, other in combinations(of_one, 2):
            yield swapped(channels[row].label, channels[other].label), [row], [other]


def _evidence(likelihood: Likelihoods) -> float:
    """Logarithm of the mean likelihood of all pairs over the draws."""
    return float(logsumexp(likelihood.sum(axis=1)) - np.log(len(likelihood)))


def _holds_for_most(hypothesis: _Hypothesis, as_given: Likelihoods) -> bool:
    better = logsumexp(hypothesis.log_likelihood, axis=0) > logsumexp(as_given, axis=0)
    held = better[hypothesis.pairs]
    return bool(held.mean() > MOST)


def _fault(record: Record, compared: _Compared, best: _Hypothesis, log10_odds: float) -> Fault:
    pairs = [Pair(*map(int, place)) for place in compared.places[best.pairs]]
    odds = f"{10**log10_odds:.0f}" if log10_odds < 3 else f"1e{int(log10_odds)}"
    return record.fault(
        pairs[0],
        log10_odds,
        float(np.log10(LEAST_ODDS)),
        f"{record.whose(pairs)} look {best.mistake.words}: undone, they are more like responses of "
        f"this structure, at odds of {odds} to 1; {best.mistake.remedy}.",
    )
