"""Mistaken records: those far more like responses of the structure once a mistake is undone."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.special import logsumexp

from ...positions.bounds import in_space
from ...positions.channel import Channel
from ...positions.places import AtNode, Cartesian, coordinates
from ...positions.vectors import triple
from .._noise_level import FEWEST_LINES
from ..observe import LogAmplitude
from ..quantities import quantity_of
from .mistakes import (
    AS_GIVEN,
    Mistake,
    Records,
    from_other_end,
    like_nothing,
    log_likelihoods,
    mistakes,
    swapped,
)
from .record import PLACE_PRECISION, Fault, Pair, Record, prior_responses

if TYPE_CHECKING:
    from ..experiment import Experiment


SIDES_TOGETHER = (("sensor",), ("actuator",), ("sensor", "actuator"))
"""Whose places may have been measured so."""


class OtherEnd(NamedTuple):
    """Sides whose places are measured from the other end of an axis."""

    sides: Sequence[str]
    axis: int

    def of(self, model: "Experiment") -> "Experiment":
        """A model whose places are numbers, those of these sides measured so."""
        total = sum(self._ends(model))
        for side in self.sides:
            for name, transducer in getattr(model, side).items():
                place = np.array(coordinates(transducer.position), ndmin=1)
                place[self.axis] = total - place[self.axis]
                at = Cartesian(*place) if place.size > 1 else place[0]
                model = eqx.tree_at(partial(_place, side=side, name=name), model, at)
        return model

    def mistake(self, model: "Experiment") -> Mistake:
        """The mistake in words, by the ends of a model."""
        axis = "xyz"[self.axis] if in_space(model.structure.modes.bounds()) else ""
        return from_other_end(self.sides, axis, self._ends(model))

    def _ends(self, model: "Experiment") -> tuple[float, float]:
        low, high = map(np.atleast_1d, model.structure.modes.bounds())
        return float(low[self.axis]), float(high[self.axis])


def other_ends(model: "Experiment") -> Iterator[OtherEnd]:
    """All that leave each transducer on the structure, where shapes are known between nodes."""
    low, high = map(np.atleast_1d, model.structure.modes.bounds())
    if _lies_on_structure(model):
        for axis in np.flatnonzero(low < high).tolist():
            ends = [OtherEnd(sides, axis) for sides in SIDES_TOGETHER]
            yield from (end for end in ends if _lies_on_structure(end.of(model)))


def _place(model: "Experiment", side: str, name: str) -> object:
    return getattr(model, side)[name].position


def _lies_on_structure(model: "Experiment") -> bool:
    modes = model.structure.modes
    places = [each.position for each in (*model.sensor.values(), *model.actuator.values())]
    if not in_space(modes.bounds()):
        return True
    if any(isinstance(place, AtNode) for place in places):
        return False
    frames = [piece.frame() for piece in modes.anywhere()]
    at = [triple(coordinates(place)) for place in places]
    apart = [min((frame.distance(place) for frame in frames), default=np.inf) for place in at]
    return max(apart) <= PLACE_PRECISION * float(np.max(np.subtract(*modes.bounds()[::-1])))


MISTAKEN = 0.01
"""Prior probability that a record is mistaken, shared by all mistakes."""

LEAST_ODDS = 20.0
"""Posterior odds, against the record as given, from which on a mistake is named."""

MOST = 0.5
"""Share of pairs, or of a distance, above which it is most of it."""

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

    def apart(self) -> float:
        """Mean distance of the logarithms of record and model at the nearest draw, gains apart."""
        model = self.responses[1.0][:, self.places[:, 0], self.places[:, 1]]
        apart = np.log(np.abs(self.frf / model))
        apart -= np.median(apart, axis=-1, keepdims=True)
        return float(np.abs(apart).mean(axis=(1, 2)).min())

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
        *_of_other_ends(record, compared),
    ]
    prior = np.log(MISTAKEN / len(hypotheses))
    likely = [
        (_evidence(hypothesis.log_likelihood) - known + prior, hypothesis)
        for hypothesis in hypotheses
        if _holds_for_most(hypothesis, as_given)
    ]
    likely.sort(key=lambda item: -item[0])
    if likely and (log_odds := likely[0][0]) > np.log(LEAST_ODDS):
        alike = [each for odds, each in likely if log_odds - odds < np.log(LEAST_ODDS)]
        yield _fault(record, compared, alike, log_odds / np.log(10))


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


def _of_other_ends(record: Record, compared: _Compared) -> Iterator[_Hypothesis]:
    """Sensors, actuators, or both at places that were measured from the other end of an axis.

    Responses from there must be half as far from the record: from either end of a structure that
    is nearly symmetric, errors of its model decide, which all records have in common.
    """
    nominal, *_ = models = record.prior_models
    as_nominal = compared._replace(responses={1.0: compared.responses[1.0][:1]}).apart()
    for end in other_ends(nominal):
        # Responses at all draws take long.
        if _of_models(record, compared, [end.of(nominal)]).apart() < as_nominal:
            there = _of_models(record, compared, map(end.of, models))
            if there.apart() < MOST * compared.apart():
                pairs, likelihood = np.ones(len(there.places), bool), there.log_likelihood(AS_GIVEN)
                yield _Hypothesis(end.mistake(nominal), pairs, likelihood)


def _of_models(record: Record, compared: _Compared, models: "Iterable[Experiment]") -> _Compared:
    """The same beside responses of other models."""
    nominal, draws = prior_responses(record, compared.frequency, models)
    return compared._replace(responses={1.0: _without_zeros(np.stack([nominal, *draws]))})


def _evidence(likelihood: Likelihoods) -> float:
    """Logarithm of the mean likelihood of all pairs over the draws."""
    return float(logsumexp(likelihood.sum(axis=1)) - np.log(len(likelihood)))


def _holds_for_most(hypothesis: _Hypothesis, as_given: Likelihoods) -> bool:
    better = logsumexp(hypothesis.log_likelihood, axis=0) > logsumexp(as_given, axis=0)
    held = better[hypothesis.pairs]
    return bool(held.mean() > MOST)


def _fault(
    record: Record, compared: _Compared, alike: Sequence[_Hypothesis], log10_odds: float
) -> Fault:
    """Say what the record looks like: of a symmetric structure perhaps like one of several."""
    pairs = [Pair(*map(int, place)) for place in compared.places[alike[0].pairs]]
    looks = ", or ".join(each.mistake.words for each in alike)
    remedies = "; or ".join(each.mistake.remedy for each in alike)
    odds = f"{10**log10_odds:.0f}" if log10_odds < 3 else f"1e{int(log10_odds)}"
    return record.fault(
        pairs[0],
        log10_odds,
        float(np.log10(LEAST_ODDS)),
        f"{record.whose(pairs)} look {looks}: undone, they are more like responses of this "
        f"structure, at odds of {odds} to 1; {remedies}.",
    )
