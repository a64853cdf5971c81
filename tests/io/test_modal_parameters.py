"""Modal parameters of universal files, tables and arrays of pyOMA2."""

import numpy as np
import pytest
import pyuff
import scipy.io

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.io._gate import FileWarning
from bayes_placement.io._modal_arrays import holds_modal_parameters
from tests.io.uff.hand_typed import typed
from tests.io.uff.test_modes import HAND_TYPED

FREQUENCY = np.array([12.5, 31.0])
SHAPE = np.array([[1.0, 2.0], [-0.5, 1.0], [0.25, -3.0]])


def known(**changes):
    arguments = {
        "damping_ratio": [0.01, np.nan],
        "damping_ratio_deviation": [0.001, np.nan],
        "shape": SHAPE,
        "shape_deviation": 0.1 * np.abs(SHAPE),
        "sensors": ["s1", "s2+x", "s3-z"],
    } | changes
    return bp.ModalParameters(FREQUENCY, 0.01 * FREQUENCY, **arguments)


@pytest.mark.parametrize("changes", [{}, {"number": [2, 5]}])
def test_a_table_gives_back_what_was_written(tmp_path, changes):
    path = bp.io.modal_parameters.write(known(**changes), tmp_path / "modes.csv")
    back = bp.io.modal_parameters.read(path)
    for name in ("values", "covariance"):
        np.testing.assert_array_equal(getattr(back, name), getattr(known(), name))
    assert (back.sensors, back.number) == (known(**changes).sensors, known(**changes).number)


def test_a_table_typed_by_hand_takes_relative_deviations(tmp_path):
    path = tmp_path / "modes.csv"
    path.write_text("natural_frequency [Hz],shape s1,shape s2\n12.5,1,-0.5\n31,2,1\n")
    read = bp.io.modal_parameters.read(path, frequency_deviation=0.01, shape_deviation=0.05)
    np.testing.assert_allclose(read.deviation[0], [0.125, 0.31])
    np.testing.assert_allclose(read.deviation[2:], [[0.05, 0.1], [0.05, 0.1]])
    assert np.isnan(read.damping_ratio).all()


@pytest.mark.parametrize(
    "headings",
    [
        "Natural frequency [Hz],Natural frequency deviation [Hz],Damping ratio [1],Shape s1",
        "natural_frequency_hz,natural_frequency_deviation_hz,damping_ratio,shape s1",
        "Frequency (Hz),Frequency deviation (HZ),Damping,shape s1",
    ],
)
def test_headings_of_a_table_may_be_written_in_other_letters(tmp_path, headings):
    path = tmp_path / "modes.csv"
    path.write_text(f"{headings}\n12.5,0.1,0.01,1\n31,0.2,0.02,2\n")
    read = bp.io.modal_parameters.read(path, damping_deviation=0.1, shape_deviation=0.05)
    np.testing.assert_array_equal(read.natural_frequency, FREQUENCY)
    np.testing.assert_allclose(read.deviation[0], [0.1, 0.2])
    np.testing.assert_array_equal(read.damping_ratio, [0.01, 0.02])
    assert [channel.label for channel in read.sensors] == ["s1"]
    assert holds_modal_parameters(path) == ("atural" in headings)


def test_two_columns_of_one_quantity_are_refused(tmp_path):
    path = tmp_path / "modes.csv"
    path.write_text("Frequency [Hz],natural_frequency [Hz]\n12.5,12.6\n")
    with pytest.raises(InputError, match="two columns are 'natural_frequency'"):
        bp.io.modal_parameters.read(path, frequency_deviation=0.01)


def test_normal_modes_of_a_hand_typed_universal_file(tmp_path):
    path = tmp_path / "typed.uff"
    path.write_text(HAND_TYPED)
    read = bp.io.modal_parameters.read(
        path,
        frequency_deviation=1e-3,
        damping_deviation=0.1,
        shape_deviation=0.02,
        names={7: "s1"},
    )
    np.testing.assert_allclose(read.natural_frequency, [12.5])
    np.testing.assert_allclose(read.damping_ratio, [0.02])
    assert [channel.label for channel in read.sensors] == ["s1+x", "s1+z", "101+x", "101+z"]
    np.testing.assert_allclose(read.shape[:, 0], [-2.0, 1e-10, 6.0, -0.8])
    np.testing.assert_allclose(read.deviation[:, 0], [0.0125, 0.002, *[0.12] * 4])


