"""Reports by hand: what is added stands in the page and in the JSON, and nothing else gets in."""

import base64
import hashlib
import io
import json
import re
import subprocess
import sys
from importlib.resources import files
from urllib.parse import unquote

import html5lib
import jsonschema
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from bayes_placement._shared.errors import InputError
from bayes_placement.page import standalone
from bayes_placement.page.frames import packed
from bayes_placement.page.standalone import kept_frames
from bayes_placement.plots.report import Report
from bayes_placement.plots.report._style import thinned
from bayes_placement.plots.report._svg import embedded
from bayes_placement.plots.report.content import Interactive, Item, MovingShapes, Table, Text
from bayes_placement.plots.report.report import Chapter

SCHEMA = json.loads((files("bayes_placement.plots.report") / "schema.json").read_text())
PHOTO = "data:image/png;base64,iVBORw0KGgo="
EVIL = "</script><script>alert('x')</script> & \"quoted\" <b>bold</b>"


def figure():
    drawn = Figure()
    panel = drawn.subplots()
    panel.plot([0, 1, 2], [3.0, 1.0, 2.0], "o-", label="measured")
    panel.legend()
    return drawn


def parsed(path):
    """The page as a tree, from a parser that forgives nothing."""
    parser = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False)
    return parser.parse(path.read_text())


def check_page(path):
    """Refuse what no page may have; return its tree."""
    tree = parsed(path)
    identifiers = [element.get("id") for element in tree.iter() if element.get("id")]
    assert len(identifiers) == len(set(identifiers))
    for element in tree.iter():
        assert element.get("src") is None or element.get("src").startswith("data:image/")
        for name in ("href", "{http://www.w3.org/1999/xlink}href"):
            address = element.get(name, "#")
            assert address.startswith(("#", "data:text/csv;", "data:image/png;")), address
            assert not address.startswith("#") or address in ("#", *(f"#{i}" for i in identifiers))
    text = path.read_text()
    assert not re.search(r"https?:|//[a-z]+\.[a-z]|url\((?!#)", text)
    scripts = [element for element in tree.iter("script")]
    programs = [script for script in scripts if script.get("type") != "application/json"]
    assert len(programs) == 1
    digest = base64.b64encode(hashlib.sha256(programs[0].text.encode()).digest()).decode()
    policy = next(m.get("content") for m in tree.iter("meta") if m.get("http-equiv"))
    assert policy.startswith("default-src 'none'")
    assert policy.endswith("base-uri 'none'; form-action 'none'")  # which default-src leaves open
    assert f"script-src 'sha256-{digest}'" in policy
    return tree


def csv_of(tree, title):
    """The numbers that a reader saves from the item of a title."""
    for article in tree.iter("article"):
        if "".join(article.find("h3").itertext()) == title:
            link = next(a for a in article.iter("a") if a.get("download"))
            return unquote(link.get("href").partition(",")[2])
    raise AssertionError(title)


@pytest.fixture
def filled():
    report = Report("Bar with a clamp", author="A. B.", client="City", photo=PHOTO)
    report.add_text("Measured on Monday.", tags=["workshop"])
    report.add_text(["First.", "Second."], title="Notes", section="Verdict")
    frame = pd.DataFrame({"name": ["a", "b"], "mass [kg]": [0.12345678, np.nan]})
    report.add_table(frame, title="Masses", caption="Weighed before.")
    report.add_figure(figure(), title="Trace", caption="Three points.", data=frame)
    shapes = MovingShapes(
        points=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        lines=[[0, 1]],
        models=[{"name": "m", "frequencies": [10.0], "shapes": [[[0, 0, 0.0], [0, 0, 1.0]]]}],
        note="Drawn across.",
        marks=[{"name": "s1", "kind": "sensor", "at": [0.5, 0.0, 0.0]}],
    )
    report.chapters[0].items.append(Item("Mode shapes", "Shapes", shapes, "One mode.", ("modes",)))
    channels = Interactive(kept_frames([packed({"is": "busy", "words": "Nothing."}, {})]))
    report.chapters[0].items.append(Item("Measured and model", "All", channels, "", ()))
    return report


