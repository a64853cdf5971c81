"""Colours of all figures, which differ for the colour-blind as well (Okabe and Ito)."""

from typing import Any, TypeAlias

INK, PAPER = "#000000", "#ffffff"
BEFORE, AFTER, DATA, FLOOR, FAINT = "#d55e00", "#0072b2", "#cc3377", "#7f7f7f", "#d9d9d9"
FOURTH, FIFTH = "#009e73", "#e69f00"

Style: TypeAlias = dict[str, Any]
"""Properties of what matplotlib draws, by their names."""
