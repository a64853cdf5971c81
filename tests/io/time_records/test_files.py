"""Recordings from files that SciPy, h5py, npTDMS and asammdf wrote, and what is refused."""

import importlib.util
import struct

import h5py
import numpy as np
import pytest
import scipy.io
from asammdf import MDF
from asammdf import Signal as MdfSignal
from nptdms import ChannelObject, TdmsWriter
from scipy.io import wavfile

import bayes_placement as bp
from bayes_placement._shared.errors import MissingExtraError
from bayes_placement.io.time_records import Signal, read

RATE = 2048.0
TIME = np.arange(256) / RATE
FORCE = 120.0 * np.exp(-(((TIME - 0.02) / 1e-3) ** 2))
MOTION = 30.0 * np.sin(2 * np.pi * 90 * TIME) * np.exp(-60 * TIME)
NEWTONS = {"hammer": Signal("F", "N"), "s1": Signal("acc", "m/s^2")}


def check(recording, rtol=1e-12):
    assert recording.rate == pytest.approx(RATE, rel=1e-6)
    np.testing.assert_allclose(recording["hammer"], FORCE, rtol=rtol, atol=rtol * 120)
    np.testing.assert_allclose(recording["s1"], MOTION, rtol=rtol, atol=rtol * 30)
    assert recording.quantity == {"hammer": "force", "s1": "acceleration"}


@pytest.mark.parametrize("kind", ["5", "4 to 7.2", "7.3"])
def test_matlab_files(tmp_path, kind):
    path = tmp_path / "hit.mat"
    variables = {"F": FORCE, "acc": MOTION, "fs": RATE}
    if kind == "7.3":
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in variables.items():
                file[name] = np.atleast_2d(values).T
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
        header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
        with path.open("r+b") as file:
            file.write(header)
    else:
        scipy.io.savemat(path, variables, do_compression=kind != "5")
    check(read(path, NEWTONS, rate=RATE))


def test_one_column_of_several(tmp_path):
    scipy.io.savemat(
        tmp_path / "hit.mat", {"data": np.stack([FORCE, 0 * TIME + 1, MOTION], axis=1)}
    )
    channels = {"hammer": Signal(("data", 1), "N"), "s1": Signal(("data", 3), "m/s^2")}
    check(read(tmp_path / "hit.mat", channels, rate=RATE))
    for source, sentence in (
        ("data", r"has the shape \(256, 3\), and Signal names no column"),
        (("data", 4), r"Column 4 of 'data' was requested, which has 3"),
        (("data", 0), r"Column 0 of 'data' was requested"),
    ):
        with pytest.raises(ValueError, match=sentence):
            read(tmp_path / "hit.mat", {"hammer": Signal(source, "N")}, rate=RATE)


@pytest.mark.parametrize("heading", ["t,F,acc", "t [s],F [N],acc [m/s^2]"])
def test_text_with_a_column_of_times(tmp_path, heading):
    table = np.column_stack([TIME, FORCE, MOTION])
    np.savetxt(tmp_path / "hit.csv", table, delimiter=",", header=heading, comments="")
    check(read(tmp_path / "hit.csv", NEWTONS, time="t"))
    check(read(tmp_path / "hit.csv", NEWTONS, time="t", rate=RATE))
    check(read(tmp_path / "hit.csv", NEWTONS, rate=RATE))
    with pytest.raises(ValueError, match=r"Sampling rates of 1000 and 2048 Hz are stated"):
        read(tmp_path / "hit.csv", NEWTONS, time="t", rate=1000.0)


def test_units_that_contradict_the_file_are_refused(tmp_path):
    table = np.column_stack([1e3 * TIME, FORCE, MOTION])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="t [ms],F [N],acc [g]", comments="")
    with pytest.raises(ValueError, match=r"a\.csv: 'acc' is in 'g' by the file, and Signal says"):
        read(tmp_path / "a.csv", NEWTONS, rate=RATE)
    channels = NEWTONS | {"s1": Signal("acc", "g")}
    with pytest.raises(ValueError, match=r"times 't' are in 'ms' by the file; seconds"):
        read(tmp_path / "a.csv", channels, time="t")
    recording = read(tmp_path / "a.csv", channels, rate=RATE)
    np.testing.assert_allclose(recording["s1"], 9.80665 * MOTION)


@pytest.mark.parametrize(
    ("times", "sentence"),
    [
        (np.round(TIME, 3), r"intervals off even spacing"),
        (TIME[::-1], r"increasing ones are needed"),
        (np.where(TIME > 0.1, TIME + 0.01, TIME), r"intervals off even spacing"),
    ],
)
def test_uneven_times_are_refused(tmp_path, times, sentence):
    table = np.column_stack([times, FORCE, MOTION])
    np.savetxt(tmp_path / "hit.csv", table, delimiter=",", header="t,F,acc", comments="")
    with pytest.raises(ValueError, match=sentence):
        read(tmp_path / "hit.csv", NEWTONS, time="t")


