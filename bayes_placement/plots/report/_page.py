"""The page of a report: templates filled, styles and script inlined, nothing loaded."""

import base64
import hashlib
import re
from collections.abc import Iterator
from importlib.resources import files
from typing import NamedTuple
from urllib.parse import quote

from ..._shared.files import Json
from ...page import standalone
from ._svg import with_prefixed_identifiers, with_theme
from .content import Cell, Drawing, Interactive, Item, MovingShapes
from .report import FOLDED, Chapter, Report

SAFE_IN_ADDRESS = ",.;:-+_()[]^~*/"
"""Signs of CSV that stand in an address of the kind `data:` as they are."""

MOST_DIGITS = 7
"""Digits of a number of a table that are all shown, since it was rounded to them."""

SHAPE_DIGITS = 3
"""Decimals of displacements, of which the greatest is 1."""


class _Shown(NamedTuple):
    """An item with what the template needs besides."""

    item: Item
    identifier: str
    svg: str
    shapes: Json | None
    csv: str
    file: str


def page(report: Report) -> str:
    """Return the page of a report as HTML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(__package__, "templates"),
        autoescape=True,  # names come from files of any origin
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["cell"] = cell_text
    script = _template("report.js")
    chapters = [
        {"id": f"c{number}", "chapter": chapter, "sections": _sections(chapter, number)}
        for number, chapter in enumerate(report.chapters, 1)
    ]
    tags = dict.fromkeys(
        tag for chapter in report.chapters for item in chapter.items for tag in item.tags
    )
    is_interactive = any(
        isinstance(item.content, Interactive)
        for chapter in report.chapters
        for item in chapter.items
    )
    inner = [standalone.script_hash()] if is_interactive else []
    return environment.get_template("report.html").render(
        report=report,
        date=max((chapter.created for chapter in report.chapters), default="")[:10],
        chapters=chapters,
        tags=list(tags),
        style=_template("report.css"),
        script=script,
        hashes=[base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(), *inner],
        inner_page=standalone.compressed(standalone.page().encode()) if inner else "",
    )


def cell_text(cell: Cell) -> str:
    """Write a cell of a table: numbers to five digits, or all where they are few."""
    if cell is None:
        return ""
    if not isinstance(cell, float):
        return str(cell)
    exact = f"{cell:.12g}"
    digits = exact.partition("e")[0].replace(".", "").replace("-", "").lstrip("0")
    return exact if len(digits) <= MOST_DIGITS else f"{cell:.5g}"


def _template(name: str) -> str:
    """Return a file of the templates as it stands."""
    return (files(__package__) / "templates" / name).read_text(encoding="utf-8")


def _sections(chapter: Chapter, number: int) -> list[dict[str, object]]:
    return [
        {
            "id": f"c{number}-{_slug(name)}-{place}",
            "name": name,
            "open": name not in FOLDED,
            "items": list(_shown(items, f"c{number}-s{place}")),
        }
        for place, (name, items) in enumerate(chapter.sections, 1)
    ]


def _shown(items: list[Item], prefix: str) -> Iterator[_Shown]:
    for number, item in enumerate(items, 1):
        identifier = f"{prefix}-i{number}"
        csv = "" if item.data is None else quote(item.data.csv(), safe=SAFE_IN_ADDRESS)
        yield _Shown(
            item,
            identifier,
            svg=_svg(item.content, identifier) if isinstance(item.content, Drawing) else "",
            shapes=_compact(item.content) if isinstance(item.content, MovingShapes) else None,
            csv=csv,
            file=f"{_slug(item.title)}.csv",
        )


def _svg(drawing: Drawing, identifier: str) -> str:
    named = with_prefixed_identifiers(drawing.svg, f"{identifier}-")
    return with_theme(named) if drawing.follows_theme else named


def _compact(shapes: MovingShapes) -> Json:
    """The shapes with as many digits as can be seen."""
    models = [
        model
        | {
            "shapes": [
                [[round(shift, SHAPE_DIGITS) for shift in point] for point in shape]
                for shape in model["shapes"]
            ]
        }
        for model in shapes.models
    ]
    points = [[float(f"{value:.4g}") for value in point] for point in shapes.points]
    return shapes._asdict() | {"models": models, "points": points}


def _slug(words: str) -> str:
    """Return words as a name of a file."""
    return re.sub(r"[^a-z0-9]+", "_", words.lower()).strip("_") or "data"
