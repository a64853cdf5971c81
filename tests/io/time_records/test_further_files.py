"""Recordings of LabVIEW text, universal files, RF64, NumPy arrays and UTF-16; units as words."""

import struct

import numpy as np
import pytest
import pyuff
from scipy.io import wavfile

from bayes_placement.io.time_records import Signal, read
from tests.io.time_records.test_files import (
    FORCE,
    MOTION,
    NEWTONS,
    RATE,
    TDMS,
    TIME,
    check,
    tdms,
)

HEADER = {"Writer_Version": "2", "Separator": "Tab", "Decimal_Separator": "."}


def lvm(path, *, x="One", decimal=".", separator="Tab", segments=((0, 256),), starts=None, **tags):
    """Write segments of samples; `x` says how many columns of X there are."""
    mark = {"Tab": "\t", "Comma": ","}[separator]
    head = HEADER | {"Separator": separator, "Decimal_Separator": decimal, "X_Columns": x}

    def row(*cells):
        return mark.join(map(str, cells)).replace(".", decimal)

    def number(value):
        return f"{value:.12g}"

    def aligned(tag, first, second):
        return row(tag, first, "", second) if x == "Multi" else row(tag, first, second)

    text = ["LabVIEW Measurement", *(mark.join(item) for item in head.items())]
    text += ["***End_of_Header***", "", "***Start_Special***", "X_Value", "***End_Special***"]
    for (low, high), start in zip(
        segments, starts or [TIME[low] for low, _ in segments], strict=True
    ):
        said = {
            "Samples": (high - low,) * 2,
            "Y_Unit_Label": ("Newtons", "m/s^2"),
            "X_Dimension": ("Time",) * 2,
            "X0": (number(start),) * 2,
            "Delta_X": (number(1 / RATE),) * 2,
        } | tags
        text += ["", row("Channels", 2), *(aligned(tag, *pair) for tag, pair in said.items())]
        text += ["***End_of_Header***"]
        columns = ["X_Value", "F", "X_Value", "acc"] if x == "Multi" else ["X_Value", "F", "acc"]
        text += [mark.join([*columns, "Comment"])]
        for k in range(low, high):
            at = "" if x == "No" else number(TIME[k])
            pair = number(FORCE[k]), number(MOTION[k])
            cells = [at, pair[0], at, pair[1]] if x == "Multi" else [at, *pair]
            text.append(row(*cells, *(["struck here"] if k == low else [])))
    path.write_text("\r\n".join(text), newline="")
    return path


@pytest.mark.parametrize("x", ["No", "One", "Multi"])
@pytest.mark.parametrize(("separator", "decimal"), [("Tab", "."), ("Tab", ","), ("Comma", ".")])
def test_labview_text(tmp_path, x, separator, decimal):
    path = lvm(tmp_path / "hit.lvm", x=x, separator=separator, decimal=decimal)
    check(read(path, NEWTONS), 1e-11)
    with pytest.raises(ValueError, match=r"'F' is in 'Newtons' by the file, and Signal says 'kN'"):
        read(path, {"hammer": Signal("F", "kN")})


def test_segments_of_labview_text_are_joined_where_they_continue(tmp_path):
    parts = ((0, 100), (100, 256))
    check(read(lvm(tmp_path / "hit.lvm", segments=parts), NEWTONS), 1e-11)
    hits = lvm(tmp_path / "hits.lvm", segments=parts, starts=(0.0, 0.0))
    second = {"s1": Signal("segment 2/acc", "m/s^2")}
    np.testing.assert_allclose(read(hits, second)["s1"], MOTION[100:], atol=1e-9)


def test_what_labview_text_leaves_open_or_contradicts_is_told(tmp_path):
    path = lvm(tmp_path / "cut.lvm", Samples=(300, 256))
    with pytest.warns(UserWarning, match=r"announces 300 samples of 'F' and holds 256"):
        read(path, NEWTONS)
    spectrum = lvm(tmp_path / "spectrum.lvm", X_Dimension=("Frequency", "Time"))
    with pytest.raises(ValueError, match=r"'F' cannot be used: it is over Frequency"):
        read(spectrum, NEWTONS)
    wrong = tmp_path / "wrong.lvm"
    wrong.write_text(lvm(tmp_path / "hit.lvm").read_text().replace(f"\t{FORCE[41]:.12g}", "\t12o"))
    with pytest.raises(ValueError, match=r"wrong\.lvm: '12o' stands where a number is needed"):
        read(wrong, NEWTONS)
    bare = tmp_path / "bare.lvm"
    bare.write_text("LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\n1\t2\n")
    with pytest.raises(ValueError, match=r"bare\.lvm: it has no segment with channels"):
        read(bare, NEWTONS)
    rate = lvm(tmp_path / "rate.lvm", Delta_X=("", ""))
    check(read(rate, NEWTONS), 1e-11)  # by the column of X


def write_universal(path, **fields):
    file = pyuff.UFF(str(path))
    for node, (values, kind, unit) in enumerate(((FORCE, 13, "N"), (MOTION, 12, "m/s2")), start=1):
        dataset = {
            "type": 58, "func_type": 1, "binary": 0, "rsp_node": node, "rsp_dir": 3,
            "ref_node": 0, "ref_dir": 0, "data": values, "x": TIME,
            "abscissa_spec_data_type": 17, "ordinate_spec_data_type": kind,
            "orddenom_spec_data_type": 0,
            "ordinate_axis_units_lab": unit,
        }  # fmt: skip
        file.write_sets([dataset | fields], "add")
    return path


