"""Universal files of FRFs and their coherence, written by hand: datasets 164, 2411 and 58.

Independent of bayes_placement.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from tests.simulator.hidden_structures import Instrument, Record

UNITS = (
    "         1                  SI         1",
    "   1.0000000000000000D+00   1.0000000000000000D+00   1.0000000000000000D+00",
    "   0.0000000000000000D+00",
)


def write(
    path: Path, record: Record, sensors: Sequence[Instrument], actuators: Sequence[Instrument]
) -> None:
    """Write each FRF and its coherence, and where the transducers are said to be."""
    nodes = {one.name: n for n, one in enumerate(sensors, 1)}
    nodes |= {one.name: 100 + n for n, one in enumerate(actuators, 1)}
    blocks = [dataset(164, UNITS), dataset(2411, positions(nodes, (*sensors, *actuators)))]
    for i, sensor in enumerate(sensors):
        for j, actuator in enumerate(actuators):
            ends = [(nodes[one.name], one) for one in (sensor, actuator)]
            blocks.append(dataset(58, function(4, "FRF", record.frf[i, j], record, ends)))
            blocks.append(
                dataset(58, function(6, "Coherence", record.coherence[i, j], record, ends))
            )
    path.write_text("".join(blocks))


def dataset(number: int, lines: Sequence[str]) -> str:
    return "\n".join(["    -1", f"{number:6d}".ljust(80), *lines, "    -1", ""])


def positions(nodes: dict[str, int], instruments: Sequence[Instrument]) -> list[str]:
    lines = []
    for one in instruments:
        place = np.zeros(3)
        place[: np.size(one.recorded)] = one.recorded
        lines.append(f"{nodes[one.name]:10d}         0         0         0")
        lines.append("".join(f"{coordinate:25.16e}" for coordinate in place))
    return lines


def function(kind: int, title: str, values: np.ndarray, record: Record, ends) -> list[str]:
    """Lines of dataset 58: FRFs are kind 4, coherence is kind 6; each value has its frequency."""
    names = " / ".join(f"{one.name}{one.direction:+d}" for _, one in ends)
    (read, sensor), (driven, actuator) = ends
    is_frf = kind == 4
    return [
        f"{title} {names}",
        "NONE",
        "01-JAN-26 00:00:00",
        "NONE",
        "NONE",
        f"{kind:5d}{1:10d}{0:5d}{0:10d} {'NONE':<10}{read:10d}{sensor.direction:4d}"
        f" {'NONE':<10}{driven:10d}{actuator.direction:4d}",
        f"{6 if is_frf else 4:10d}{values.size:10d}{0:10d}" + 3 * f"{0.0:13.5e}",
        axis(18, "Frequency", "Hz"),
        axis(12, "Acceleration", "m/s^2") if is_frf else axis(0, "Coherence"),
        axis(13, "Excitation force", "N") if is_frf else axis(0),
        axis(0),
        *table(record.frequency, values, is_frf),
    ]


def axis(kind: int, label: str = "NONE", unit: str = "NONE") -> str:
    return f"{kind:10d}    0    0    0 {label:<20} {unit:<20}"


def table(frequency: np.ndarray, values: np.ndarray, is_frf: bool) -> Iterator[str]:
    """Lines of one complex value, or of two real ones."""
    parts = [
        f"{x:13.5e}" + "".join(f"{part:20.11e}" for part in ([y.real, y.imag] if is_frf else [y]))
        for x, y in zip(frequency, values, strict=True)
    ]
    step = 1 if is_frf else 2
    for start in range(0, len(parts), step):
        yield "".join(parts[start : start + step])
