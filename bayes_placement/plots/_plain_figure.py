"""Figures that fit a page, in which a dollar is a dollar: names may hold any letter."""

import itertools
import re
import textwrap
import warnings
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

_OF_AXES = re.compile(r"\$\\mathdefault\{(-?[\d.]+\\times)?-?[\d.]+\^\{-?[\d.]+\}\}\$")
"""A power, as logarithmic axes write it."""


_NOTHING = "\u200b"
"""A letter that is not seen, where the name of an unknown may break."""

WIDTH = 180 / 25.4
"""Greatest width of a figure [inch]: that of a page of A4 within its margins."""

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
        for axes in self.axes:
            axes.tick_params(which="both", labelsize=max(LEAST, USUAL * share))
        for text in self.findobj(Text):
            text.set_fontsize(max(LEAST, float(text.get_fontsize()) * share))

    def _keep_apart(self, renderer: object) -> None:
        """Break names longer than their panels, once, and thin out numbers that collide."""
        engine = self.get_layout_engine()
        if engine is not None:
            engine.execute(self)
        for axes in self.axes:
            axes.apply_aspect()
            if not self.has_broken_names:
                _break_names(axes, renderer)
            if axes.name != "3d":
                _thin_out(axes, renderer)
        self.has_broken_names = True

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
            Figure.draw(self, renderer)


def _break_names(panel: Axes, renderer: Any) -> None:
    """Break the names of a panel that are longer than it."""
    upright = panel.yaxis.label
    _break(upright, upright.get_window_extent(renderer).height, panel.bbox.height)
    for name in (panel.xaxis.label, panel.title):
        _break(name, name.get_window_extent(renderer).width, panel.bbox.width)


def _break(name: Text, length: float, room: float) -> None:
    """Break the lines of a name, which has a length, so that they fit the room."""
    if length > room:
        lines = name.get_text().split("\n")
        most = max(1, int(max(map(len, lines)) * room / length))
        name.set_text("\n".join(_wrapped(line, most) for line in lines))


def _wrapped(line: str, most: int) -> str:
    """A line in lines of so many letters; the name of an unknown breaks after a full stop."""
    words = re.sub(r"(?<=\.)(?=[a-z_])", f"{_NOTHING} ", line)
    broken = textwrap.fill(words, most, break_long_words=False)
    return broken.replace(f"{_NOTHING} ", "").replace(_NOTHING, "")


def _thin_out(panel: Axes, renderer: object) -> None:
    """Take fewer numbers along the horizontal axis until they are apart."""
    locator = panel.xaxis.get_major_locator()
    for parts in (4, 3, 2, 1):
        if not isinstance(locator, MaxNLocator) or _are_apart(panel, renderer):
            return
        locator.set_params(nbins=parts, min_n_ticks=1)


def _are_apart(panel: Axes, renderer: Any) -> bool:
    low, high = sorted(panel.get_xlim())
    shown = [text for text in panel.get_xticklabels() if low <= text.get_position()[0] <= high]
    boxes = sorted((text.get_window_extent(renderer) for text in shown), key=lambda box: box.x0)
    pairs = itertools.pairwise(box for box in boxes if box.width)
    return all(after.x0 - before.x1 > BETWEEN * before.height for before, after in pairs)
