"""What is decided by of a fitted hypothesis: its row of numbers."""

from collections.abc import Iterator

import numpy as np

from ...effects.effect import Effect
from ...effects.instrument_effect import InstrumentEffect
from ...effects.library import kind_of
from ...inference.engines.about_mode import SampledPosterior
from ..check._edges import EDGE
from ._cautions import shares_at_edges
from ._estimates import PERCENTILES, drawn_places
from ._held_out import scores
from ._hypotheses import Hypothesis
from ._unknown_noise import gain_with_outliers, neumann_of, noise_needed
from .table import Box, Row


def row_of(hypothesis: Hypothesis, log_prior: float = 0.0) -> Row:
    """Return what the fit alone says."""
    row = Row(
        kinds=hypothesis.kinds,
        variants=hypothesis.variants,
        log_evidence=hypothesis.log_evidence,
        squares=float(hypothesis.fit.squares),
        data=int(hypothesis.problem.count),
        determined=float(hypothesis.fit.determined),
        log_prior=log_prior,
        effects=tuple(effect.name for effect in hypothesis.effects),
        is_noise_known=hypothesis.is_noise_known,
        has_errors=hypothesis.has_errors,
        states=1 if hypothesis.problem.baseline is None else 2,
        on_structure=any(not isinstance(each, InstrumentEffect) for each in hypothesis.effects),
        chi2_when_exact=float(hypothesis.chi2_when_exact),
    )
    if hypothesis.is_noise_known:
        return row
    return row._replace(
        neumann=neumann_of(hypothesis),
        outliers=hypothesis.with_outliers.outliers,
        gain_with_outliers=gain_with_outliers(hypothesis),
    )


def places_of(hypothesis: Hypothesis) -> Iterator[tuple[str, Box]]:
    """Where each effect that has a place acts: 95 % intervals over the size of the structure.

    Of a part its middle, of a strut both ends.
    """
    experiment = hypothesis.problem.experiment
    placed = {effect.name: effect for effect in experiment.effects}
    size = np.max(np.subtract(*experiment.structure.modes.bounds()[::-1]))
    for effect in hypothesis.effects:
        places = drawn_places(placed[effect.name], hypothesis)
        if places:
            if len(effect.place_fields) < 2:
                places = [np.mean(places, axis=0)]
            first, last = (np.percentile(places, side, axis=1) / size for side in PERCENTILES)
            corners = first.min(axis=0), last.max(axis=0)
            low, high = (tuple(map(float, corner)) for corner in corners)
            yield kind_of(effect), (low, high)


def row_with_sizes(hypothesis: Hypothesis) -> Row:
    """Return what the fit alone says, and the sizes of the model error."""
    return row_of(hypothesis)._replace(sizes=tuple(_sizes_of_errors(hypothesis)))


def row_in_full(row: Row, hypothesis: Hypothesis, posterior: SampledPosterior | None) -> Row:
    """Return a row with what takes time: noise, sizes of errors, held-out scores, edges."""
    needed = noise_needed(hypothesis)
    return row._replace(
        noise=np.nan if needed is None else needed.relative,
        sizes=tuple(_sizes_of_errors(hypothesis)),
        held_out=tuple(map(float, scores(hypothesis))),
        edges=tuple(_edges(hypothesis, None if posterior is None else posterior.points)),
    )


def _sizes_of_errors(hypothesis: Hypothesis) -> Iterator[tuple[str, float, float]]:
    for unknown in hypothesis.problem.unknown_sizes:
        size = hypothesis.problem.sizes[unknown.name]
        yield unknown.name, float(size), float(unknown.distribution.cdf(size))


def _edges(hypothesis: Hypothesis, points: np.ndarray | None) -> Iterator[tuple[str, str, float]]:
    """Posterior over prior probability at the edges of the sizes of effects."""
    shares = list(shares_at_edges(hypothesis, points)) if hypothesis.effects else []
    for effect in hypothesis.effects:
        sizes = _sizes(effect, hypothesis)
        for name, side, share in shares:
            if name.partition("[")[0] in sizes:
                yield effect.name, side, share / EDGE


def _sizes(effect: Effect, hypothesis: Hypothesis) -> set[str]:
    """Names of the unknowns that say how large an effect is: its strength, or those of its law."""
    unknowns = hypothesis.problem.experiment.unknowns_of(effect)
    fields = {effect.absent[0], "law"}
    return {unknown.name for unknown in unknowns if unknown.field in fields}