def test_times_of_other_samples_are_refused(tmp_path):
    scipy.io.savemat(tmp_path / "hit.mat", {"F": FORCE, "acc": MOTION, "t": TIME[::2]})
    with pytest.raises(ValueError, match=r"samples: hammer 256, s1 256, times 't' 128; the same"):
        read(tmp_path / "hit.mat", NEWTONS, time="t")


def test_times_may_be_rounded(tmp_path):
    table = np.column_stack([np.round(TIME, 5), FORCE, MOTION])
    np.savetxt(tmp_path / "hit.csv", table, delimiter=",", header="t,F,acc", comments="")
    assert read(tmp_path / "hit.csv", NEWTONS, time="t").rate == pytest.approx(RATE, rel=1e-4)


WAVS = {
    "16 bits": (np.int16, 2.0**15, 4e-5),
    "32 bits": (np.int32, 2.0**31, 1e-9),
    "8 bits": (np.uint8, 2.0**7, 8e-3),
    "floating point": (np.float32, 1.0, 1e-7),
}


@pytest.mark.parametrize(("dtype", "full", "digit"), WAVS.values(), ids=WAVS)
def test_wav_files_hold_shares_of_a_range(tmp_path, dtype, full, digit):
    volts = np.stack([FORCE * 0.01, MOTION * 0.1], axis=1)  # within 4 V
    scaled = volts / 4.0 * full + (full if dtype is np.uint8 else 0.0)
    rounded = np.round(scaled) if np.issubdtype(dtype, np.integer) else scaled
    wavfile.write(tmp_path / "hit.wav", int(RATE), rounded.astype(dtype))
    channels = {
        "hammer": Signal("channel 1", "4 V", sensitivity="10 mV/N"),
        "s1": Signal("channel 2", "4 V", sensitivity="0.1 V/(m/s^2)"),
    }
    recording = read(tmp_path / "hit.wav", channels)
    assert recording.rate == RATE
    np.testing.assert_allclose(recording["hammer"], FORCE, atol=digit * 400)
    np.testing.assert_allclose(recording["s1"], MOTION, atol=digit * 40)


def test_a_wav_file_that_ends_too_early_is_refused(tmp_path):
    samples = (FORCE * 100).astype(np.int16)
    wavfile.write(tmp_path / "hit.wav", int(RATE), samples)
    whole = (tmp_path / "hit.wav").read_bytes()
    (tmp_path / "short.wav").write_bytes(whole[:-100])
    with pytest.raises(ValueError, match=r"short\.wav"):
        read(tmp_path / "short.wav", {"hammer": Signal("channel 1", "N")})
    noted = whole[:12] + b"note" + struct.pack("<I", 4) + b"hit1" + whole[12:]
    (tmp_path / "noted.wav").write_bytes(noted)
    read(tmp_path / "noted.wav", {"hammer": Signal("channel 1", "N")})


@pytest.mark.parametrize(("whole", "announced"), [(0, 0), (36, 0), (548, 0), (548, 100), (36, 600)])
def test_samples_that_a_wav_file_does_not_announce_are_not_lost(tmp_path, whole, announced):
    path = tmp_path / "hit.wav"
    wavfile.write(path, int(RATE), (FORCE * 100).astype(np.int16))
    content = path.read_bytes()
    head = content[:4] + struct.pack("<I", whole) + content[8:40] + struct.pack("<I", announced)
    path.write_bytes(head + content[44:])
    with pytest.raises(ValueError, match=r"hit\.wav: its part .* announces .* and .* are left"):
        read(path, {"hammer": Signal("channel 1", "N")})


def test_a_record_without_a_sample_is_refused(tmp_path):
    np.savez(tmp_path / "hit.npz", F=np.zeros(0))
    with pytest.raises(ValueError, match="'F' holds no sample; a record of some is needed"):
        read(tmp_path / "hit.npz", {"hammer": Signal("F", "N")}, rate=RATE)


def tdms(path, **motion):
    about = {"wf_increment": 1 / RATE, "wf_start_offset": 0.0}
    channels = [
        ChannelObject("Test", "F", FORCE, about | {"unit_string": "N"}),
        ChannelObject("Test", "acc", MOTION, about | {"unit_string": "m/s^2"} | motion),
    ]
    with TdmsWriter(path) as file:
        file.write_segment(channels)


