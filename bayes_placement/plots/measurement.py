"""Figures of a measurement before anything is fitted: magnitude, phase and coherence."""

import numpy as np
from matplotlib.figure import Figure

from .._shared.arguments import arguments_checked
from ..experiment.measurement import Measurement
from ..experiment.quantities import quantity_of
from ._colours import BEFORE, DATA
from ._figures import panels, unbroken

MOST_PAIRS = 4
"""Pairs of channels on a page."""

SIZE = (4.2, 2.2)


@arguments_checked
def pages(measurement: Measurement, *, model: Measurement | None = None) -> list[Figure]:
    """Draw all FRFs, four pairs of channels on a page.

    Parameters
    ----------
    measurement
        What was measured.
    model
        FRFs of a model, at any lines, which are drawn over those of the same channels:
        `experiment.nominal_measurement()`.

    Examples
    --------
    >>> len(bp.plots.measurement.pages(measured, model=experiment.nominal_measurement()))
    1
    """
    pairs = [(int(row), int(column)) for row, column in np.argwhere(measurement.measured)]
    starts = range(0, len(pairs), MOST_PAIRS)
    compared = None if model is None else model.converted(measurement.quantity)
    return [_page(measurement, pairs[start : start + MOST_PAIRS], compared) for start in starts]


def _page(
    measurement: Measurement, pairs: list[tuple[int, int]], model: Measurement | None
) -> Figure:
    """Magnitude [dB], phase [degrees] and, where it is known, coherence of some pairs."""
    rows = 2 if measurement.coherence is None else 3
    layout = panels(rows, len(pairs), heights=[1.2, 0.8, 0.6][:rows], size=SIZE)
    for column, pair in zip(layout.axes.T, pairs, strict=True):
        sensor, actuator = measurement.sensors[pair[0]], measurement.actuators[pair[1]]
        _draw(column, measurement, pair, color=DATA, label="measured")
        if model is not None and sensor in model.sensors and actuator in model.actuators:
            same = model.sensors.index(sensor), model.actuators.index(actuator)
            _draw(column, model, same, color=BEFORE, label="model as drawn")
        column[0].set_title(f"{sensor.label} / {actuator.label}", fontsize="small")
        column[-1].set_xlabel("frequency [Hz]")
        column[1].set_yticks([-180, -90, 0, 90, 180])
    unit = quantity_of(measurement.quantity).unit
    labels = (f"magnitude\n[dB re 1 {unit}]", "phase [°]", "coherence [1]")
    for panel, label in zip(layout.axes[:, 0], labels, strict=False):
        panel.set_ylabel(label)
    for panel in layout.axes[2:].flat:
        panel.set_ylim(-0.02, 1.02)
    return layout.figure if model is None else layout.with_legend()


def _draw(
    column: np.ndarray, measurement: Measurement, pair: tuple[int, int], **style: str
) -> None:
    """Draw what is known of a pair of channels, a panel each."""
    frf = measurement.frf[pair]
    with np.errstate(divide="ignore"):
        curves = [20 * np.log10(np.abs(frf)), unbroken(np.degrees(np.angle(frf)))]
    if measurement.coherence is not None:
        curves.append(measurement.coherence[pair])
    for panel, curve in zip(column, curves, strict=False):
        shown = np.where(np.isfinite(curve), curve, np.nan)
        panel.plot(measurement.frequency, shown, linewidth=1.0, **style)
