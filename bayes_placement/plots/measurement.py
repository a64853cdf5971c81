"""Figures of a measurement before anything is fitted: magnitude, phase and coherence."""

import numpy as np
from matplotlib.figure import Figure

from .._types import arguments_checked
from ..experiment.measurement import Measurement
from ..experiment.quantities import quantity_of
from ._colours import DATA
from ._figures import panels

MOST_PAIRS = 4
"""Pairs of channels on a page."""

SIZE = (4.2, 2.2)


@arguments_checked
def pages(measurement: Measurement) -> list[Figure]:
    """Draw all FRFs, four pairs of channels on a page.

    Parameters
    ----------
    measurement
        What was measured.

    Examples
    --------
    >>> len(bp.plots.measurement.pages(measured))
    1
    """
    pairs = [(int(row), int(column)) for row, column in np.argwhere(measurement.measured)]
    starts = range(0, len(pairs), MOST_PAIRS)
    return [_page(measurement, pairs[start : start + MOST_PAIRS]) for start in starts]


def _page(measurement: Measurement, pairs: list[tuple[int, int]]) -> Figure:
    """Magnitude [dB], phase [degrees] and, where it is known, coherence of some pairs."""
    rows = 2 if measurement.coherence is None else 3
    layout = panels(rows, len(pairs), heights=[1.2, 0.8, 0.6][:rows], size=SIZE)
    unit = quantity_of(measurement.quantity).ascii_unit
    for number, (row, column) in enumerate(pairs):
        frf, lines = measurement.frf[row, column], measurement.frequency
        title = f"{measurement.sensors[row].label} / {measurement.actuators[column].label}"
        with np.errstate(divide="ignore"):
            decibels = 20 * np.log10(np.abs(frf))
        curves = [decibels, np.degrees(np.angle(frf))]
        if measurement.coherence is not None:
            curves.append(measurement.coherence[row, column])
        for panel, curve in zip(layout.axes[:, number], curves, strict=True):
            shown = np.where(np.isfinite(curve), curve, np.nan)
            panel.plot(lines, shown, color=DATA, linewidth=1.0)
        layout.axes[0, number].set_title(title, fontsize="small")
        layout.axes[-1, number].set_xlabel("frequency [Hz]")
        layout.axes[1, number].set_yticks([-180, -90, 0, 90, 180])
    labels = (f"magnitude\n[dB re 1 {unit}]", "phase [°]", "coherence [1]")
    for panel, label in zip(layout.axes[:, 0], labels, strict=False):
        panel.set_ylabel(label)
    for panel in layout.axes[2:].flat:
        panel.set_ylim(-0.02, 1.02)
    figure: Figure = layout.figure
    return figure