TDMS = {"hammer": Signal("Test/F", "N"), "s1": Signal("Test/acc", "m/s^2")}


def test_tdms_files(tmp_path):
    tdms(tmp_path / "hit.tdms")
    check(read(tmp_path / "hit.tdms", TDMS))
    check(read((tmp_path / "hit.tdms").rename(tmp_path / "hit.dat"), TDMS))
    with pytest.raises(ValueError, match=r"no 'Test/ac' in it\. Did you mean 'Test/acc'\?"):
        read(tmp_path / "hit.dat", {"s1": Signal("Test/ac", "m/s^2")})
    tdms(tmp_path / "other.tdms", wf_increment=2 / RATE)
    with pytest.raises(ValueError, match=r"Sampling rates of .* Hz are stated"):
        read(tmp_path / "other.tdms", TDMS)
    late = {"wf_start_offset": 0.01}, {"wf_start_time": np.datetime64("2026-01-01T00:00:00.01")}
    for start in late:
        tdms(tmp_path / "late.tdms", **start)
        with pytest.raises(ValueError, match=r"'Test/acc' begins .* s after 'Test/F'; one"):
            read(tmp_path / "late.tdms", TDMS)
        read(tmp_path / "late.tdms", {"s1": TDMS["s1"]})
    tdms(tmp_path / "g.tdms", unit_string="g")
    with pytest.raises(ValueError, match=r"'Test/acc' is in 'g' by the file"):
        read(tmp_path / "g.tdms", TDMS)


@pytest.mark.parametrize(
    "version", ["4.10", pytest.param("3.30", marks=[pytest.mark.long, pytest.mark.longest])]
)
def test_mdf_files(tmp_path, version):
    signals = [
        MdfSignal(FORCE, TIME, unit="N", name="F"),
        MdfSignal(MOTION, TIME, unit="m/s^2", name="acc"),
    ]
    with MDF(version=version) as file:
        file.append(signals)
        path = file.save(tmp_path / "hit", overwrite=True)
    check(read(path, NEWTONS), 1e-6)
    with pytest.raises(ValueError, match=r"no 'force' in it\. It holds "):
        read(path, {"hammer": Signal("force", "N")})


def test_mdf_channels_of_one_name_or_of_other_times_are_refused(tmp_path):
    with MDF(version="4.10") as file:
        file.append([MdfSignal(FORCE, TIME, unit="N", name="F")])
        file.append([MdfSignal(MOTION, TIME, unit="m/s^2", name="acc")])
        file.append([MdfSignal(MOTION, TIME + 0.5, unit="m/s^2", name="late")])
        file.append([MdfSignal(MOTION, TIME, unit="m/s^2", name="twice")])
        file.append([MdfSignal(MOTION, TIME, unit="m/s^2", name="twice")])
        path = file.save(tmp_path / "hit.mf4", overwrite=True)
    check(read(path, NEWTONS))
    with pytest.raises(ValueError, match=r"'late' begins 0.5 s after 'F'; one start is needed"):
        read(path, NEWTONS | {"s1": Signal("late", "m/s^2")})
    with pytest.raises(
        ValueError, match=r"'twice' cannot be used: 2 channels have this name, in groups 3, 4"
    ):
        read(path, NEWTONS | {"s1": Signal("twice", "m/s^2")})


@pytest.mark.parametrize(
    ("library", "extra", "beginning"), [("nptdms", "tdms", b"TDSm"), ("asammdf", "mdf", b"MDF ")]
)
def test_a_missing_library_is_named_with_its_extra(
    tmp_path, monkeypatch, library, extra, beginning
):
    (tmp_path / "hit.dat").write_bytes(beginning + bytes(100))
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == library else find(name)
    )
    with pytest.raises(MissingExtraError, match=rf'pip install "bayes_placement\[{extra}\]"'):
        read(tmp_path / "hit.dat", NEWTONS)


@pytest.mark.parametrize("beginning", [b"TDSm", b"MDF     4.10", b"RIFF\x00\x00\x00\x00WAVE", b"x"])
def test_damaged_files_are_refused_by_name(tmp_path, beginning):
    (tmp_path / "hit.dat").write_bytes(beginning + bytes(100))
    with pytest.raises(ValueError, match=r"hit\.dat"):
        read(tmp_path / "hit.dat", NEWTONS)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.wav; a file of time records"):
        read(tmp_path / "none.wav", NEWTONS)


