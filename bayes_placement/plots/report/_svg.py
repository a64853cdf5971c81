"""Images that enter a page: figures as small SVG, SVG of any origin once checked, photographs."""

import base64
import io
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from matplotlib import rc_context
from matplotlib.figure import Figure

from ..._shared.errors import InputError
from .._colours import AFTER, BEFORE, DATA, FAINT, FIFTH, FLOOR, FOURTH, INK, PAPER

Element = ElementTree.Element

DIGITS = 2
"""Digits behind the point of coordinates, in points of 1/72 inch."""

LARGEST = 4_000_000
"""Letters of the largest SVG that is taken."""

_VARIABLES = {
    INK: "ink",
    PAPER: "paper",
    BEFORE: "before",
    AFTER: "after",
    DATA: "data",
    FLOOR: "floor",
    FAINT: "faint",
    FOURTH: "fourth",
    FIFTH: "fifth",
}
_SHAPES = {"path", "use", "rect", "circle", "ellipse", "line", "polyline", "polygon", "image"}
_TAGS = {"svg", "g", "defs", "text", "tspan", "clipPath", "title", "desc"} | _SHAPES
_TAGS |= {"linearGradient", "stop", "pattern", "symbol", "marker", "mask"}
_RULE = "*{stroke-linejoin: round"
_HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
_NUMBER = re.compile(rf"-?\d+\.\d{{{DIGITS + 1},}}(?:e-?\d+)?")
_LENGTHS = ("d", "x", "y", "points", "width", "height")
_SHIFT = re.compile(r"(?:translate|rotate)\([^)]*\)")  # others have factors, small numbers
_FONT = re.compile(r"font: (?:\w+ )*([\d.]+px) [^;]*|font-family: [^;]*;? ?")
_OUTSIDE = re.compile(r"(?i)(url\(\s*['\"]?(?!#)|@import|expression\(|javascript:|https?:)")


def svg_of(figure: Figure) -> str:
    """Draw a figure as SVG: text as text, no date, coordinates to a hundredth of a point."""
    file = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "report"}):
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None})
    root = _root(file.getvalue())
    for element in root.iter():
        _round(element)
    return ElementTree.tostring(root, encoding="unicode")


def as_file(svg: str) -> str:
    """Return a drawing as a file of its own, which names the language that it is in."""
    return svg.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"', 1)


def checked_svg(text: str) -> str:
    """Return the SVG without what a drawing does not need, or refuse it.

    Scripts, addresses outside the drawing and elements of other kinds are refused, since the text
    becomes a part of a page. Coordinates stay, since they may be in any unit.
    """
    return ElementTree.tostring(_root(text), encoding="unicode")


def _root(text: str) -> Element:
    """Root of a drawing that was checked and shortened."""
    start = text.find("<svg")
    if start < 0 or len(text) > LARGEST or "<!ENTITY" in text:
        raise InputError(
            f"A figure of {len(text)} letters was given; one svg element of at most {LARGEST} "
            'letters is needed, since it becomes a part of a page: add_figure("<svg ...></svg>").'
        )
    try:
        root = ElementTree.fromstring(text[start:])
    except ElementTree.ParseError as error:
        raise InputError(
            f"A figure was given that is no SVG ({error}); one svg element is needed, since it "
            'becomes a part of a page: add_figure("<svg ...></svg>").'
        ) from error
    _remove_descriptions(root)
    for element in root.iter():
        _remove_foreign(element)
        _check(element)
        _shorten(element)
    _fit(root)
    return root


def with_prefixed_identifiers(svg: str, prefix: str) -> str:
    """Give the identifiers of a drawing a prefix of its own, and drop those nobody refers to."""
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', svg))

    def identifier(match: re.Match[str]) -> str:
        return f' id="{prefix}{match[1]}"' if match[1] in used else ""

    named = re.sub(r' id="([^"]*)"', identifier, svg)
    return re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}", named)


def with_theme(svg: str) -> str:
    """Replace the colours of a report by those of the page, light or dark."""
    for colour, name in _VARIABLES.items():
        svg = svg.replace(colour, f"var(--{name})")
    return svg


