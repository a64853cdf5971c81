"""Figures in which a dollar is a dollar: names of sensors and effects may hold any letter."""

import re
import warnings
from typing import Any

from matplotlib.figure import Figure
from matplotlib.text import Text

_OF_AXES = re.compile(r"\$\\mathdefault\{(-?[\d.]+\\times)?-?[\d.]+\^\{-?[\d.]+\}\}\$")
"""A power, as logarithmic axes write it."""


class PlainFigure(Figure):
    """A figure whose texts are taken letter by letter, powers of ten at logarithmic axes apart."""

    def draw(self, renderer: Any) -> None:
        """Draw it; what stands between two dollars is no formula."""
        for text in self.findobj(Text):
            if "$" in text.get_text() and not _OF_AXES.fullmatch(text.get_text()):
                text.set_parse_math(False)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing")  # a box stands in its place
            Figure.draw(self, renderer)