UNIVERSAL = {"hammer": Signal("1+z", "N"), "s1": Signal("2+z", "m/s^2")}


def test_time_histories_of_universal_files(tmp_path):
    path = write_universal(tmp_path / "hits.uff")
    recording = read(path, UNIVERSAL)
    assert recording.rate == pytest.approx(RATE, rel=1e-5)  # of six digits
    np.testing.assert_allclose(recording["hammer"], FORCE, atol=1e-3)
    np.testing.assert_allclose(recording["s1"], MOTION, atol=1e-3)
    write_universal(path, rsp_node=7, rsp_dir=-5)
    repeated = {"hammer": Signal("7 direction -5", "N")}
    np.testing.assert_allclose(read(path, repeated)["hammer"], FORCE, atol=1e-3)
    second = {"s1": Signal("7 direction -5 (2)", "m/s^2")}
    np.testing.assert_allclose(read(path, second)["s1"], MOTION, atol=1e-3)
    over_lines = write_universal(tmp_path / "spectra.uff", abscissa_spec_data_type=18)
    with pytest.raises(ValueError, match=r"over data type 18 in .*; time \(17\) in s is needed"):
        read(over_lines, UNIVERSAL)
    frfs = write_universal(tmp_path / "frfs.uff", func_type=4)
    with pytest.raises(ValueError, match=r"holds functions of type \[4\]; time histories"):
        read(frfs, UNIVERSAL)


def test_wav_files_of_64_bits(tmp_path):
    """EBU Tech 3306: the sizes stand in a chunk ds64, and where they were is -1."""
    wavfile.write(tmp_path / "hit.wav", int(RATE), np.stack([FORCE, MOTION], axis=1) / 200)
    plain = (tmp_path / "hit.wav").read_bytes()
    start = plain.index(b"data")
    (size,) = struct.unpack_from("<I", plain, start + 4)
    sizes = struct.pack("<IQQQI", 28, len(plain) + 28, size, TIME.size, 0)
    content = b"RF64" + b"\xff" * 4 + b"WAVEds64" + sizes + plain[12 : start + 4] + b"\xff" * 4
    (tmp_path / "long.wav").write_bytes(content + plain[start + 8 :])
    channels = {"hammer": Signal("channel 1", "200 N"), "s1": Signal("channel 2", "200 m/s^2")}
    check(read(tmp_path / "long.wav", channels))


def test_a_numpy_array_and_text_of_16_bits(tmp_path):
    np.save(tmp_path / "hits.npy", np.stack([FORCE, MOTION]))
    channels = {"hammer": Signal(("hits", 1), "N"), "s1": Signal(("hits", 2), "m/s^2")}
    check(read(tmp_path / "hits.npy", channels, rate=RATE))
    np.save(tmp_path / "pickled.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match=r"pickled\.npy: it holds pickled objects"):
        read(tmp_path / "pickled.npy", channels, rate=RATE)
    rows = [f"{t!r}\t{f!r}\t{a!r}" for t, f, a in np.stack([TIME, FORCE, MOTION], axis=1).tolist()]
    text = "\r\n".join(["time [s]\tF [N]\tacc [m/s^2]", *rows])
    for encoding in ("utf-16", "utf-8-sig"):
        (tmp_path / "hits.txt").write_bytes(text.encode(encoding))
        check(read(tmp_path / "hits.txt", NEWTONS, time="time"))


@pytest.mark.parametrize(
    ("stated", "given"),
    [
        ("g's", "g"),
        ("Gs", "g"),
        ("meters per second squared", "m/s^2"),
        ("Meters/Second^2", "m/s²"),
        ("m/sec2", "m/s^2"),
        ("Inches/sec^2", "in/s^2"),
    ],
)
def test_units_may_be_words(tmp_path, stated, given):
    tdms(tmp_path / "hit.tdms", unit_string=stated)
    for unit in (given, stated):
        recording = read(tmp_path / "hit.tdms", TDMS | {"s1": Signal("Test/acc", unit)})
        assert recording.quantity["s1"] == "acceleration"


@pytest.mark.parametrize("stated", ["Pounds", "Volts", "in/s^2", "mm", "Millivolts", "kN"])
def test_the_unit_that_a_refusal_names_is_then_accepted(tmp_path, stated):
    tdms(tmp_path / "hit.tdms", unit_string=stated)
    with pytest.raises(ValueError, match="one unit is needed") as error:
        read(tmp_path / "hit.tdms", TDMS)
    advice = str(error.value).rpartition(": ")[2].removesuffix(".")
    signal = eval(advice, {"Signal": Signal})
    assert read(tmp_path / "hit.tdms", {"s1": signal}).samples["s1"].size == MOTION.size


def test_a_unit_that_is_not_known_contradicts_none(tmp_path):
    tdms(tmp_path / "hit.tdms", unit_string="EU")
    with pytest.warns(UserWarning, match=r"in 'EU' by the file, which is no unit that is known"):
        check(read(tmp_path / "hit.tdms", TDMS))
