"""Files of arrays with a mapping that says what they are, as measurements."""

from .channel_table import ChannelRow
from .importing import Imported, read, read_measurement
from .mapping import Mapping
from .measurement import ImportReport

__all__ = ["ChannelRow", "ImportReport", "Imported", "Mapping", "read", "read_measurement"]