RADIANS, POLE = 2 * np.pi * FREQUENCY, np.array(-0.02 + 1j * np.sqrt(1 - 0.02**2))
ASKED = r"positive real parts .*modal A does not say .*poles=\"Hz\""


@pytest.mark.parametrize(
    ("poles", "modal_a", "unit", "refusal"),
    [
        (RADIANS * POLE, 1, None, ""),
        (RADIANS * POLE, 2j * RADIANS, None, ""),
        (FREQUENCY * POLE, 2j * RADIANS, None, ""),
        (-FREQUENCY * POLE.conj(), 2j * RADIANS, None, ""),
        (-RADIANS * POLE.conj(), 2j * RADIANS, None, ""),
        (FREQUENCY * POLE, 1, "Hz", ""),
        (-FREQUENCY * POLE.conj(), 1, "Hz", ""),
        (-FREQUENCY * POLE.conj(), 1, None, ASKED),
        (
            RADIANS * (np.array([1, -1]) * POLE.real + 1j * POLE.imag),
            1,
            "rad/s",
            "a structure loses energy",
        ),
    ],
)
def test_complex_modes_of_a_universal_file_become_real(tmp_path, poles, modal_a, unit, refusal):
    """Each shape is turned; modal A says the unit of the poles where shapes have unit mass."""
    path, turn = tmp_path / "complex.uff", np.exp(0.7j)
    all_modal_a = np.broadcast_to(modal_a, poles.shape)
    file = pyuff.UFF(str(path))
    for mode in (1, 0):
        dataset = pyuff.prepare_55(
            **{f"id{line}": "NONE" for line in range(1, 6)},
            model_type=1,
            analysis_type=3,
            data_ch=2,
            spec_data_type=8,
            data_type=5,
            n_data_per_node=3,
            load_case=1,
            mode_n=mode + 1,
            eig=poles[mode],
            modal_a=complex(all_modal_a[mode]),
            modal_b=1 + 0j,
            node_nums=np.array([1, 2, 3]),
            r1=np.zeros(3, complex),
            r2=SHAPE[:, mode] * turn,
            r3=np.zeros(3, complex),
        )
        file.write_sets([dataset], "add")
    deviations = dict.fromkeys(
        ("frequency_deviation", "damping_deviation", "shape_deviation"), 0.02
    )
    if refusal:
        with pytest.raises(ValueError, match=refusal):
            bp.io.modal_parameters.read(path, **deviations, poles=unit)
        return
    lines = [f"{name} = {value}" for name, value in deviations.items()]
    lines += [f'poles = "{unit}"'] if unit else []
    mapping = tmp_path / "modes.toml"
    mapping.write_text("\n".join(["[modal_parameters]", 'file = "complex.uff"', *lines]))
    read = bp.io.modal_parameters.read(mapping)
    np.testing.assert_allclose(read.natural_frequency, FREQUENCY, rtol=1e-5)
    np.testing.assert_allclose(read.damping_ratio, 0.02, rtol=1e-4)
    assert [channel.label for channel in read.sensors] == ["1+y", "2+y", "3+y"]
    np.testing.assert_allclose(np.abs(read.shape), np.abs(SHAPE), rtol=1e-4)


@pytest.mark.parametrize("as_object", [True, False])
def test_arrays_of_pyoma2_sorted_by_frequency(as_object):
    """Its shapes are complex and scaled to their greatest component, which has no deviation."""
    scaled = SHAPE / SHAPE[[0, 2], [0, 1]]
    deviation = np.where(scaled == 1, 0.0, 0.05)
    arrays = {
        "Fn": FREQUENCY[::-1],
        "Fn_std": [0.2, 0.1],
        "Xi": [0.02, 0.01],
        "Xi_std": [2e-3, 1e-3],
        "Phi": scaled[:, ::-1] * np.exp(0.02j),
        "Phi_std": deviation[:, ::-1],
    }
    result = type("SSIResult", (), arrays)() if as_object else arrays
    read = bp.io.modal_parameters.of_pyoma2(result, ["s1", "s2", "s3"])
    np.testing.assert_allclose(read.natural_frequency, FREQUENCY)
    np.testing.assert_allclose(read.deviation[0], [0.1, 0.2])
    np.testing.assert_allclose(read.shape / read.shape[0], SHAPE / SHAPE[0], rtol=1e-9)
    assert read.deviation[2, 0] < 1e-5 and read.deviation[4, 1] < 1e-5
    np.testing.assert_allclose(read.deviation[3], 0.05)


