"""Channels: one signal of a transducer each, named by labels such as s1+x; what a name may be."""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from .._shared.arguments import check_annotated, check_kind
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr


@with_short_repr
class Channel(NamedTuple):
    """One signal of a sensor or an actuator: its transducer and the recorded direction.

    Parameters
    ----------
    name
        Name of the transducer.
    direction
        Recorded direction: +-1, +-2, +-3 for +-x, +-y, +-z; 0 where it is not stated.

    Examples
    --------
    >>> bp.Channel("s1", 3).label, bp.Channel.parse("s1-x")
    ('s1+z', Channel(name='s1', direction=-1))
    """

    name: str
    direction: int = 0

    @property
    def label(self) -> str:
        """Name and direction as one word: `s1` where no direction is stated, `s1+x`, `s1-z`."""
        if self.direction == 0:
            return self.name
        return f"{self.name}{'-' if self.direction < 0 else '+'}{'xyz'[abs(self.direction) - 1]}"

    @classmethod
    def parse(cls, label: "str | Channel") -> "Channel":
        """Read a label such as `s1` or `s1+x`; a channel is returned as it is.

        Raises
        ------
        InputError
            If the label has no name, or the direction is not one of -3 to 3.
        """
        if isinstance(label, Channel):
            return checked(label)
        needed = "the label of a channel is needed, since channels are matched by name"
        check_kind("channel", label, str, needed, "'s1', or 's1+x' with its direction")
        match = re.fullmatch(r"(?P<name>.+?)(?P<direction>[+-][xyz])?", label.strip())
        if match is None:
            raise InputError(
                f"The channel label {label!r} was given; it needs the name of a transducer, since "
                "channels are matched by name: 's1', or 's1+x' with its direction."
            )
        stated = match["direction"]
        direction = "xyz".index(stated[1]) + 1 if stated else 0
        return cls(match["name"], -direction if stated and stated[0] == "-" else direction)


Channels = str | Channel | Sequence[str | Channel]


class Match(NamedTuple):
    """The recorded channel that serves as the requested one: its number, and the sign it needs."""

    number: int
    sign: int
    channel: Channel


def match(requested: Channel, recorded: tuple[Channel, ...], side: str) -> Match:
    """Find the recorded channel that is the requested one, up to its sign."""
    named = [index for index, channel in enumerate(recorded) if channel.name == requested.name]
    for sign in (1, -1):
        for index in named:
            if recorded[index].direction == sign * requested.direction != 0:
                return Match(index, sign, requested)
    either_unstated = any(requested.direction * recorded[index].direction == 0 for index in named)
    if either_unstated and len(named) == 1:
        stated = requested.direction or recorded[named[0]].direction
        return Match(named[0], 1, Channel(requested.name, stated))
    labels = ", ".join(channel.label for channel in recorded)
    if either_unstated:
        raise InputError(
            f"The {side} channel {requested.label} was requested, and several channels of this "
            f"name were measured; a direction is needed on both sides to tell them apart. Measured "
            f"are {labels}: name one of them."
        )
    otherwise = "rename the transducer to its name in the measurement"
    if named:
        way = abs(recorded[named[0]].direction)
        otherwise = f"state the direction: directions=({way},), and direction={way} of a beam"
    hint = look_alike(requested.name, [channel.name for channel in recorded])
    raise InputError(
        f"The {side} channel {requested.label} was requested, but only {labels} were measured; "
        f"name one of them, or {otherwise}.{hint}"
    )


def parsed(channels: Channels) -> tuple[Channel, ...]:
    """Read channels from labels."""
    # A label is a sequence of letters, and a channel one of two fields.
    labels: Iterable[str | Channel] = (
        [channels] if isinstance(channels, str | Channel) else channels
    )
    if not isinstance(labels, Iterable):
        check_annotated("channels", channels, Channels)
    return tuple(Channel.parse(label) for label in labels)


def checked(channel: Channel) -> Channel:
    """Refuse a channel that cannot be printed, or whose label would be read as another channel."""
    printable_name("Channel of the name", channel.name)
    if channel.direction not in range(-3, 4):
        raise InputError(
            f"Channel {channel.name!r} was given direction {channel.direction}; it must be one of "
            "+-1, +-2, +-3 for +-x, +-y, +-z, or 0 where it is not stated: Channel('s1', 3)."
        )
    if channel != Channel.parse(channel.label):
        raise InputError(
            f"The name {channel.name!r} of a transducer was given; its label {channel.label!r} "
            "would be read as another channel. Choose a name without blanks around it that does "
            "not end in a direction: Channel('s1', 1) for 's1+x'."
        )
    return channel


def check_distinct(side: str, channels: tuple[Channel, ...]) -> None:
    """Refuse a channel that is given twice."""
    if len({*channels}) < len(channels):
        repeated = next(channel for channel, count in Counter(channels).items() if count > 1)
        raise InputError(
            f"The {side} channel {repeated.label} was given twice; each may stand once only, since "
            "its data would count twice. Give each row its own label: 's1+x', 's1+y'."
        )


LONGEST = 100
"""Greatest number of letters of a name."""


def printable_name(kind: str, name: str) -> str:
    """Return a name that can be printed.

    What has it is for the message: `Sensor of the name`.
    """
    needed = "a name is needed, since it stands in tables and files"
    check_kind(kind, name, str, needed, "a text such as 's1'")
    if not is_printable(name):
        better = "".join(letter for letter in name if letter.isprintable()).strip()[:LONGEST]
        raise InputError(
            f"{kind} {name[: 2 * LONGEST]!r} was given; a name of at most {LONGEST} letters is "
            "needed, all of which can be printed, since it stands in tables, figures and files: "
            f"{better or 's1'!r}."
        )
    return name


def is_printable(name: str) -> bool:
    """Whether a name has letters that can be printed, and not too many."""
    return name.isprintable() and bool(name.strip()) and len(name) <= LONGEST


def checked_name(kind: str, name: str) -> str:
    """Return a name that can be a word of the name of an unknown, and of a group in a file."""
    if not isinstance(name, str) or not name or "." in name:
        better = str(name).replace(".", "_") if isinstance(name, str) and name else "s1"
        raise InputError(
            f"{kind} {name!r} was given; a name without a dot is needed, since dots separate the "
            f'words in names of unknowns (sensor.s1.position): "{better}".'
        )
    if "/" in name:
        raise InputError(
            f"{kind} {name!r} was given; a name without a slash is needed, since slashes separate "
            f'groups in the files of results: "{name.replace("/", "_")}".'
        )
    return printable_name(kind, name)


def look_alike(name: str, others: list[str]) -> str:
    """Hint at a name that differs in case or in the form of its letters alone; empty of none."""
    alike = [other for other in others if _plain(other) == _plain(name) and other != name]
    if not alike:
        return ""
    return f" {alike[0]!a} differs from {name!a} in case or in the form of letters alone."


def _plain(name: str) -> str:
    return unicodedata.normalize("NFKC", name).casefold()