def test_what_a_file_does_not_say_is_asked_for(tmp_path):
    scipy.io.savemat(tmp_path / "hit.mat", {"F": FORCE, "acc": MOTION[:-1], "words": "text"})
    with pytest.raises(ValueError, match=r"states no sampling rate; one is needed"):
        read(tmp_path / "hit.mat", {"hammer": Signal("F", "N")})
    with pytest.raises(ValueError, match=r"different numbers of samples: hammer 256, s1 255"):
        read(tmp_path / "hit.mat", NEWTONS, rate=RATE)
    with pytest.raises(ValueError, match=r"'words' holds .*; real numbers are needed"):
        read(tmp_path / "hit.mat", {"hammer": Signal("words", "N")}, rate=RATE)
    with pytest.raises(ValueError, match=r"a Signal for each label is needed"):
        read(tmp_path / "hit.mat", {}, rate=RATE)


@pytest.mark.parametrize(
    ("unit", "sensitivity", "quantity", "factor"),
    [
        ("N", None, "force", 1.0),
        ("lbf", None, "force", 4.4482216152605),
        ("m/s²", None, "acceleration", 1.0),
        ("g", None, "acceleration", 9.80665),
        ("mm/s", None, "velocity", 1e-3),
        ("um", None, "displacement", 1e-6),
        ("V", "2.25 mV/N", "force", 1 / 2.25e-3),
        ("mV", "100 mV/g", "acceleration", 9.80665 / 100),
        ("10 V", "10.2 mV/(m/s^2)", "acceleration", 10 / 10.2e-3),
        ("-1 N", None, "force", -1.0),
    ],
)
def test_units_and_sensitivities(unit, sensitivity, quantity, factor):
    scale = Signal("x", unit, sensitivity).scale()
    assert scale.quantity == quantity
    assert scale.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "sensitivity", "sentence"),
    [
        ("V", None, r"unit='V'\) was given without sensitivity; one is needed for volts"),
        ("N", "2.25 mV/N", r"a sensitivity is needed where the file holds volts only"),
        ("furlong", None, r"unit='furlong' was given; a known one is needed"),
        ("", None, r"unit='' was given; a known one"),
        ("0 V", "1 mV/N", r"unit='0 V' was given"),
        ("1.2.3 N", None, r"unit='1.2.3 N' was given"),
        ("V", "100 g", r"sensitivity='100 g' was given; a known one is needed"),
        ("Pa", None, r"unit='Pa' was given"),
    ],
)
def test_units_are_not_guessed(unit, sensitivity, sentence):
    with pytest.raises(ValueError, match=sentence):
        Signal("x", unit, sensitivity)


def recordings(count=3, **changes):
    random = np.random.default_rng(1)
    return [
        bp.time_records.Recording(
            RATE,
            {
                "hammer": FORCE + 0.1 * random.standard_normal(TIME.size),
                "s1": MOTION + 0.1 * random.standard_normal(TIME.size),
            }
            | changes.get("samples", {}),
            {"hammer": "force", "s1": "acceleration"} | changes.get("quantity", {}),
        )
        for _ in range(count)
    ]


def test_recordings_become_a_measurement():
    runs = recordings()
    options = {"excitation": bp.time_records.Impacts(), "band": (20.0, 200.0)}
    measurement = bp.time_records.frf_of(runs, "hammer", **options).measurement
    expected = bp.time_records.frf(
        [run["hammer"] for run in runs],
        [run["s1"] for run in runs],
        RATE,
        sensors="s1",
        actuator="hammer",
        quantity="acceleration",
        **options,
    ).measurement
    np.testing.assert_array_equal(measurement.frf, expected.frf)
    assert measurement.quantity == "accelerance"
    assert str(runs[0]) == "Recording of 0.125 s at 2048 Hz: hammer (force), s1 (acceleration)."


@pytest.mark.parametrize(
    ("runs", "actuator", "sentence"),
    [
        (recordings(), "a1", r"'a1' was named as the force, and it is no channel"),
        (recordings(), "s1", r"'s1' was named as the force, and it records acceleration"),
        ([], "hammer", r"No recording was given; one recording or several"),
        (
            recordings(samples={"s2": MOTION}, quantity={"s2": "velocity"}),
            "hammer",
            r"responses record acceleration and velocity; one quantity",
        ),
        (
            [*recordings(1), *recordings(1, samples={"s2": MOTION}, quantity={"s2": "velocity"})],
            "hammer",
            r"recordings differ in channels or sampling rate",
        ),
    ],
)
def test_recordings_that_are_no_repeats_are_refused(runs, actuator, sentence):
    with pytest.raises(ValueError, match=sentence):
        bp.time_records.frf_of(runs, actuator, excitation=bp.time_records.Impacts())


def test_a_channel_that_is_none_is_told():
    with pytest.raises(ValueError, match=r"'s2' was requested; the recording has hammer, s1"):
        recordings()[0]["s2"]