REFUSED = {
    "no deviations": (
        lambda folder: bp.io.modal_parameters.read(universal(folder)),
        "states no standard deviation of natural frequency",
    ),
    "no modes": (
        lambda folder: bp.io.modal_parameters.read(
            universal(folder, ("         1         2         2", "         1         1         2"))
        ),
        "no mode among them",
    ),
    "no natural frequencies": (
        lambda folder: bp.io.modal_parameters.read(table(folder, "f,shape s1\n1,2\n")),
        "has the columns f, shape s1 and no natural_frequency",
    ),
    "radians": (
        lambda folder: bp.io.modal_parameters.read(
            table(folder, "natural_frequency [rad/s],shape s1\n1,2\n")
        ),
        r"is in \[rad/s\]; \[Hz\] is needed",
    ),
    "other bytes": (
        lambda folder: bp.io.modal_parameters.read(table(folder, "\0\1")),
        "modes.csv",
    ),
    "correlated": (
        lambda folder: bp.io.modal_parameters.write(
            bp.ModalParameters(
                [1.0], damping_ratio=[0.01], covariance=[[[1, 1e-4], [1e-4, 1e-4]]], number=[1]
            ),
            folder / "modes.csv",
        ),
        "correlated errors were to be written",
    ),
    "no uncertainty of pyOMA2": (
        lambda _: bp.io.modal_parameters.of_pyoma2({"Fn": [1.0], "Phi": [[1.0]]}, ["s1"]),
        r"Fn_std, Xi, Xi_std, Phi_std of pyOMA2 was not given",
    ),
    "mostly imaginary": (
        lambda _: bp.ModalParameters.of_complex_shapes(
            np.array([[1.0], [1j]]), [1.0], natural_frequency_deviation=[0.1], sensors=["s1", "s2"]
        ),
        "imaginary after the best turn",
    ),
}


def universal(folder, *changes):
    return typed(folder, HAND_TYPED, *changes)


def table(folder, text):
    path = folder / "modes.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_wrong_is_refused_in_words(tmp_path, name):
    call, words = REFUSED[name]
    with pytest.raises(InputError, match=words):
        call(tmp_path)


MAPPING = """\
[modal_parameters]
file = "typed.uff"
frequency_deviation = 0.001
damping_deviation = 0.1
shape_deviation = 0.02
names = { 7 = "s1" }
"""


def test_a_mapping_says_what_a_universal_file_does_not(tmp_path):
    (tmp_path / "typed.uff").write_text(HAND_TYPED)
    path = tmp_path / "modes.toml"
    path.write_text(MAPPING)
    mapped = bp.io.modal_parameters.read(path)
    stated = {"frequency_deviation": 1e-3, "damping_deviation": 0.1, "shape_deviation": 0.02}
    by_hand = bp.io.modal_parameters.read(tmp_path / "typed.uff", names={7: "s1"}, **stated)
    for name in ("values", "covariance"):
        np.testing.assert_array_equal(getattr(mapped, name), getattr(by_hand, name))
    assert mapped.sensors == by_hand.sensors
    wider = bp.io.modal_parameters.read(path, frequency_deviation=0.01)
    np.testing.assert_allclose(wider.deviation[0], 10 * mapped.deviation[0])


