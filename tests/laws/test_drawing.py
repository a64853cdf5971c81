"""Drawings of networks: well-formed, every element once, labels with units and in their places."""

import itertools
import json
import re
from collections import Counter
from xml.etree import ElementTree

import jax
import numpy as np
import pytest
from numpyro import distributions as dist

import bayes_placement as bp
from bayes_placement._shared.ranges import described
from bayes_placement.effects import Dashpot, LossySpring, Mass, Spring, Springpot
from bayes_placement.laws import law_of, networks
from bayes_placement.laws.catalogue import ELEMENTS, leaves

SVG = "{http://www.w3.org/2000/svg}"
UNITS = {"k": ["N/m"], "c": ["N s/m"], "m": ["kg"], "p": ["N/m", "", "Hz"], "h": ["N/m", ""]}
"""Units of the numbers of each element."""

TREES = [*networks("kcmp", 3), *networks("h", 1), ["-", "h", ["|", "h", "m"]]]
every_network = pytest.mark.parametrize("tree", TREES, ids=json.dumps)


def network(tree):
    letters = leaves(tree)
    return law_of(tree, [0.5] * sum(ELEMENTS[letter][1] for letter in letters))


def drawn(law):
    return ElementTree.fromstring(law.drawing())


def titles(root):
    return [title.text for title in root.iter(f"{SVG}title")]


def labels(root):
    return [text.text for text in root.iter(f"{SVG}text")]


def walls(law):
    """How many branches stand on the ground."""
    return law.drawing().count("v-12v24")


def boxes(element, x=0.0, y=0.0):
    """Left, right, top and bottom of all texts, of letters of half of their height."""
    shift = re.match(r"translate\((\S+) (\S+)\)", element.get("transform", ""))
    x, y = (x + float(shift[1]), y + float(shift[2])) if shift else (x, y)
    if element.tag == f"{SVG}text":
        middle, low = x + float(element.get("x")), y + float(element.get("y"))
        half = 0.5 * 0.5 * 11 * len(element.text)
        yield middle - half, middle + half, low - 9, low
    for child in element:
        yield from boxes(child, x, y)


@every_network
def test_every_element_is_drawn_once(tree):
    counted = Counter(ELEMENTS[letter][0].__name__ for letter in leaves(tree))
    assert Counter(titles(drawn(network(tree)))) == counted


@every_network
def test_every_number_is_below_its_element_with_its_unit(tree):
    of_elements = Counter(unit for letter in leaves(tree) for unit in UNITS[letter])
    number = re.compile(r"([kcmfαη])([₁₂₃₄]?) = (?:0\.5|1) ?(.*)")  # noqa: RUF001
    found = [number.fullmatch(label).groups() for label in labels(drawn(network(tree)))]
    assert Counter(unit for _, _, unit in found) == of_elements
    symbols = [letter + index for letter, index, _ in found]
    assert len(set(symbols)) == len(symbols)


@every_network
def test_no_words_lie_on_others_or_outside(tree):
    root = drawn(network(tree))
    left, top, width, height = map(float, root.get("viewBox").split())
    texts = [*boxes(root)]
    for x0, x1, y0, y1 in texts:
        assert left <= x0 and x1 <= left + width and top <= y0 and y1 <= top + height
    for one, other in itertools.combinations(texts, 2):
        apart_x = one[1] <= other[0] or other[1] <= one[0]
        assert apart_x or one[3] <= other[2] or other[3] <= one[2]


SPRING, DASHPOT, MASS = Spring(2e4), Dashpot(40.0), Mass(0.3)
GROUNDED = [
    (SPRING, 1),
    (MASS, 0),
    (SPRING | DASHPOT, 2),
    (SPRING - DASHPOT, 1),
    ((SPRING | DASHPOT) - MASS, 0),
    (MASS - SPRING, 0),
    (SPRING | MASS, 1),
    (Spring(5e3) | (SPRING | DASHPOT) - MASS, 1),
    ((MASS | SPRING) - DASHPOT, 1),
    (0.5 * (SPRING | DASHPOT), 1),
    (0.5 * (SPRING | DASHPOT | MASS), 2),
    (MASS - (SPRING | MASS), 1),
]


