"""Links of all pages lead to files and headings that are there, and DOIs are complete."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [*ROOT.glob("*.md"), *sorted((ROOT / "notebooks").rglob("*.md"))]
LINK = re.compile(r"\]\(([^)\s]+)\)|^\s*```\{(?:image|figure)\} (\S+)", re.MULTILINE)
DOI = re.compile(r"10\.\d{4,9}/[\w.()/:;-]*\w\)?$")


def links(page):
    return {first or second for first, second in LINK.findall(page.read_text())}


def headings(page):
    """Anchors of the headings of a page as GitHub and MyST make them, and those that it names."""
    text = page.read_text()
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    anchors = {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
    return anchors | set(re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE))


def is_sound(page, link):
    if link.startswith(("http:", "https:", "mailto:")):
        doi = link.partition("doi.org/")[2]
        return link.startswith("https://") and (not doi or DOI.fullmatch(doi))
    path, _, heading = link.partition("#")
    target = (page.parent / path) if path else page
    if not target.exists():
        return False
    return not heading or target.suffix != ".md" or heading in headings(target)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    assert not [link for link in links(page) if not is_sound(page, link)]


def test_dois_in_the_package_are_complete():
    offenders = [
        f"{path.relative_to(ROOT)}: {doi}"
        for path in sorted((ROOT / "bayes_placement").rglob("*.py"))
        for doi in re.findall(r"doi[:.][^\s]*?(10\.[^\s,;]+)", path.read_text(), re.IGNORECASE)
        if not DOI.fullmatch(doi.rstrip(".`'\":").removesuffix(")"))
    ]
    assert not offenders