@pytest.mark.parametrize(
    ("line", "instead", "words"),
    [
        ("[modal_parameters]", "[modes]", r"has no table \[modal_parameters\]"),
        ("frequency_dev", "frequenzy_dev", 'nearest known one is "frequency_deviation"'),
        ('file = "typed.uff"', "", "modal_parameters.file is missing"),
        ("shape_deviation = 0.02", 'shape_deviation = "2 %"', "a finite number"),
        ("names = { 7", "names = { n7", "a table of names is needed"),
        ("frequency_deviation = 0.001\n", "", r"with \[modal_parameters\], file = "),
    ],
)
def test_a_wrong_mapping_is_refused_in_a_sentence(tmp_path, line, instead, words):
    (tmp_path / "typed.uff").write_text(HAND_TYPED)
    path = tmp_path / "modes.toml"
    path.write_text(MAPPING.replace(line, instead))
    with pytest.raises(InputError, match=words):
        bp.io.modal_parameters.read(path)


def test_files_of_modes_are_told_from_files_of_frfs(tmp_path):
    frfs = bp.Measurement.from_arrays(
        np.ones((1, 1, 2), complex),
        [1.0, 2.0],
        sensors=["s1"],
        actuators=["a1"],
        quantity="mobility",
    )
    bp.io.uff.write(tmp_path / "frfs.uff", frfs)
    bp.io.uff.write(tmp_path / "binary.uff", frfs, binary=True)
    bp.io.modal_parameters.write(known(), tmp_path / "modes.csv")
    texts = {
        "modes.uff": HAND_TYPED,
        "both.uff": HAND_TYPED + (tmp_path / "frfs.uff").read_text(),
        "modes.toml": MAPPING,
        "frfs.toml": 'file = "frfs.mat"',
        "frfs.csv": "frequency [Hz],real,imaginary\n1,2,3\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    names = {*texts, "frfs.uff", "binary.uff", "modes.csv", "missing.csv"}
    modal_files = {name for name in names if holds_modal_parameters(tmp_path / name)}
    assert modal_files == {"modes.csv", "modes.uff", "modes.toml"}


@pytest.mark.parametrize(
    "names",
    [("freqExp", "dampExp", "psiExp"), ("fn", "zeta", "phi"), ("Fn", "Xi", "Phi")],
)
@pytest.mark.parametrize("ending", [".mat", ".npz"])
def test_arrays_that_are_named_as_modal_parameters_are(tmp_path, names, ending):
    path = tmp_path / f"modes{ending}"
    order = np.array([1, 0])
    content = dict(
        zip(names, (FREQUENCY[order], np.array([0.02, 0.01]), SHAPE[:, order]), strict=True)
    )
    content |= {f"{names[0]}_std": np.array([0.2, 0.1])}
    write = scipy.io.savemat if ending == ".mat" else lambda file, of: np.savez(file, **of)
    write(path, content)
    assert holds_modal_parameters(path)
    read = bp.io.modal_parameters.read(
        path, damping_deviation=0.1, shape_deviation=0.02, names={1: "s1+y"}
    )
    np.testing.assert_allclose(read.natural_frequency, FREQUENCY)
    np.testing.assert_allclose(read.damping_ratio, [0.01, 0.02])
    np.testing.assert_allclose(read.deviation[0], [0.1, 0.2])
    np.testing.assert_allclose(read.shape, SHAPE)
    assert [channel.label for channel in read.sensors] == ["s1+y", "2", "3"]


def test_arrays_keep_covariances(tmp_path):
    root = np.random.default_rng(0).normal(size=(2, 5, 5))
    covariance = root @ root.swapaxes(1, 2) * 1e-4
    shaped = bp.ModalParameters(
        FREQUENCY,
        damping_ratio=[0.01, 0.02],
        shape=SHAPE,
        sensors=["s1", "s2+x", "s3-z"],
        covariance=covariance,
    )
    related = bp.ModalParameters(
        [1.0, 2.0], [0.1, 0.1], correlation=[[1, 0.5], [0.5, 1]], number=[1, 3]
    )
    for modes in (shaped, related):
        path = bp.io.modal_parameters.write(modes, tmp_path / "modes.npz")
        assert holds_modal_parameters(path)
        read = bp.io.modal_parameters.read(path)
        for name in ("values", "covariance", "correlation"):
            np.testing.assert_array_equal(getattr(read, name), getattr(modes, name))
        assert (read.sensors, read.number) == (modes.sensors, modes.number)


def with_covariance(modes):
    root = np.random.default_rng(1).normal(size=(modes, 5, 5))
    return bp.ModalParameters(
        FREQUENCY[:modes],
        damping_ratio=[0.01, 0.02][:modes],
        shape=SHAPE[:, :modes],
        sensors=["s1", "s2+x", "s3-z"],
        covariance=(root @ root.swapaxes(1, 2) + np.eye(5)) * 1e-4,
    )


@pytest.mark.parametrize("modes", [1, 2])
@pytest.mark.parametrize("ending", [".mat", ".npz"])
def test_a_covariance_that_anybody_saves_is_read_in_the_order_of_frequency(tmp_path, ending, modes):
    saved, path, order = with_covariance(modes), tmp_path / f"modes{ending}", np.arange(modes)[::-1]
    content = {"fn": saved.natural_frequency[order], "phi": saved.shape[:, order]}
    content |= {"zeta": saved.damping_ratio[order], "covariance": saved.covariance[order]}
    content["sensors"] = np.array([each.label for each in saved.sensors], dtype=object)
    if ending == ".mat":
        scipy.io.savemat(path, {"modes": content | {"number": [1, 3][:modes][::-1]}})
    else:
        np.savez(path, **content | {"sensors": content["sensors"].astype(str)})
    read = bp.io.modal_parameters.read(path)
    for name in ("values", "covariance", "sensors"):
        np.testing.assert_array_equal(getattr(read, name), getattr(saved, name))
    assert read.number == ((1, 3)[:modes] if ending == ".mat" else None)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (lambda known: {"covariance": known[:, :4, :4]}, r"\(2, 4, 4\);.*= \(2, 5, 5\) is needed"),
        (lambda known: {"covariance": known[:1]}, r"\(1, 5, 5\);.*= \(2, 5, 5\) is needed"),
        (lambda known: {"covariance": -known}, "no positive standard deviation"),
        (lambda known: {"covariance": np.triu(known)}, "not symmetric and positive definite"),
        (lambda known: {"correlation": np.eye(3)}, r"\(mode, mode\) = \(2, 2\)"),
        (lambda known: {"number": np.arange(1, 4)}, "2 whole numbers from 1 on are needed"),
    ],
)
def test_a_wrong_covariance_of_a_file_is_refused_in_a_sentence(tmp_path, changes, words):
    saved, path = with_covariance(2), tmp_path / "modes.npz"
    content = {"fn": FREQUENCY, "zeta": saved.damping_ratio, "phi": SHAPE}
    np.savez(path, **content | {"covariance": saved.covariance} | changes(saved.covariance))
    with pytest.raises(InputError, match=rf"modes\.npz: .*{words}"):
        bp.io.modal_parameters.read(path)


