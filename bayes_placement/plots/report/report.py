"""A report: chapters of typed items, as one HTML file and the JSON beside it."""

import datetime
import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from ..._shared.arguments import check_fields, check_kind, shown
from ..._shared.errors import InputError
from ..._shared.files import Json, write_atomically
from ..._shared.reprs import with_short_repr
from ._svg import checked_photo, checked_svg, svg_of
from .content import Content, Drawing, Item, Table, Text, tags_of

FORMAT = "bayes_placement report 1"
"""Name of the schema of the JSON file, `schema.json` beside this file."""

VERDICT, COMMENTS, LAWS = "Verdict", "Comments", "Where it acts, and its law"
SET_UP, AGREEMENT = "Test set-up", "Agreement"
ERROR, RESPONSES = "Error", "Measured and model"
SUSPICION, NEXT, UNKNOWNS = "Suspicion", "Where to measure next", "Priors and posteriors"
PLACES, SHAPES, WARNINGS, SETTINGS = "Positions", "Mode shapes", "Warnings", "Settings"
SECTIONS = (
    VERDICT,
    COMMENTS,
    SET_UP,
    AGREEMENT,
    LAWS,
    ERROR,
    RESPONSES,
    SUSPICION,
    NEXT,
    UNKNOWNS,
    PLACES,
    SHAPES,
    WARNINGS,
    SETTINGS,
)
"""Sections in their order; others follow in the order in which they are first used."""

FOLDED = (SUSPICION, NEXT, UNKNOWNS, PLACES, SHAPES, SETTINGS)
"""Sections of details, which a reader unfolds; those that stay folded are not printed."""


_ON_TITLE = ("author", "client", "photo")
"""What stands below the title."""


@with_short_repr
@dataclass
class Chapter:
    """What one run gave: a state of a structure, or the data of one week."""

    label: str
    """Its name in the report."""
    verdict: str = ""
    """The answer in one sentence."""
    items: list[Item] = field(default_factory=list)
    """What stands in it."""
    created: str = field(default_factory=lambda: _now())
    """When it was written, in ISO 8601."""

    @property
    def sections(self) -> list[tuple[str, list[Item]]]:
        """Items by section, in the order of the sections."""
        names = dict.fromkeys([*SECTIONS, *(item.section for item in self.items)])
        grouped = [(name, [item for item in self.items if item.section == name]) for name in names]
        return [(name, items) for name, items in grouped if items]

    def to_json(self) -> Json:
        """Return it as numbers and words for a file."""
        return {
            "label": self.label,
            "verdict": self.verdict,
            "created": self.created,
            "items": [item.to_json() for item in self.items],
        }

    @classmethod
    def from_json(cls, stated: Json) -> "Chapter":
        """Read it from a file."""
        items = [Item.from_json(item) for item in stated["items"]]
        return cls(str(stated["label"]), str(stated["verdict"]), items, str(stated["created"]))


