"""Figures that fit a page, in which a dollar is a dollar: names may hold any letter."""

import re
import warnings
from typing import Any

from matplotlib.figure import Figure
from matplotlib.text import Text

_OF_AXES = re.compile(r"\$\\mathdefault\{(-?[\d.]+\\times)?-?[\d.]+\^\{-?[\d.]+\}\}\$")
"""A power, as logarithmic axes write it."""


WIDTH = 180 / 25.4
"""Greatest width of a figure [inch]: that of a page of A4 within its margins."""

USUAL, LEAST = 10.0, 7.0
"""Usual and least size of letters [pt]."""


class PlainFigure(Figure):
    """A figure whose texts are taken letter by letter, powers of ten at logarithmic axes apart."""

    letters: float = 1.0
    """Factor on the size of letters of a figure that had to become narrower."""

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

    def draw(self, renderer: Any) -> None:
        """Draw it; what stands between two dollars is no formula."""
        if self.letters < 1:
            self._shrink_letters()
        for text in self.findobj(Text):
            if "$" in text.get_text() and not _OF_AXES.fullmatch(text.get_text()):
                text.set_parse_math(False)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing")  # a box stands in its place
            Figure.draw(self, renderer)