@pytest.mark.parametrize(("law", "count"), GROUNDED, ids=[repr(law) for law, _ in GROUNDED])
def test_branches_that_do_not_end_in_a_mass_stand_on_the_ground(law, count):
    assert walls(law) == count


@pytest.mark.parametrize("heavy", [MASS, MASS | SPRING, 2.0 * MASS], ids=repr)
def test_what_has_a_mass_comes_last_in_a_chain(heavy):
    one, other = (
        re.sub(r'aria-label="[^"]*"|[₁₂]', "", law.drawing())
        for law in (
            heavy - DASHPOT,
            DASHPOT - heavy,
        )
    )
    assert one == other


def test_a_line_leaves_a_mass_that_is_between_others_alone():
    leaving = re.compile(r'z"/><text [^>]*>[^<]*</text></g><path d="M[\d.]+ 0H')
    assert len(leaving.findall((MASS - (SPRING | MASS)).drawing())) == 1
    assert not leaving.search((SPRING - (SPRING | MASS)).drawing())


def test_labels_name_what_is_not_known_and_the_strength():
    law = dist.Uniform(0.0, 1.0) * (Spring(dist.LogUniform(1e3, 1e6)) - Springpot(2.0, 0.4, 30.0))
    assert labels(drawn(law)) == [
        "λ = Uniform(0, 1)",
        "k₁ = LogUniform(1000, 1e+06) N/m",
        "k₂ = 2 N/m",
        "α = 0.4",  # noqa: RUF001
        "f = 30 Hz",
    ]
    assert titles(drawn(law)) == ["Scaled", "Spring", "Springpot"]


def test_a_long_prior_is_cut_below_its_element_and_whole_in_the_table():
    law = Spring(dist.TruncatedNormal(12345.6, 1234.56, low=1000.0, high=23456.7))
    (label,) = labels(drawn(law))
    assert "..." in label and label.endswith(" N/m") and len(label) < 42
    assert f"<td>{described(law.stiffness)}</td>" in law._repr_html_()


def test_words_that_look_like_tags_are_escaped():
    kind = type("A<b&c", (dist.Uniform,), {})
    law = Spring(2.0) - Mass(kind(0.0, 1.0))
    assert labels(drawn(law))[1] == "m = A<b&c(0, 1) kg"
    assert "A<b&c(0, 1)" in drawn(law).get("aria-label")
    ElementTree.fromstring(law._repr_html_())


def test_a_number_that_is_traced_is_no_trouble():
    said = []

    def traced(mass):
        law = Spring(2.0) - Mass(mass)
        said.extend([*labels(drawn(law)), law._repr_html_()])
        return mass

    jax.jit(traced)(1.0)
    assert said[1] == "m = traced number kg"
    ElementTree.fromstring(said[2])


def test_a_report_takes_a_drawing_at_its_size(tmp_path):
    report = bp.plots.report.Report("Mount")
    law = 0.5 * (LossySpring(2e4, 0.1) - Mass(0.3))
    report.add_figure(law.drawing(), title="Mount")
    report.write(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "k = 2e+04 N/m" in page
    width = float(drawn(law).get("viewBox").split()[2])
    assert f"max-width:{np.round(width):.0f}px" in page


def test_a_notebook_shows_drawing_and_table():
    shown = (SPRING - MASS)._repr_html_()
    root = ElementTree.fromstring(shown)
    assert root.tag == "div" and root.find(f"{SVG}svg") is not None
    cells = [[cell.text for cell in row] for row in root.find("table").iter("tr")]
    assert cells == [
        ["symbol", "element", "field", "value", "unit"],
        ["k", "Spring", "stiffness", "2e+04", "N/m"],
        ["m", "Mass", "mass", "0.3", "kg"],
    ]


def test_a_notebook_says_where_masses_cannot_all_move_against_the_ground():
    assert "<li>Two parts of a chain have masses" in (MASS - (SPRING | MASS))._repr_html_()
    assert "<li>" not in (MASS - (SPRING | DASHPOT))._repr_html_()