def _remove_descriptions(root: Element) -> None:
    """Remove the metadata, which no reader sees, and the rule of matplotlib that the page has."""
    for parent in list(root.iter()):
        for child in list(parent):
            is_rule = _tag(child) == "style" and (child.text or "").startswith(_RULE)
            if _tag(child) == "metadata" or is_rule:
                parent.remove(child)


def _remove_foreign(element: Element) -> None:
    """Remove attributes of other name spaces, which would lose their prefix and become ours."""
    for name in [*element.attrib]:
        if name.startswith("{") and name not in _HREFS:
            del element.attrib[name]


def _check(element: Element) -> None:
    """Refuse what a drawing does not need."""
    forbidden = [_tag(element)] if _tag(element) not in _TAGS else list(_forbidden(element))
    if forbidden:
        raise InputError(
            f"A figure with {forbidden[0]} was given; a drawing without scripts and addresses is "
            "needed, since it becomes a part of a page: figure.savefig(file, format='svg')."
        )


def _forbidden(element: Element) -> Iterator[str]:
    for name, value in element.attrib.items():
        if name in _HREFS:
            if not value.startswith(("#", "data:image/png;base64,")):
                yield f"{name}={value[:40]}"
        elif name.lower().startswith("on") or _OUTSIDE.search(value):
            yield name
    if any(_OUTSIDE.search(text or "") for text in (element.text, element.tail)):
        yield f"an address in {_tag(element)}"


def _shorten(element: Element) -> None:
    """Drop name spaces and blanks, and leave the family of letters to the page."""
    element.tag = _tag(element)
    for name in list(element.attrib):
        value = element.attrib.pop(name)
        if name == "style":
            value = _FONT.sub(_size_alone, value).replace("; ", ";").replace(": ", ":")
        if name != "version":
            element.set(name.rpartition("}")[2], value)
    element.text, element.tail = (
        text if text and text.strip() else None for text in (element.text, element.tail)
    )


def _round(element: Element) -> None:
    """Round coordinates in points."""
    for name in _LENGTHS:
        if name in element.attrib:
            element.set(name, _NUMBER.sub(_rounded, element.attrib[name]))
    if "transform" in element.attrib:
        shifts = _SHIFT.sub(
            lambda match: _NUMBER.sub(_rounded, match[0]), element.attrib["transform"]
        )
        element.set("transform", shifts)


def _fit(root: Element) -> None:
    """Let the drawing be as wide as the page, at most as wide as it was drawn."""
    width = re.match(r"[\d.]+", root.attrib.pop("width", ""))
    root.attrib.pop("height", None)
    if width is not None:
        root.set("style", f"max-width:{float(width[0]) * 4 / 3:.0f}px")
    root.set("role", "img")


def _size_alone(match: re.Match[str]) -> str:
    """Size of letters; their family is that of the page."""
    return f"font-size: {match[1]}" if match[1] else ""


def _rounded(match: re.Match[str]) -> str:
    return f"{float(match[0]):.{DIGITS}f}".rstrip("0").rstrip(".")


def _tag(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


LARGEST_PHOTO = 5_000_000
"""Bytes of the largest photograph that is taken."""

_KINDS = {b"\x89PNG\r\n\x1a\n": "png", b"\xff\xd8\xff": "jpeg"}
"""Kinds by the bytes with which they begin."""

_EMBEDDED = re.compile(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/]+=*")


def embedded(path: str | Path) -> str:
    """Return a photograph, PNG or JPEG of at most 5 MB, as an address that holds it."""
    if not Path(path).is_file():
        raise FileNotFoundError(f"There is no photograph {path}. One that is there: --photo FILE.")
    content = Path(path).read_bytes()
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None or len(content) > LARGEST_PHOTO:
        raise InputError(
            f"{path} was given as a photograph, {len(content)} bytes; a PNG or JPEG of at most "
            f"{LARGEST_PHOTO} bytes is needed, since it becomes a part of the page: "
            "--photo bridge.jpg."
        )
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def checked_photo(address: str) -> str:
    """Return the photograph of a report of any origin; refuse all else, which a page would load."""
    if address and not _EMBEDDED.fullmatch(address):
        raise InputError(
            f'The photograph "{address[:40]}" was given; "data:image/png;base64,..." is needed, '
            "since a page loads nothing: write_report(folder, photo='bridge.jpg')."
        )
    return address
