"""Names of transducers that people and files confuse."""

from collections.abc import Iterator

from ...positions.names import look_alike
from .record import Fault, Pair, Record


def can_check(record: Record) -> bool:
    """Tell whether two names of one side look alike; else there is nothing to tell."""
    return any(check(record))


def check(record: Record) -> Iterator[Fault]:
    """Find names of one side that differ in case or in the form of letters alone."""
    for side, channels in enumerate((record.measurement.sensors, record.measurement.actuators)):
        names = [channel.name for channel in channels]
        for number, name in enumerate(names):
            hint = look_alike(name, names[:number]) if name not in names[:number] else ""
            if hint:
                pair = Pair(0, number) if side else Pair(number, 0)
                sentence = (
                    f"Two names are easily confused:{hint} Where they are one transducer, leave "
                    "one of them out; else give them other names."
                )
                yield record.fault(pair, 1.0, 0.0, sentence)
