"""Texts of a figure that cover each other, or stand out of it."""

import itertools

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text


def colliding(figure):
    """Pairs of texts of which one covers the other, and texts that stand out of the figure."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    hidden = {id(text) for axes in figure.axes for text in _not_drawn(axes)}
    boxes = [
        (text.get_text(), Text.get_window_extent(text, canvas.get_renderer()))
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden
    ]
    pairs = [
        (first, second)
        for (first, one), (second, other) in itertools.combinations(boxes, 2)
        if min(one.x1, other.x1) - max(one.x0, other.x0) > 0
        and min(one.y1, other.y1) - max(one.y0, other.y0) > 0
    ]
    width, height = figure.bbox.size
    outside = [
        name
        for name, box in boxes
        if min(box.x0, box.y0) < -1 or box.x1 > width + 1 or box.y1 > height + 1
    ]
    return pairs, outside


def _not_drawn(axes):
    """Numbers beyond the ends of an axis, and those of axes that are off."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.majorTicks, *axis.minorTicks):
            drawn = axes.axison and low <= tick.get_loc() <= high
            yield from () if drawn else (tick.label1, tick.label2)
        kept = {id(tick) for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())}
        for tick in (*axis.majorTicks, *axis.minorTicks):
            yield from () if id(tick) in kept else (tick.label1, tick.label2)
        if not axes.axison:
            yield axis.label
