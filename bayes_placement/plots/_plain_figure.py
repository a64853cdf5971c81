"""Figures that fit a page, in which a dollar is a dollar: names may hold any letter."""

import itertools
import re
import textwrap
import warnings
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import PlaceHolderLayoutEngine
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

_OF_AXES = re.compile(r"\$\\mathdefault\{(-?[\d.]+\\times)?-?[\d.]+\^\{-?[\d.]+\}\}\$")
"""A power, as logarithmic axes write it."""


_NOTHING = "\u200b"
"""A letter that is not seen, where the name of an unknown may break."""

WIDTH, HIGHEST = 180 / 25.4, 9.4
"""Greatest width and height of a figure [inch]: a page of A4 holds it with its caption."""

USUAL, LEAST = 10.0, 7.0
"""Usual and least size of letters [pt]."""

BETWEEN = 0.5
"""Least distance of two numbers along an axis, in heights of a letter."""


class PlainFigure(Figure):
    """A figure whose texts are taken letter by letter, powers of ten at logarithmic axes apart."""

    letters: float = 1.0
    """Factor on the size of letters of a figure that had to become narrower."""
    has_broken_names: bool = False
    """Whether long names were broken: once, since more lines leave less room for others."""

    @classmethod
    def on_page(cls, width: float, height: float, layout: Any = "constrained") -> "PlainFigure":
        """Return a figure of this size [inch], no wider than a page; its letters shrink with it."""
        figure = cls(figsize=(min(width, WIDTH), height), layout=layout)
        figure.letters = min(1.0, max(WIDTH / width, LEAST / USUAL))
        return figure

    def _shrink_letters(self) -> None:
        """Shrink letters once, none below the least size."""
        share, self.letters = self.letters, 1.0
        for axes in self.findobj(Axes):  # scales of colours, which stand within others, too
            axes.tick_params(which="both", labelsize=max(LEAST, USUAL * share))
        for text in self.findobj(Text):
            text.set_fontsize(max(LEAST, float(text.get_fontsize()) * share))

    def _keep_apart(self, renderer: Any) -> None:
        """Break names longer than their panels, once, and thin out numbers that collide."""
        self._lay_out()
        has_changed = False
        for axes in self.findobj(Axes):
            locator = axes.get_axes_locator()
            axes.apply_aspect(None if locator is None else locator(axes, renderer))
            if not self.has_broken_names:
                has_changed |= _break_names(axes, renderer)
            if axes.name != "3d":
                has_changed |= _thin_out(axes, renderer)
        self.has_broken_names = True
        if has_changed:
            self._lay_out()

    @property
    def _is_laid_out(self) -> bool:
        """Whether there is a layout, for which another one stands while a figure is written."""
        return not isinstance(self.get_layout_engine(), PlaceHolderLayoutEngine | None)

    def _lay_out(self) -> None:
        engine = self.get_layout_engine()
        if engine is not None:
            engine.execute(self)

    def draw(self, renderer: Any) -> None:
        """Draw it; what stands between two dollars is no formula."""
        if self.letters < 1:
            self._shrink_letters()
        for text in self.findobj(Text):
            if "$" in text.get_text() and not _OF_AXES.fullmatch(text.get_text()):
                text.set_parse_math(False)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing")  # a box stands in its place
            self._keep_apart(renderer)
            # A figure that is saved is drawn twice, at first for its layout alone.
            if not (self._is_laid_out and self.canvas.is_saving()):
                Figure.draw(self, renderer)


def _break_names(panel: Axes, renderer: Any) -> bool:
    """Break names longer than the room of a panel, which a map may not fill; whether there were."""
    upright, box = panel.yaxis.label, panel.bbox
    if panel.get_axes_locator() is None:
        box = panel.get_position(original=True).transformed(panel.figure.transSubfigure)
    lengths = [(upright, upright.get_window_extent(renderer).height, box.height)]
    for name in (panel.xaxis.label, panel.title):
        lengths.append((name, name.get_window_extent(renderer).width, box.width))
    longer = [each for each in lengths if each[1] > each[2]]
    for each in longer:
        _break(*each)
    return bool(longer)


def _break(name: Text, length: float, room: float) -> None:
    """Break the lines of a name, which has a length, so that they fit the room."""
    lines = name.get_text().split("\n")
    most = max(1, int(max(map(len, lines)) * room / length))
    name.set_text("\n".join(_wrapped(line, most) for line in lines))


def _wrapped(line: str, most: int) -> str:
    """A line in lines of so many letters; the name of an unknown breaks after a full stop."""
    words = re.sub(r"(?<=\.)(?=[a-z_])", f"{_NOTHING} ", line)
    broken = textwrap.fill(words, most, break_long_words=False)
    return broken.replace(f"{_NOTHING} ", "").replace(_NOTHING, "")


def _thin_out(panel: Axes, renderer: object) -> bool:
    """Take fewer numbers along the horizontal axis until they are apart; whether that was so."""
    locator, parts = panel.xaxis.get_major_locator(), 5
    if not isinstance(locator, MaxNLocator):
        return False
    while parts > 1 and not _are_apart(panel, renderer):
        parts -= 1
        locator.set_params(nbins=parts, min_n_ticks=1)
    return parts < 5


def _are_apart(panel: Axes, renderer: Any) -> bool:
    low, high = sorted(panel.get_xlim())
    shown = [text for text in panel.get_xticklabels() if low <= text.get_position()[0] <= high]
    boxes = sorted((text.get_window_extent(renderer) for text in shown), key=lambda box: box.x0)
    pairs = itertools.pairwise(box for box in boxes if box.width)
    return all(after.x0 - before.x1 > BETWEEN * before.height for before, after in pairs)