@with_short_repr
@dataclass
class Report:
    """A report to hand on: one HTML file that needs no network, and the same as JSON.

    Parameters
    ----------
    title
        Title of the page.
    chapters
        What stands in it, the newest last. `add_text`, `add_table` and `add_figure` add to the
        last chapter, and begin one where there is none.
    author, client
        Who wrote it, and for whom.
    photo
        A photograph of the structure as an address that holds it, `data:image/png;base64,...`.

    Raises
    ------
    InputError
        If the title is no text, a chapter none, or the photograph no such address.

    Examples
    --------
    >>> import bayes_placement as bp
    >>> report = bp.plots.report.Report("Bar with a clamp")
    >>> report.add_text("The clamp was found on Monday.", tags=["workshop"])
    >>> [item.title for item in report.chapters[-1].items]
    ['Comment']
    """

    title: str = "Report"
    chapters: list[Chapter] = field(default_factory=list)
    author: str = ""
    client: str = ""
    photo: str = ""

    def __post_init__(self) -> None:
        """Check the kinds of all."""
        check_fields(self)
        checked_photo(self.photo)

    def chapter(self, label: str) -> Chapter:
        """Return the chapter of a label; a new one where there is none yet."""
        for chapter in self.chapters:
            if chapter.label == label:
                return chapter
        self.chapters.append(Chapter(label))
        return self.chapters[-1]

    def put(self, chapter: Chapter) -> None:
        """Add a chapter, or replace that of the same label: what a user added to it stays."""
        former = self.chapter(chapter.label)
        added = [item for item in former.items if item.by_user]
        new = replace(chapter, items=[*chapter.items, *added])
        self.chapters[self.chapters.index(former)] = new

    def add_text(
        self,
        text: str | Sequence[str],
        *,
        title: str = "Comment",
        section: str = COMMENTS,
        tags: Sequence[str] = (),
    ) -> None:
        """Add a paragraph, or a list of sentences.

        Parameters
        ----------
        text
            The paragraph, or the sentences.
        title
            Its heading.
        section
            Section in which it stands, one of `SECTIONS` or a new one.
        tags
            Words by which a reader filters.

        Raises
        ------
        InputError
            If it is no text.
        """
        sentences = (text,) if isinstance(text, str) else text
        are_words = isinstance(sentences, list | tuple) and all(
            isinstance(sentence, str) for sentence in sentences
        )
        if not are_words or not sentences:
            raise InputError(
                f"add_text was given {shown(text)}; a text or a list of sentences is needed, since "
                'it is shown as such: add_text("Torque was 8 N m.").'
            )
        self._add(Text(tuple(sentences)), title, "", section, ("comment", *tags))

    def add_table(
        self,
        table: pd.DataFrame,
        *,
        title: str = "Table",
        caption: str = "",
        section: str = COMMENTS,
        tags: Sequence[str] = (),
        index: str | None = None,
    ) -> None:
        """Add a table, which a reader can save as CSV.

        Parameters
        ----------
        table
            The table; units belong into the names of its columns.
        title, section, tags
            See `add_text`.
        caption
            One sentence that says what is to be seen.
        index
            Name of a first column that holds the index; None for none.
        """
        needed = "a data frame is needed, since its columns become those of the table"
        check_kind("table", table, pd.DataFrame, needed, "add_table(pd.DataFrame(rows))")
        self._add(Table.of(table, index=index), title, caption, section, ("comment", *tags))

    def add_figure(
        self,
        figure: Figure | str,
        *,
        title: str = "Figure",
        caption: str = "",
        section: str = COMMENTS,
        tags: Sequence[str] = (),
        data: pd.DataFrame | None = None,
    ) -> None:
        """Add a figure of matplotlib, or the text of an SVG file.

        Parameters
        ----------
        figure
            The figure, or one `svg` element without scripts and addresses.
        title, section, tags
            See `add_text`.
        caption
            One sentence that says what is to be seen.
        data
            What is drawn, for the reader to save as CSV.

        Raises
        ------
        InputError
            If it is neither, or has a script or an address in it.
        """
        needed = "a figure of matplotlib or the text of an SVG file is needed, since it is drawn"
        check_kind("figure", figure, (Figure, str), needed, "add_figure(figure)")
        svg = checked_svg(figure) if isinstance(figure, str) else svg_of(figure)
        drawing = Drawing(svg, None if data is None else Table.of(data))
        self._add(drawing, title, caption, section, ("comment", *tags))

    def _add(
        self, content: Content, title: str, caption: str, section: str, tags: Sequence[str]
    ) -> None:
        if not self.chapters:
            self.chapters.append(Chapter(self.title))
        item = Item(section, title, content, caption, tags_of(tags), by_user=True)
        self.chapters[-1].items.append(item)

    def to_json(self) -> Json:
        """Return it as numbers and words for a file; `schema.json` describes it."""
        return {
            "format": FORMAT,
            "title": self.title,
            **{word: getattr(self, word) for word in _ON_TITLE},
            "chapters": [chapter.to_json() for chapter in self.chapters],
        }

    def write(self, path: str | Path) -> Path:
        """Write the page, and the same as JSON beside it; each is complete or not there.

        Parameters
        ----------
        path
            The page, usually `report.html`; the other file has the suffix `.json`.

        Raises
        ------
        InputError
            If the page has that suffix itself.
        """
        from ._page import page

        if Path(path) == json_of(path):
            raise InputError(
                f"{path} was given for the page of a report; another suffix is needed, since the "
                "same as JSON stands beside it under that name: report.html."
            )
        html, text = page(self), json.dumps(self.to_json(), allow_nan=False)
        write_atomically(json_of(path), lambda file: file.write_text(f"{text}\n", encoding="utf-8"))
        return write_atomically(path, lambda file: file.write_text(html, encoding="utf-8"))

    @classmethod
    def read(cls, path: str | Path) -> "Report":
        """Read a report from the JSON beside its page.

        Parameters
        ----------
        path
            The page or the JSON file.

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        InputError
            If it holds something else.
        """
        source = json_of(path)
        if not source.is_file():
            raise FileNotFoundError(
                f"There is no file {source}, from which the report is read. `bayes-placement "
                "report RESULTS` writes it beside the page."
            )
        try:
            stated = json.loads(source.read_text(encoding="utf-8"))
            if stated["format"] != FORMAT:
                raise KeyError(f'format "{stated["format"]}"')
            chapters = [Chapter.from_json(chapter) for chapter in stated["chapters"]]
            on_title = {word: str(stated.get(word, "")) for word in _ON_TITLE}
            return cls(str(stated["title"]), chapters, **on_title)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(
                f"{source} is no report of this package ({error}); one is needed, since new "
                "results are added to it. Delete it, or write to another file: --to other.html."
            ) from error


def json_of(path: str | Path) -> Path:
    """Path of the JSON file beside a page."""
    return Path(path).with_suffix(".json")


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