def test_a_page_is_valid_and_asks_for_nothing(filled, tmp_path):
    tree = check_page(filled.write(tmp_path / "report.html"))
    headings = ["".join(h.itertext()) for h in tree.iter("h2")]
    assert headings == ["Verdict", "Comments", "Measured and model", "Mode shapes"]
    assert "".join(next(tree.iter("h1")).itertext()) == "Bar with a clamp"
    about = ["".join(part.itertext()) for part in next(tree.iter("dl"))]
    assert about[:2] == ["ClientCity", "AuthorA. B."]
    assert next(tree.iter("img")).get("src") == PHOTO


def test_a_report_is_drawn_without_loading_any_model():
    program = (
        "import sys, bayes_placement.plots.report; "
        "parts = [name.split('.') for name in sys.modules]; "
        "rooms = {part[1] for part in parts if part[0] == 'bayes_placement' and part[1:]}; "
        "sys.exit(' '.join(rooms & {'modes', 'effects', 'experiment'}) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_numbers_can_be_saved_as_csv(filled, tmp_path):
    tree = check_page(filled.write(tmp_path / "report.html"))
    assert csv_of(tree, "Masses") == "name,mass [kg]\na,0.123457\nb,\n"
    assert csv_of(tree, "Trace") == csv_of(tree, "Masses")
    assert csv_of(tree, "Shapes").splitlines()[2] == "m,1,10,1,0,0,0,0,1"


def test_the_json_beside_it_holds_the_same_and_follows_its_schema(filled, tmp_path):
    filled.write(tmp_path / "report.html")
    stated = json.loads((tmp_path / "report.json").read_text())
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(stated, SCHEMA)
    again = Report.read(tmp_path / "report.html")
    assert again.to_json() == filled.to_json()
    stated["chapters"][0]["items"][2]["content"]["rows"] = [[{}]]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(stated, SCHEMA)


def test_names_of_any_origin_stay_text(tmp_path):
    report = Report(EVIL, author=EVIL, client=EVIL)
    report.chapters.append(Chapter(EVIL, EVIL))
    report.add_text(EVIL, title=EVIL, section=EVIL, tags=[EVIL])
    report.add_table(pd.DataFrame({EVIL: [EVIL]}), title=EVIL, caption=EVIL)
    shapes = MovingShapes(
        points=[[0.0, 0.0, 0.0]],
        lines=[],
        models=[{"name": EVIL, "frequencies": [1.0], "shapes": [[[0.0, 0.0, 1.0]]]}],
        note=EVIL,
        marks=[{"name": EVIL, "kind": "sensor", "at": [0.0, 0.0, 0.0]}],
    )
    report.chapters[0].items.append(Item("Mode shapes", EVIL, shapes))
    tree = check_page(report.write(tmp_path / "report.html"))
    assert "".join(next(tree.iter("title")).itertext()) == EVIL
    assert not any("".join(b.itertext()) == "bold" for b in tree.iter("b"))
    tags = [json.loads(article.get("data-tags")) for article in tree.iter("article")]
    assert ["comment", EVIL] in tags


@pytest.mark.parametrize(
    ("svg", "words"),
    [
        ("<svg><script>alert(1)</script></svg>", "script"),
        ('<svg onload="alert(1)"/>', "onload"),
        ('<svg><g onclick="alert(1)"/></svg>', "onclick"),
        ('<svg><use href="https://a.b/c.svg#d"/></svg>', "href=https"),
        ('<svg><image href="file:///etc/passwd"/></svg>', "href=file"),
        ("<svg><style>@import 'a.css'</style></svg>", "style"),
        ('<svg><path style="fill: url(https://a.b/c)"/></svg>', "style"),
        ("<svg><foreignObject/></svg>", "foreignObject"),
        ("<svg><text><tspan>a</tspan>javascript:b</text></svg>", "an address in tspan"),
        ("<svg><unclosed></svg>", "that is no SVG"),
        ("no figure", "one svg element"),
        ('<!DOCTYPE svg [<!ENTITY a "b">]><svg>&a;</svg>', "one svg element"),
    ],
)
def test_figures_that_could_do_anything_are_refused(svg, words):
    with pytest.raises(InputError, match=words):
        Report().add_figure(svg)


def test_attributes_of_other_name_spaces_are_dropped_with_their_prefix():
    report = Report()
    words = 'x:onload="alert(1)" x:href="data:text/html,a" id="a"'
    report.add_figure(f'<svg xmlns:x="urn:x"><g {words}/></svg>')
    drawn = report.chapters[0].items[0].content.svg
    assert 'id="a"' in drawn and "alert" not in drawn and "href" not in drawn


@pytest.mark.parametrize("name", ["bridge.png", "bridge.jpg"])
def test_a_photograph_becomes_a_part_of_the_page(name, tmp_path):
    start = {"bridge.png": b"\x89PNG\r\n\x1a\n", "bridge.jpg": b"\xff\xd8\xff\xe0"}[name]
    (tmp_path / name).write_bytes(start + b"pixels")
    kind, _, content = embedded(tmp_path / name).partition(";base64,")
    assert kind == ("data:image/png" if name.endswith("png") else "data:image/jpeg")
    assert base64.b64decode(content) == start + b"pixels"
    (tmp_path / name).write_bytes(start + bytes(5_000_000))
    with pytest.raises(InputError, match="a PNG or JPEG of at most 5000000 bytes"):
        embedded(tmp_path / name)


def test_what_is_no_photograph_is_refused(tmp_path):
    (tmp_path / "a.png").write_text("<svg onload='alert(1)'/>")
    with pytest.raises(InputError, match=r"a PNG or JPEG .*--photo"):
        embedded(tmp_path / "a.png")
    with pytest.raises(FileNotFoundError, match="There is no photograph"):
        embedded(tmp_path / "b.png")
    for address in ("https://a.b/c.png", 'data:image/png;base64,AA" onload="x', "data:text/html,a"):
        with pytest.raises(InputError, match="a page loads nothing"):
            Report(photo=address)


def test_a_figure_of_matplotlib_keeps_its_text_and_loses_what_nobody_sees(filled):
    svg = filled.chapters[0].items[3].content.svg
    assert ">measured<" in svg
    assert "xmlns" not in svg
    assert "metadata" not in svg
    assert "font-family" not in svg
    assert not re.search(r"\d\.\d{3}", svg)


def test_the_drawing_of_a_user_keeps_its_numbers_and_words():
    drawn = Figure()
    drawn.subplots().set_xlabel("frequency")
    file = io.StringIO()
    drawn.savefig(file, format="svg")  # with letters as paths, of which each has a small factor
    report = Report()
    report.add_figure(file.getvalue())
    assert "scale(0.015625)" in file.getvalue()
    assert "scale(0.015625)" in report.chapters[0].items[0].content.svg
    words = '<text x="0.0125">one <tspan>two</tspan> three</text>'
    report.add_figure(f'<svg viewBox="0 0 1 1">\n  {words}\n</svg>')
    assert words in report.chapters[0].items[1].content.svg


@pytest.mark.parametrize("count", [1, 500, 501, 4000])
def test_a_curve_that_is_thinned_keeps_its_peaks(count):
    curve = np.sin(np.arange(count) / 300)
    curve[count // 2] = 10.0
    curve[count // 3] = -10.0
    drawn = thinned(curve)
    assert drawn.size <= 500 and np.all(np.diff(drawn) > 0)
    assert {curve.max(), curve.min()} <= {*curve[drawn]}
    assert count > 500 or drawn.size == count


def test_a_page_that_would_be_its_own_json_is_refused(filled, tmp_path):
    with pytest.raises(ValueError, match=r"report\.json was given for the page .*another suffix"):
        filled.write(tmp_path / "report.json")


def test_identifiers_of_two_like_figures_differ(tmp_path):
    report = Report()
    for _ in range(2):
        report.add_figure(figure())
    check_page(report.write(tmp_path / "report.html"))


def test_a_second_state_keeps_the_first_and_all_comments(filled):
    later = Chapter("week 2", "Nothing is new.", [Item("Verdict", "Found", Text(("Nothing.",)))])
    filled.put(later)
    assert [chapter.label for chapter in filled.chapters] == ["Bar with a clamp", "week 2"]
    filled.add_text("Warmer than before.")
    filled.put(Chapter("week 2", "A mass is new.", [Item("Verdict", "Found", Text(("Mass.",)))]))
    assert [chapter.label for chapter in filled.chapters] == ["Bar with a clamp", "week 2"]
    second = filled.chapters[1]
    assert second.verdict == "A mass is new."
    sentences = [item.content.sentences for item in second.items]
    assert sentences == [("Mass.",), ("Warmer than before.",)]
    assert len(filled.chapters[0].items) == 6


def test_sections_come_in_one_order_and_new_ones_last():
    items = [Item(name, "t", Text(("x",))) for name in ("Mine", "Settings", "Verdict", "Mine")]
    sections = Chapter("c", items=items).sections
    assert [name for name, _ in sections] == ["Verdict", "Settings", "Mine"]
    assert [len(section_items) for _, section_items in sections] == [1, 1, 2]


def test_numbers_that_json_does_not_know_become_blanks():
    frame = pd.DataFrame({"x": [np.inf, 1.5], "n": [np.int64(3), 4], "t": [True, False]})
    table = Table.of(frame, index="row")
    assert table.rows == (("0", None, 3, "True"), ("1", 1.5, 4, "False"))


def test_a_comment_of_no_words_is_refused():
    report = Report()
    with pytest.raises(ValueError, match="a text or a list of sentences is needed"):
        report.add_text([])


@pytest.mark.parametrize(
    "text",
    ["{}", "[]", "no JSON", '{"format": "other"}', '{"format": "bayes_placement report 1"}'],
)
def test_another_file_is_not_taken_for_a_report(text, tmp_path):
    (tmp_path / "report.json").write_text(text)
    with pytest.raises(ValueError, match="is no report of this package"):
        Report.read(tmp_path / "report.html")


def test_a_report_that_is_not_there_is_missing(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"There is no file .*report\.json"):
        Report.read(tmp_path / "report.html")


def test_a_report_of_any_origin_brings_no_script(filled, tmp_path):
    filled.write(tmp_path / "report.html")
    text = (tmp_path / "report.json").read_text()
    evil = text.replace("<svg ", "<svg onload='alert(1)' ", 1)
    assert evil != text
    (tmp_path / "report.json").write_text(evil)
    with pytest.raises(ValueError, match=r"A figure with onload was given"):
        Report.read(tmp_path / "report.html")


def test_frames_of_an_interactive_page_are_letters_and_nothing_else(filled):
    stated = filled.chapters[0].items[-1].to_json()
    stated["content"]["frames"] = '"></iframe><script>'
    with pytest.raises(ValueError, match="base64 is needed"):
        Item.from_json(stated)


def test_all_modules_of_the_page_are_one_script_with_its_licence():
    script = standalone.script()
    modules = sorted(path.stem for path in standalone.FOLDER.glob("*.js"))
    assert all(f"const module_{name} = (" in script for name in modules)
    assert "Permission is hereby granted" in script
    ours = script.partition("const module_look")[2]
    assert not re.search(r"^(import|export) ", ours, re.MULTILINE)


def test_an_item_of_an_unknown_kind_is_refused(filled):
    stated = filled.chapters[0].items[0].to_json() | {"kind": "video"}
    with pytest.raises(ValueError, match='the kind "video" was given; text, table, figure'):
        Item.from_json(stated)
