"""The report of a run: all sections with the numbers of the run, and the page in a browser."""

import io
import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.cli.app import app
from bayes_placement.io import model as model_files
from bayes_placement.plots.report import SECTIONS, Report, write_report
from bayes_placement.plots.report.report import FOLDED
from tests.browser import pages
from tests.cli.test_criticism import HIDDEN, MEASUREMENT, MODEL
from tests.plots.report.test_report import check_page, csv_of

pytestmark = pytest.mark.usefixtures("optimised")

OPEN = [name for name in SECTIONS if name not in (*FOLDED, "Comments")]
WITHOUT_COMMENTS = [name for name in SECTIONS if name != "Comments"]


def run(*words):
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code in (0, 1), (done.output, done.exception)
    return done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What `improve --report` leaves of a bar that lacks a mass."""
    home = tmp_path_factory.mktemp("report")
    study = home / "bar_with_a_mass.py"
    study.write_text(MODEL + HIDDEN + MEASUREMENT)
    effects = ("--effects", "point_mass,time_delay")
    output = run("improve", study, *effects, "--report", "--out", home / "monday")
    assert f"Report to hand on: {home / 'monday' / 'report.html'}" in output
    return home / "monday"


@pytest.fixture(scope="module")
def chapter(folder):
    (only,) = Report.read(folder / "report.html").chapters
    return only


def item(chapter, title):
    return next(item for item in chapter.items if item.title == title)


def table(chapter, title):
    of = item(chapter, title).content
    return pd.DataFrame(list(of.rows), columns=list(of.columns))


def numbers(chapter, title):
    """What a reader saves from an item."""
    return pd.read_csv(io.StringIO(item(chapter, title).data.csv()))


def test_all_sections_are_there_and_the_verdict_comes_first(folder, chapter):
    assert [name for name, _ in chapter.sections] == WITHOUT_COMMENTS
    assert chapter.verdict.startswith("Missing: point_mass")
    tree = check_page(folder / "report.html")
    paragraph = next(p for p in tree.iter("p") if p.get("class") == "verdict")
    assert "".join(paragraph.itertext()) == chapter.verdict


def test_every_figure_has_a_sentence_its_numbers_and_tags(chapter):
    drawn = [item for item in chapter.items if item.kind in ("figure", "moving_shapes")]
    assert len(drawn) >= 8
    for figure in drawn:
        assert figure.caption.endswith(".")
        assert ". " not in figure.caption
        assert len(figure.data.rows) > 0
        assert figure.tags


def test_the_error_is_that_of_the_ledger(folder, chapter):
    steps = json.loads((folder / "ledger.json").read_text())["steps"]
    chi2 = numbers(chapter, "The error falls")["reduced chi-square [1]"]
    assert np.allclose(chi2, [step["chi2_per_datum"] for step in steps], rtol=1e-5)
    words = table(chapter, "Steps")["what it is"].iloc[-1]
    assert words.startswith("at 4") and " mm, mass 0.31" in words  # some 420 mm and 0.3 kg


def test_responses_are_those_of_the_measurement_and_of_the_fits(folder, chapter):
    study = model_files.read(folder.parent / "bar_with_a_mass.py")
    frf = study.measurement.frf[1, 0]
    data = numbers(chapter, "sensor s2+x, actuator a1+x")
    measured = next(column for column in data if column.startswith("measured, log10"))
    assert np.allclose(data[measured], np.log10(np.abs(frf)), rtol=1e-5)
    assert np.allclose(data["measured phase [deg]"], np.degrees(np.angle(frf)), rtol=1e-4)
    predicted = 10 ** data["with point_mass: predicted"] * np.exp(
        1j * np.radians(data["with point_mass: phase [deg]"])
    )
    error = np.abs(predicted - frf)
    assert np.allclose(data["with point_mass: error"], error, atol=1e-7)  # six digits are kept
    # Real and imaginary part have a noise of 2e-5 each.
    assert np.allclose(data["with point_mass: noise"], 2e-5 * np.sqrt(2), rtol=1e-5)
    assert data["as given: error"].mean() > 2 * data["with point_mass: error"].mean()


def test_unknowns_have_units_and_agree_with_the_ledger(folder, chapter):
    rows = table(chapter, "Every unknown").set_index("unknown")
    stated = json.loads((folder / "ledger.json").read_text())["steps"][-1]["parameters"]
    assert set(rows.index) == set(stated)
    factors = {"GPa": 1e-9, "%": 100.0, "mm": 1e3, "kg": 1.0}
    for name, row in rows.iterrows():
        mean = stated[name]["mean"] * factors[row["unit"]]
        deviation = stated[name]["standard_deviation"] * factors[row["unit"]]
        assert abs(row["mean"] - mean) < 0.15 * deviation
        assert row["95 % from"] < row["mean"] < row["95 % to"]
    assert rows.loc["structure.damping.ratio", "unit"] == "%"
    bounds = rows.loc["structure.damping.ratio", ["prior from", "prior to"]]
    assert bounds.tolist() == [2.0, 6.0]
    prior = rows.loc["structure.modes.youngs_modulus", ["prior from", "prior to"]]
    assert np.allclose(prior.tolist(), [0.9525, 1.0475], atol=0.003)


def test_positions_are_recorded_and_inferred(chapter):
    rows = table(chapter, "Positions and orientations").set_index("name")
    assert rows.loc["s1", "recorded"] == 200.0
    assert rows.loc["s2", "standard deviation"] == 0.0
    assert abs(rows.loc["point_mass", "inferred"] - 420.0) < 5 * 3.2


def test_mode_shapes_are_those_with_and_without_the_mass(chapter):
    rows = table(chapter, "Natural frequencies")
    assert list(rows.columns) == ["mode", "as given [Hz]", "with point_mass [Hz]"]
    # A mass lowers natural frequencies, where all else is the same: it was fitted anew here.
    shapes = item(chapter, "Mode shapes").content
    first = np.array(shapes.models[0]["shapes"][0])
    x = np.array(shapes.points)[:, 0]
    assert np.allclose(np.abs(first[:, 2]), np.sin(np.pi * x), atol=2e-3)
    assert not first[:, :2].any()
    assert {mark["name"] for mark in shapes.marks} == {"s1", "s2", "a1", "point_mass"}


def test_the_conclusion_is_three_sentences(chapter):
    found, agreement, advice = item(chapter, "Conclusion and recommendation").content.sentences
    assert found == chapter.verdict
    assert agreement.startswith("The mean frequency response assurance criterion")
    assert advice.startswith("Recommended: take what was found into the model")


def test_agreement_is_that_of_the_arrays_that_are_kept(chapter):
    rows = table(chapter, "Frequency response assurance criterion").set_index("model")
    assert list(rows.index) == ["as drawn", "as given", "with point_mass"]
    pairs = [numbers(chapter, f"sensor {name}+x, actuator a1+x") for name in ("s1", "s2")]
    for model, row in rows.iterrows():
        frac = [assurance(data, model) for data in pairs]
        assert np.allclose(
            [row["least FRAC [1]"], row["mean FRAC [1]"]], [min(frac), np.mean(frac)], atol=6e-4
        )
    peaks = table(chapter, "Natural frequencies and damping")
    errors = peaks[["as given, off by [%]", "with point_mass, off by [%]"]].abs().max()
    assert errors.iloc[1] < 0.5 < errors.iloc[0]


def assurance(data, model):
    """FRAC from the numbers that a reader saves."""
    names = next(column for column in data if column.startswith("measured, log10"))
    columns = ((names, "measured phase [deg]"), (f"{model}: predicted", f"{model}: phase [deg]"))
    measured, computed = (
        10 ** data[size] * np.exp(1j * np.radians(data[phase])) for size, phase in columns
    )
    square = np.abs(np.vdot(measured, computed)) ** 2
    return square / (np.vdot(measured, measured) * np.vdot(computed, computed)).real


def test_the_set_up_and_what_the_fit_moved_are_told(chapter):
    channels = table(chapter, "Channels").set_index("channels")
    assert list(channels.index) == ["s1+x", "s2+x", "a1+x"]
    assert channels.loc["s1+x"].tolist() == ["sensor", "0.2", "1"]
    facts = dict(table(chapter, "Measurement").itertuples(index=False))
    assert facts["FRFs"] == "mobility [(m/s)/N]" and facts["averages"] == "not stated"
    given, completed = item(chapter, "What the fit moved").content.sentences
    assert given.startswith("Fitted as given, the model moved the most in ")
    assert "standard deviations of its prior" in completed


def test_the_map_holds_the_residual_over_the_noise(chapter):
    bands = numbers(chapter, "Where the error lies")
    assert set(bands["model"]) == {"as given", "with point_mass"}
    last = bands[bands["model"] == "with point_mass"]["residual / noise [1]"]
    assert abs(np.sqrt((last**2).mean()) - 1) < 0.3


def test_one_explanation_leaves_nothing_to_decide(chapter):
    words = item(chapter, "The next measurement").content.sentences[0]
    assert words.startswith("Only one explanation is left")


def test_settings_name_the_files_with_their_hashes(folder, chapter):
    record = json.loads((folder / "run.json").read_text())["improve"]
    rows = table(chapter, "Files")
    assert list(rows.iloc[0]) == [
        "improve",
        "model",
        "bar_with_a_mass.py",
        record["model"]["sha256"],
    ]
    settings = dict(table(chapter, "How this was made").itertuples(index=False))
    assert settings["improve.seed"] == 0
    assert settings["improve.versions.bayes_placement"] == bp.__version__


@pytest.mark.long
def test_the_report_of_the_folder_alone_is_the_same(folder, chapter, tmp_path):
    again = Report.read(write_report(folder, to=tmp_path / "again.html", label="monday"))
    assert [item.title for item in again.chapters[0].items] == [i.title for i in chapter.items]
    for title in ("Suspicion on the structure", "Prior and posterior", "Deviation from the record"):
        assert item(again.chapters[0], title) == item(chapter, title)


@pytest.fixture
def rewritten(folder, tmp_path):
    """The folder of the run with its ledger as another version wrote it."""

    def write(change):
        copy = shutil.copytree(folder, tmp_path / "earlier")
        stated = json.loads((copy / "ledger.json").read_text())
        change(stated)
        (copy / "ledger.json").write_text(json.dumps(stated))
        return copy

    return write


def test_a_ledger_that_lacks_the_misfit_is_refused_with_the_version_that_wrote_it(rewritten):
    def strip(ledger):
        ledger["record"]["versions"]["bayes_placement"] = "0.0.9"
        del ledger["steps"][0]["chi2_per_datum"]

    done = CliRunner().invoke(app, ["report", str(rewritten(strip))])
    words = " ".join(done.output.split())
    assert done.exit_code == 3
    assert "ledger.json, written by bayes_placement 0.0.9, lacks steps.chi2_per_datum" in words
    assert "Run again: bayes-placement improve " in words
    assert words.endswith("bar_with_a_mass.py --report")


def test_a_ledger_that_is_no_table_of_steps_is_refused(tmp_path):
    (tmp_path / "ledger.json").write_text("[1, 2]")
    with pytest.raises(InputError, match=r"ledger\.json cannot be read as JSON"):
        write_report(tmp_path)
    (tmp_path / "ledger.json").write_text("{}")
    with pytest.raises(InputError, match=r"a version that it does not name, lacks steps, "):
        write_report(tmp_path)


def test_records_without_model_and_hash_are_listed(tmp_path):
    (tmp_path / "run.json").write_text(json.dumps({"place": {"data": [{"path": "/tmp/bar.uff"}]}}))
    (tmp_path / "placements.csv").write_text("s1,information_gain,information_gain_se\n0.2,0.1,0\n")
    chapter = Report.read(write_report(tmp_path)).chapters[0]
    assert list(table(chapter, "Files").iloc[0]) == ["place", "data", "bar.uff", ""]


@pytest.mark.long
@pytest.mark.longest
def test_the_data_of_a_week_later_are_added_and_comments_stay(folder, tmp_path):
    page = tmp_path / "bridge.html"
    run(
        "report",
        folder,
        "--to",
        page,
        "--label",
        "week 1",
        "--title",
        "Bridge",
        "--comment",
        "Cold.",
    )
    run("report", folder, "--to", page, "--label", "week 2", "--comment", "Warm.")
    output = run("report", folder, "--to", page, "--label", "week 1")
    assert output.strip() == f"Report to hand on: {page}"
    report = Report.read(page)
    assert report.title == "Bridge"
    assert [chapter.label for chapter in report.chapters] == ["week 1", "week 2"]
    comments = [item(chapter, "Comment").content.sentences for chapter in report.chapters]
    assert comments == [("Cold.",), ("Warm.",)]
    tree = check_page(page)
    assert len([p for p in tree.iter("p") if p.get("class") == "verdict"]) == 2


@pytest.mark.long
@pytest.mark.longest
def test_several_states_are_chapters(folder, tmp_path):
    for number in (1, 2):
        shutil.copytree(folder, tmp_path / f"state_{number}")
    shutil.copy(folder / "run.json", tmp_path / "run.json")
    stated = {"states": [{"label": "5 mm cut"}, {"label": "9 mm cut"}]}
    (tmp_path / "states.json").write_text(json.dumps(stated))
    (tmp_path / "states.csv").write_text("effect,5 mm cut,9 mm cut\ncrack,1,2\n")
    report = Report.read(write_report(tmp_path, label="bridge"))
    labels = [chapter.label for chapter in report.chapters]
    assert labels == ["bridge", "bridge, 5 mm cut", "bridge, 9 mm cut"]
    assert table(report.chapters[0], "Effects in each state").iloc[0].tolist() == ["crack", 1, 2]
    assert report.chapters[0].verdict == report.chapters[1].verdict


@pytest.mark.parametrize("moved", [1, 2, 3])
def test_placements_that_were_tried_are_drawn(moved, tmp_path):
    names = ["s1", "s2", "a1"][:moved]
    gains = {"information_gain": [0.9, 0.4, -np.inf], "information_gain_se": [0.01, 0.02, np.nan]}
    rows = pd.DataFrame({name: [0.2, 0.4, 0.0] for name in names} | gains | {"cost": 0.0})
    rows.to_csv(tmp_path / "placements.csv")
    chapter = Report.read(write_report(tmp_path)).chapters[0]
    check_page(tmp_path / "report.html")
    assert len(table(chapter, "Placements that were tried")) == 3
    if moved < 3:
        drawn = numbers(chapter, "Expected gain")
        assert drawn["expected gain [nat]"].tolist() == [0.9, 0.4]
        assert drawn["s1 [m]"].tolist() == [0.2, 0.4]


def test_the_verdict_is_one_sentence(tmp_path):
    words = "Missing: a mass of 0.5 kg (p 0.99); chi2 falls from 48.9 to 0.822. It was 3. See text."
    (tmp_path / "run.json").write_text(
        json.dumps(
            {"place": {"verdict": words, "model": {"path": "/home/me/bar.py", "sha256": ""}}}
        )
    )
    (tmp_path / "placements.csv").write_text("s1,information_gain,information_gain_se\n0.2,0.1,0\n")
    report = Report.read(write_report(tmp_path))
    assert report.chapters[0].verdict == words.split(" It was")[0]
    assert report.title == "bar"
    assert "/home" not in (tmp_path / "report.html").read_text()  # folders say who someone is


def test_what_is_no_folder_of_results_is_refused(tmp_path):
    for place, words in (("nowhere", "There is no folder"), ("", "holds no results")):
        done = CliRunner().invoke(app, ["report", str(tmp_path / place)])
        assert done.exit_code != 0
        assert words in " ".join(done.output.split())


def test_the_page_opens_without_a_network_and_without_trouble(folder):
    with pages() as opened:
        page = opened(folder / "report.html")
        page.click("#unfold")
        page.wait_for_timeout(300)
        assert page.trouble == []
        assert page.title().startswith("bar_with_a_mass")
        inner = page.frame_locator("iframe.page")
        inner.locator(".u-over").first.wait_for()
        assert inner.locator("#matrix button[aria-pressed=true]").count() == 1
        assert inner.locator("#add").is_hidden()  # it is looked at, and nothing is changed
        inner.locator("#modes").click()
        assert "Hz" in inner.locator("#mode-list").inner_text()
        heights = page.evaluate("[...document.querySelectorAll('svg')].map(s => s.clientHeight)")
        assert min(heights) > 50
        for width in (1200, 390):  # a telephone
            page.set_viewport_size({"width": width, "height": 800})
            assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.long
def test_sections_fold_and_the_filter_works(folder):
    with pages() as opened:
        page = opened(folder / "report.html")
        figures = page.locator("article.item svg")
        assert figures.first.is_visible()
        page.click("#fold")
        assert not any(figures.nth(number).is_visible() for number in range(figures.count()))
        page.click("nav a:has-text('Suspicion')")
        page.wait_for_timeout(100)
        assert page.locator("article", has_text="Suspicion on the structure").first.is_visible()
        page.click("#unfold")
        page.check("input.tag[value='warning']")
        shown = page.locator("article.item:visible")
        assert shown.count() == 1
        assert shown.locator("h3").text_content() == "Warnings"
        assert page.locator("details.section:visible").count() == 1
        page.check("input.tag[value='error']")
        assert shown.count() > 3
        page.uncheck("input.tag[value='warning']")
        page.uncheck("input.tag[value='error']")
        assert shown.count() == page.locator("article.item").count()
        assert page.trouble == []


@pytest.mark.long
def test_shapes_move_and_the_view_turns(folder):
    with pages() as opened:
        page = opened(folder / "report.html")
        page.click("#unfold")
        canvas = page.locator("canvas").last
        canvas.scroll_into_view_if_needed()
        first = canvas.screenshot()
        page.wait_for_timeout(400)
        assert canvas.screenshot() != first
        page.click("button.play")
        still = canvas.screenshot()
        page.wait_for_timeout(300)
        assert canvas.screenshot() == still
        before = page.locator(".shapes").get_attribute("data-view")
        box = canvas.bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 220, box["y"] + 160)
        page.mouse.up()
        after = page.locator(".shapes").get_attribute("data-view")
        assert before == "0.000 0.000"
        turned = [float(angle) for angle in after.split()]
        assert np.allclose(turned, [120 / 150, 60 / 150], atol=0.02)
        assert canvas.screenshot() != still
        page.click("button.reset")
        assert page.locator(".shapes").get_attribute("data-view") == before
        page.select_option("select.mode", label="2")
        assert "mode 2" in page.locator(".frequency").first.text_content()
        assert page.trouble == []


@pytest.mark.long
def test_numbers_are_saved_from_the_page(folder, tmp_path):
    with pages(accept_downloads=True) as opened:
        page = opened(folder / "report.html")
        article = page.locator("article", has=page.locator("h3:text-is('The error falls')"))
        with page.expect_download() as waiting:
            article.locator("a[download]").click()
        waiting.value.save_as(tmp_path / "saved.csv")
        assert waiting.value.suggested_filename == "the_error_falls.csv"
    tree = check_page(folder / "report.html")
    assert (tmp_path / "saved.csv").read_text() == csv_of(tree, "The error falls")


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.longest)])
def test_words_and_curves_stand_out_from_the_ground(folder, scheme):
    with pages(color_scheme=scheme) as opened:
        page = opened(folder / "report.html")
        colours = page.evaluate(
            """() => {
              const of = (element, word) => getComputedStyle(element)[word];
              const svg = document.querySelector('.drawing svg');
              const words = [...svg.querySelectorAll('text')].map(t => of(t, 'fill'));
              const lines = [...svg.querySelectorAll('path')].map(t => of(t, 'stroke'));
              const body = of(document.body, 'color');
              const ground = of(document.querySelector('.section'), 'backgroundColor');
              return {ground, strokes: [...words, body, ...lines.filter(c => c !== 'none')]};
            }"""
        )
        ground = luminance(colours["ground"])
        assert (ground > 0.5) == (scheme == "light")
        assert len(colours["strokes"]) > 10
        for colour in set(colours["strokes"]):
            bright, dim = sorted([luminance(colour), ground], reverse=True)
            assert (bright + 0.05) / (dim + 0.05) > 3.0, colour


def luminance(colour):
    """Relative luminance of `rgb(1, 2, 3)`, as WCAG 2 defines it."""
    parts = np.array([float(part) for part in colour.partition("(")[2].rstrip(")").split(",")[:3]])
    share = parts / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.long
def test_what_is_unfolded_is_printed_with_numbers_of_pages(folder, tmp_path):
    with pages() as opened:
        page = opened(folder / "report.html")
        assert page.locator("details.section[open]").count() == len(OPEN)
        page.pdf(path=tmp_path / "report.pdf", prefer_css_page_size=True)
        page.click("#unfold")
        page.pdf(path=tmp_path / "all.pdf", prefer_css_page_size=True)
        page.emulate_media(media="print")
        assert not page.locator("fieldset.filter").is_visible()
        assert page.locator("article.item svg").first.is_visible()
        # A page is 180 mm wide; what is wider shrinks all of it.
        page.set_viewport_size({"width": 680, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= 680
    count = pages_of(tmp_path / "report.pdf")
    assert count <= 6 < pages_of(tmp_path / "all.pdf")


def pages_of(pdf):
    """Number of pages of a PDF."""
    return len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes()))
