"""The set-up of the test: what was measured, with which channels."""

from collections.abc import Iterator

from .._saved import Saved
from ..content import Item, Table
from ..report import SET_UP

TAGS = ("set-up",)

COLUMNS = ("channels", "kind", "recorded position [m]", "gain on its FRFs [1]")


def items(saved: Saved) -> Iterator[Item]:
    """List what was measured, and the channels."""
    known = saved.about.get("set_up")
    if known is None:
        return
    facts = Table(("what", "as measured"), tuple(map(tuple, known["facts"])))
    yield Item(SET_UP, "Measurement", facts, tags=TAGS)
    channels = Table(COLUMNS, tuple(map(tuple, known["channels"])))
    words = "The sign and the letter of a channel are its direction; a gain of 1 is exact."
    yield Item(SET_UP, "Channels", channels, words, TAGS)