def test_arrays_that_are_not_read_are_told(tmp_path):
    path = tmp_path / "modes.npz"
    np.savez(path, fn=FREQUENCY, temperature=20.0, covariances=np.eye(2))
    with pytest.warns(FileWarning, match=r"modes\.npz: not read: temperature, covariances, since"):
        bp.io.modal_parameters.read(path, frequency_deviation=0.01)


def test_arrays_that_are_no_modal_parameters_are_refused(tmp_path):
    path = tmp_path / "modes.mat"
    scipy.io.savemat(path, {"H": np.eye(3)})
    assert not holds_modal_parameters(path)
    with pytest.raises(ValueError, match=r"modes\.mat: it holds H, none of which is named as"):
        bp.io.modal_parameters.read(path, frequency_deviation=0.01)
    scipy.io.savemat(path, {"fn": FREQUENCY, "phi": SHAPE.T})
    with pytest.raises(ValueError, match=r"phi has the shape \(2, 3\), and there are 2 natural"):
        bp.io.modal_parameters.read(path, frequency_deviation=0.01, shape_deviation=0.01)
    scipy.io.savemat(path, {"fn": FREQUENCY, "freq": FREQUENCY})
    with pytest.raises(ValueError, match=r"either could be the natural_frequency"):
        bp.io.modal_parameters.read(path, frequency_deviation=0.01)
    wav = tmp_path / "modes.wav"
    wav.write_bytes(b"RIFF" + b"\0" * 40)
    with pytest.raises(ValueError, match=r"is WAV by its first bytes, .* by .*time_records"):
        bp.io.modal_parameters.read(wav, frequency_deviation=0.01)
