"""Damaged universal files are refused, neither misread nor read in part."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.io import uff


def measurement():
    random = np.random.default_rng(4)
    frf = random.standard_normal((1, 1, 5)) + 1j * random.standard_normal((1, 1, 5))
    return bp.Measurement.from_arrays(
        frf,
        np.arange(5.0, 10.0),
        sensors=["s1+x"],
        actuators=["a1+x"],
        quantity="mobility",
        coherence=random.uniform(0.5, 1.0, frf.shape),
        averages=4,
        positions={"s1": (0.25, 0.0, 0.0), "a1": (0.5, 0.0, 0.0)},
    )


@pytest.fixture
def text(tmp_path):
    uff.write(tmp_path / "whole.uff", measurement())
    written = (tmp_path / "whole.uff").read_text()
    return "\n".join(line.rstrip() for line in written.split("\n"))


def read(folder, content):
    path = folder / "damaged.uff"
    path.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
    return uff.read(path)


def refused(folder, content, message):
    with pytest.raises(ValueError, match=message) as caught:
        read(folder, content)
    assert "damaged.uff" in str(caught.value)


def function_lines(text):
    """Numbers of the lines of the first function, after that with its number."""
    lines = text.split("\n")
    start = lines.index("    58") + 1
    return lines, start


def changed_line(text, number, change):
    """The text with one line of the first function changed; the sixth has the number 5."""
    lines, start = function_lines(text)
    lines[start + number] = change(lines[start + number])
    return "\n".join(lines)


def test_the_whole_file_is_read(tmp_path, text):
    assert np.allclose(read(tmp_path, text).frf, measurement().frf, rtol=1e-5)


@pytest.mark.parametrize(
    ("low", "high", "field"),
    [
        (41, 51, "response node"),
        (51, 55, "response direction"),
        (66, 76, "reference node"),
        (76, 80, "reference direction"),
    ],
)
def test_an_unreadable_node_or_direction_is_not_zero(tmp_path, text, low, high, field):
    def damaged(line):
        return line[:low] + "x1".rjust(high - low) + line[high:]

    message = rf"line 6 .*the {field} \(columns {low + 1} to {high}\) is '.*x1', no whole number"
    refused(tmp_path, changed_line(text, 5, damaged), message)


@pytest.mark.parametrize(
    ("column", "message"),
    [
        (0, r"the function type \(columns 1 to 5\) is blank"),
        (41, r"the response node \(columns 42 to 51\) is blank"),
        (51, r"the response direction \(columns 52 to 55\) is blank"),
        (75, r"the reference node \(columns 67 to 76\) ends before its columns do"),
    ],
)
def test_a_record_that_is_shifted_by_a_column_is_refused(tmp_path, text, column, message):
    def shifted(line):
        unnamed = line.replace("NONE", "    ")
        return unnamed[:column] + " " + unnamed[column:]

    refused(tmp_path, changed_line(text, 5, shifted), message)


def test_a_number_that_is_wider_than_its_columns_is_refused(tmp_path, text):
    wide = changed_line(text, 5, lambda line: line[:51] + "  -12" + line[56:])
    refused(tmp_path, wide, "column 56 between two fields holds '2'")


def test_a_blank_too_many_cuts_no_digit_of_an_exponent(tmp_path, text):
    """A line of six numbers of 13 columns, of which the last ends in the 81st of 80."""
    lines, start = function_lines(text)
    lines[start + 6] = lines[start + 6].replace("         6", "         5", 1)
    numbers = ["  1.00000e-00"] * 5 + ["  -9.4444e-04"]
    lines[start + 11 : start + 14] = [" " + "".join(numbers), "".join(numbers[:4])]
    refused(tmp_path, "\n".join(lines), r"line 12 .*is no number in its|stands behind")
    lines[start + 11] = "".join(numbers[:5]) + "   -9.4444e-04"
    refused(tmp_path, "\n".join(lines), r"line 12 .*'4' stands behind them")
    lines[start + 11] = "".join(numbers)
    assert read(tmp_path, "\n".join(lines)).frf[0, 0, 2].imag == -9.4444e-04


def test_a_value_that_is_no_number_is_refused(tmp_path, text):
    def damaged(line):
        return line[:5] + "?" + line[6:]

    refused(tmp_path, changed_line(text, 11, damaged), r"line 12 .*is no number in its columns")


def test_values_are_counted(tmp_path, text):
    message = "10 numbers are announced and 6 are there"
    refused(tmp_path, changed_line(text, 12, lambda line: ""), message)


def test_a_number_that_is_cut_off_is_refused(tmp_path, text):
    cut = changed_line(text, 12, lambda line: line[:-13])
    refused(tmp_path, cut, "line 13 .* its last number is cut off")


@pytest.mark.parametrize(
    ("columns", "value"), [(slice(7, 13), b"     3"), (slice(13, 19), b"     1")]
)
def test_a_wrong_byte_order_or_kind_of_number_is_refused(tmp_path, columns, value):
    uff.write(tmp_path / "binary.uff", measurement(), binary=True)
    content = (tmp_path / "binary.uff").read_bytes()
    start = content.index(b"    58b")
    head = bytearray(content[start : start + 80])
    head[columns] = value
    damaged = content[:start] + bytes(head) + content[start + 80 :]
    refused(
        tmp_path, damaged, r"has the byte order b'\d' and the floating point format b'\d'; 1 or"
    )


def test_text_outside_of_datasets_drops_no_dataset(tmp_path, text):
    delimiter = text.index("    -1\n    -1\n") + len("    -1\n")
    for lost in (b"  12  1.5E+00", b"\0\1 of a binary one", b"NONE\nNONE\n    58\nNONE"):
        shown = text[:delimiter].encode() + lost + b"\n" + text[delimiter:].encode()
        refused(tmp_path, shown, r"holds b'.*outside of its")
    without = text[:delimiter] + text[delimiter + len("    -1\n") :]
    refused(tmp_path, without, "datasets, after 1 of them; only lines of words may stand there")


def test_digits_of_another_script_are_no_number(tmp_path, text):
    other = changed_line(text, 5, lambda line: line[:79] + "\u0661" + line[80:])
    refused(tmp_path, other.encode(), r"the reference direction .* no whole number")


def test_comments_may_stand_between_datasets(tmp_path, text):
    delimiter = text.index("    -1\n    -1\n") + len("    -1\n")
    comment = "Workpiece A\nFile written 19 May 2021 09:58:46\n\tby M\xfcller\n"
    commented = text[:delimiter] + comment + text[delimiter:] + comment
    np.testing.assert_array_equal(read(tmp_path, commented).frf, read(tmp_path, text).frf)


@pytest.mark.parametrize("form", ["{:13.5E}", "{:13.4e}", "D", "e+0", "no letter"])
def test_exponents_of_any_legal_form_are_read(tmp_path, form):
    """Dataset 15 and values of dataset 58 as Fortran, C and Windows write them."""

    def written(value):
        if form.startswith("{"):
            return form.format(value)
        mantissa, exponent = f"{value:.5E}".split("E")
        number, letter = int(exponent), {"D": "D", "e+0": "e", "no letter": ""}[form]
        digits = f"{number:+03d}" if form == "D" else f"{number:+04d}"
        return f"{mantissa}{letter}{digits}".rjust(13)

    nodes = ((1, -0.25, -1e-3, -0.5), (2, 0.25, 1.25, -2e-6))
    rows = [
        f"{n:10d}{0:10d}{0:10d}{0:10d}{written(x)}{written(y)}{written(z)}" for n, x, y, z in nodes
    ]
    values = [-1.5, 2.5e-3, -3e2, 0.125, 7e-12, -1.0]
    head = [
        *["NONE"] * 5,
        f"{4:5d}{1:10d}{1:5d}{0:10d} {'NONE':<10}{1:10d}{3:4d} {'NONE':<10}{2:10d}{-3:4d}",
        f"{5:10d}{3:10d}{1:10d}{written(5.0)}{written(0.5)}{written(0.0)}",
        *(f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}" for kind in (18, 12, 13, 0)),
    ]
    blocks = (["    15", *rows], ["    58", *head, "".join(map(written, values))])
    units = ["   164", f"{1:10d}{'SI':>20}{1:10d}", "  1.0D+00  1.0D+00  1.0D+00", "  0.0D+00"]
    content = "".join("\n".join(["    -1", *lines, "    -1\n"]) for lines in (units, *blocks))
    found = read(tmp_path, content)
    assert found.positions == {str(n): (x, y, z) for n, x, y, z in nodes}
    np.testing.assert_array_equal(found.frequency, [5.0, 5.5, 6.0])
    np.testing.assert_array_equal(
        found.frf[0, 0], np.array(values[::2]) + 1j * np.array(values[1::2])
    )


def test_an_end_of_file_of_old_systems_may_stand_behind_the_datasets(tmp_path, text):
    assert read(tmp_path, text + "\x1a\0\r\n").frf.shape == (1, 1, 5)


def test_a_negative_dataset_number_drops_no_dataset(tmp_path, text):
    message = r"opens with b'   -58.*the number of its dataset is needed"
    refused(tmp_path, text.replace("    58\n", "   -58\n", 1), message)


def test_a_shifted_dataset_number_drops_no_dataset(tmp_path, text):
    refused(tmp_path, text.replace("    58\n", "     58\n", 1), r"opens with b'     58.*is needed")


def test_a_node_record_that_is_cut_is_refused(tmp_path, text):
    lines = text.split("\n")
    start = lines.index("  2411") + 1
    del lines[start + 1]
    refused(tmp_path, "\n".join(lines), r"dataset 2411\) cannot be decoded: .* no line of coordin")


def test_a_number_of_a_node_that_is_none_is_refused(tmp_path, text):
    lines = text.split("\n")
    start = lines.index("  2411") + 1
    lines[start + 1] = lines[start + 1].replace("E", "F", 1).replace("e", "f", 1)
    refused(tmp_path, "\n".join(lines), r"line 2 .*is no number")


@pytest.mark.parametrize("value", [1e300, 1e31])
def test_values_beyond_any_unit_are_refused(tmp_path, text, value):
    def damaged(line):
        return f"{value:20.12e}" + line[20:]

    refused(
        tmp_path, changed_line(text, 11, damaged), r"holds .* as frf; finite numbers up to 1e\+30"
    )


def test_lines_beyond_any_unit_are_refused(tmp_path, text):
    lines, start = function_lines(text)
    abscissa = lines[start + 6][30:56]  # the same for all functions
    damaged = text.replace(abscissa, abscissa[:13] + f"{1e33:13.5e}")
    refused(tmp_path, damaged, r"holds .* as frequency; finite numbers up to 1e\+30")


def test_values_over_more_than_forty_decades_are_refused(tmp_path, text):
    def widened(line):
        return f"{1e-60:20.12e}" * 2 + line[40:]

    refused(tmp_path, changed_line(text, 11, widened), "less than 40 decades are needed")


@pytest.mark.parametrize(
    "note",
    ['{"averages": "16"}', '{"averages": true}', '{"averages": 0}', '{"force_level": -1}'],
)
def test_a_changed_note_is_refused(tmp_path, text, note):
    key = note.split('"')[1]
    refused(tmp_path, changed_line(text, 3, lambda line: note.ljust(80)), f"records {key}=")


@pytest.mark.parametrize(
    "names", ["null", '["s1"]', '"ab"', '["", ""]', '{"a": 1, "b": 2}', "[1, 2]"]
)
def test_names_of_another_kind_are_refused(tmp_path, text, names):
    note = '{"names": ' + names + "}"
    refused(tmp_path, changed_line(text, 4, lambda line: note.ljust(80)), "records names=")
