"""Figures in few colours, a quarter of the size."""

import io

from PIL import Image

COLORS = 256


def small(png):
    """Return a PNG with a palette, from the bytes of another one."""
    image = Image.open(io.BytesIO(png)).convert("RGB")
    held = io.BytesIO()
    # The median cut would lose rare colours, such as that of a star that marks a place.
    few = image.quantize(COLORS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(held, "png", optimize=True)
    return held.getvalue()
