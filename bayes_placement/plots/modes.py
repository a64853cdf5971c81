"""Figure of measured modal parameters beside those of models."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from ._colours import AFTER, BEFORE, DATA, FIFTH, FOURTH, INK
from ._figures import PAGE, panels
from ._fit_panels import (
    Colours,
    draw_assurance,
    draw_damping,
    draw_frequencies,
    has_damping,
    with_shapes,
)
from ._fits import Fits, fits_of

COLOURS = Colours(DATA, (BEFORE, AFTER, FOURTH, FIFTH), square=AFTER, ink=INK)
"""As in the other figures of data, and of models before and after."""

ONE_MODEL = COLOURS._replace(models=(AFTER,))

SIZE = (4.8, 3.4)
"""Width and height of a panel [inch]."""

COLUMNS = 2
"""Panels beside each other, as long as those below each other are no higher than a page."""


@arguments_checked
def compared(result: Fits, *, axes: Sequence[Axes] | np.ndarray | None = None) -> Figure:
    """Draw natural frequencies, damping ratios and the modal assurance criterion of models.

    Intervals of what was measured hold 95 %. A frame stands around the mode of the model that each
    measured one is paired with.

    Parameters
    ----------
    result
        What `improve` returned of modal parameters; or by the name of a model what
        `criticism.fitted_modes.fitted_modes` returned.
    axes
        Axes to draw in: natural frequencies, damping ratios where some were measured, and for each
        model with shapes one of the modal assurance criterion; None for a new figure.

    Raises
    ------
    InputError
        If no model is given, or what is given is none of modes.

    Examples
    --------
    >>> from bayes_placement.criticism.fitted_modes import fitted_modes
    >>> modes = bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2])
    >>> modal = bp.Experiment(
    ...     structure,
    ...     sensors=[],
    ...     observe=bp.observe.ModalData(modes),
    ...     noise=bp.noise.FromVariance(),
    ... )
    >>> fit = fitted_modes(modal, modes, {"structure.damping.ratio": 0.04})
    >>> bp.plots.modes.compared({"as given": fit}).axes[0].get_xlabel()
    'measured mode, natural frequency [Hz]'
    """
    fits = fits_of(result)
    if not fits or not all("natural_frequency" in fit for fit in fits.values()):
        raise InputError(
            f"modes.compared was given {'other data than modes' if fits else 'no model'}; modes of "
            "one model at least are needed, since measured ones are drawn beside them: "
            'compared({"as given": fitted_modes(experiment, modes, values)}).'
        )
    colours = COLOURS if len(fits) > 1 else ONE_MODEL
    shaped = with_shapes(fits)
    drawn = [draw_frequencies, draw_damping] if has_damping(fits) else [draw_frequencies]
    count = len(drawn) + len(shaped)
    columns = max(min(count, COLUMNS), -(-count // int(PAGE // SIZE[1])))
    if axes is None:
        layout = panels(-(-count // columns), columns, size=SIZE)
    else:
        layout = panels(1, count, axes)
    flat = list(layout.axes.flat)
    for panel, draw in zip(flat, drawn, strict=False):
        draw(panel, fits, colours)
    for panel, (name, fit) in zip(flat[len(drawn) :], shaped.items(), strict=False):
        draw_assurance(panel, fit, colours)
        panel.set_title(f"modal assurance criterion, {name}", fontsize="small")
    for panel in flat[count:]:
        panel.set_axis_off()
    return layout.with_legend()
