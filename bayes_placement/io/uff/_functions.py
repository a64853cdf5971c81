"""FRFs and coherences of a universal file by nodes, and the names of these nodes."""

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..._shared.files import Json
from ...positions.channel import Channel, is_printable
from ._datasets import Dataset, MeasurementFileError
from ._units import UNSTATED

Node = tuple[int, int]  # number and direction


class Function(NamedTuple):
    """An FRF or a coherence of the file, by nodes and not yet by channels."""

    place: str
    sensor: Node
    actuator: Node
    frequency: np.ndarray
    values: np.ndarray
    quantity: str
    notes: Json
    entities: tuple[str, str]
    """Names of the entities of response and reference; empty where the file states none."""


def entity(dataset: Dataset, side: str) -> str:
    """Name of the entity without a direction behind it; empty where it cannot be a name."""
    stated: str = dataset.fields[f"{side}_ent_name"]
    can_be_name = stated not in UNSTATED and not {".", "/"} & {*stated} and is_printable(stated)
    return Channel.parse(stated).name if can_be_name else ""


def names_of_nodes(frfs: list[Function], chosen: Mapping[int, str]) -> dict[int, str]:
    """Name of the transducer at each node: as chosen, as recorded, of its entity, or its number."""
    recorded: dict[int, str] = {}
    entities = {
        (node[0], name)
        for frf in frfs
        for node, name in zip((frf.sensor, frf.actuator), frf.entities, strict=True)
    }
    ways = Counter(node for node, _ in entities), Counter(name for _, name in entities)
    # What several nodes share, as a component, or what is not all of a node, tells none apart.
    own = {n: name for n, name in entities if name and ways[0][n] == ways[1][name] == 1}
    for frf in frfs:
        nodes = (frf.sensor[0], frf.actuator[0])
        of_file = frf.notes.get("names", [own.get(node, str(node)) for node in nodes])
        recorded |= dict(zip(nodes, of_file, strict=True))
    names = {node: chosen.get(node, name) for node, name in recorded.items()}
    for node, name in names.items():
        namesakes = [other for other in names if other < node and names[other] == name]
        if namesakes:
            raise MeasurementFileError(
                f"Nodes {namesakes[0]} and {node} would both be named {name!r}; each node needs a "
                f"name of its own, since it has its own position. Name both: names="
                f"{{{namesakes[0]}: 's1', {node}: 's2'}}."
            )
    return names
