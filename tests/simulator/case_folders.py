"""Draws as case folders: `case.json`, `measured.uff`, and the truth apart.

Independent of bayes_placement.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from tests.simulator import universal_files
from tests.simulator.fine_elements import Line
from tests.simulator.hidden_structures import Instrument
from tests.simulator.law_networks import ABSORBER, of_one_stiffness
from tests.simulator.unlisted_draws import UnlistedDraw
from tests.simulator.unlisted_effects import Hidden
from tests.simulator.unlisted_scenes import Scene, axial_or_plate
from tests.small_models import Plate as PlateModel

BAR = {
    "type": "axial bar",
    "axis": "x from 0 to length",
    "boundary_conditions": "fixed at x=0 and x=L",
    "motion": "axial displacement u(x), direction 1",
}
BEAM = {
    "type": "Euler-Bernoulli beam, bending",
    "axis": "x from 0 to length",
    "motion": (
        "transverse displacement w(x) along z, direction 3; bending stiffness E*width*height^3/12"
    ),
}
CANTILEVER = "clamped at x=0 (w=0, dw/dx=0), free at x=L"
SUSPENDED = "free-free on a soft suspension"
PLATE = {
    "type": "thin Kirchhoff plate",
    "boundary_conditions": (
        "simply supported on all four edges (w=0, rotation about the edge free)"
    ),
    "motion": "transverse displacement w(x,y) along z, direction 3",
}
CELLS, KEPT = (28, 21), 40
"""Elements along the sides of the nominal model of a plate, and modes that its file states."""

NAMES = {"youngs_modulus": "youngs_modulus_Pa", "density": "density_kg_m3"}
UNCERTAIN = NAMES | {"damping_ratio": "modal_damping_ratio"}

NOISE = (
    "E|H_meas-H|^2 = |H_meas|^2 (1-g2)/(n_averages g2), g2 = coherence, circular complex Gaussian"
)
IMPERFECT = (
    ". This is the scatter of the measurement alone: the nominal model is not exact (geometry, "
    "material and damping as built differ a little from the drawing, gains are calibrated to about "
    "1 %)."
)
ANGLES = (
    "R = Rx(tx) Ry(ty) Rz(tz) (active, right-handed, radians); column j of R is the true direction "
    "(global axes) of the recorded axis j; a recorded direction -j is the opposite"
)


def write(draw: UnlistedDraw, name: str, cases: Path, truth: Path) -> None:
    """Write the folder of a case, and its truth as `truth/NAME.json`."""
    folder = cases / name
    folder.mkdir(parents=True, exist_ok=True)
    truth.mkdir(parents=True, exist_ok=True)
    if draw.form == "plate":
        write_plate_model(draw.scene, folder / "model")
    sides = draw.scene.sensors, draw.scene.actuators
    universal_files.write(folder / "measured.uff", draw.record, *sides)
    dump(case(draw, name), folder / "case.json")
    dump(truth_of(draw, name), truth / f"{name}.json")


def dump(content: Any, path: Path) -> None:
    path.write_text(json.dumps(content, indent=1, default=lambda value: value.tolist()))


def case(draw: UnlistedDraw, name: str) -> dict[str, Any]:
    """Content of `case.json`: what an engineer would know."""
    scene = draw.scene
    channels = {
        key: [[one.name, one.direction] for one in side]
        for key, side in (("out_channels", scene.sensors), ("in_channels", scene.actuators))
    }
    is_flawless = bool(np.all(scene.gains == 1))
    return {
        "case": name,
        "structure": structure(scene),
        "nominal_fe_model": "model" if scene.form == "plate" else None,
        "sensors": [transducer(one, n) for n, one in enumerate(scene.sensors, 1)],
        "actuators": [transducer(one, 100 + n) for n, one in enumerate(scene.actuators, 1)],
        "position_prior": "uniform: true = recorded +- tolerance_m in each coordinate",
        "angle_prior": "uniform +- angle_tolerance_rad for each of tx, ty, tz",
        "angle_convention": ANGLES,
        "uncertain_parameters": uncertain(scene),
        "frequency": {
            "band_hz": [float(scene.frequency[0]), float(scene.frequency[-1])],
            "n_lines": scene.frequency.size,
            "spacing": "linear" if axial_or_plate(scene.nominal) else "logarithmic",
        },
        "measurement": {
            "quantity": "accelerance",
            "units": "(m/s^2)/N",
            "array": "frf[out, in, line]",
            "convention": "exp(+i w t)",
            **channels,
            "estimator": "H1",
            "n_averages": draw.record.averages,
            "noise": NOISE + ("" if is_flawless else IMPERFECT),
            "sensor_setup": "all sensors mounted all the time",
            "force_levels_N": None,
            "files": ["measured.uff"],
        },
    }


def structure(scene: Scene) -> dict[str, Any]:
    of = scene.nominal
    common = {
        "youngs_modulus_Pa": of.youngs_modulus,
        "density_kg_m3": of.density,
        "damping": {
            "model": "modal viscous, the same ratio for every mode",
            "ratio": of.damping_ratio,
        },
    }
    if not isinstance(of, Line):
        sides = {"size_x_m": of.length, "size_y_m": of.width, "thickness_m": of.thickness}
        return PLATE | sides | {"poisson_ratio": of.poisson_ratio} | common
    if of.kind == "bar":
        return BAR | {"length_m": of.length, "area_m2": of.area} | common
    height = float(np.sqrt(12 * of.second_moment / of.area))
    section = {"length_m": of.length, "width_m": of.area / height, "height_m": height}
    ends = {"boundary_conditions": SUSPENDED if of.suspension else CANTILEVER}
    springs = [{"x_m": x, "stiffness_N_per_m": stiffness} for x, stiffness in of.suspension]
    return BEAM | section | ends | ({"suspension": springs} if springs else {}) | common


def transducer(one: Instrument, node: int) -> dict[str, Any]:
    place = list(np.ravel(one.recorded))
    return {
        "id": one.name,
        "uff_node": node,
        "position_m": [*place, *[0.0] * (3 - len(place))],
        "tolerance_m": [*[one.within] * len(place), *[0.0] * (3 - len(place))],
        "directions": [one.direction],
        "angle_tolerance_rad": 0.0,
    }


def uncertain(scene: Scene) -> list[dict[str, Any]]:
    return [
        {
            "name": UNCERTAIN[name],
            "nominal": getattr(scene.nominal, name),
            "prior": {"type": "uniform", "low": low, "high": high},
            "note": "",
        }
        for name, (low, high) in scene.uncertain.items()
    ]


def write_plate_model(scene: Scene, folder: Path) -> None:
    """Write the nominal model of a plate as a finite element program hands it over."""
    of = scene.nominal
    folder.mkdir(exist_ok=True)
    plate = PlateModel(CELLS, (of.length, of.width), of.thickness)
    model = plate.model()
    free = np.setdiff1d(np.arange(plate.dof.shape[0]), plate.fixed)
    inner = [model[key][np.ix_(free, free)].toarray() for key in ("stiffness", "mass")]
    squares, shapes = scipy.linalg.eigh(*inner, subset_by_index=(0, KEPT - 1))
    modes = np.zeros((plate.dof.shape[0], KEPT))
    modes[free] = shapes
    np.savez_compressed(
        folder / "nominal.npz",
        node_ids=np.arange(1, len(plate.position) + 1),
        nodes=plate.position,
        dofs=plate.dof,
        modes=modes,
        freqs_hz=np.sqrt(squares) / (2 * np.pi),
        modal_masses=np.ones(KEPT),
        modal_damping=np.full(KEPT, of.damping_ratio),
        fixed_dofs=np.sort(plate.fixed),
        elements=plate.mesh.t.T + 1,
    )
    for key, name in (("stiffness", "K"), ("mass", "M")):
        scipy.sparse.save_npz(folder / f"{name}.npz", scipy.sparse.csr_matrix(model[key]))
    dump({"structure": structure(scene), "units": "SI"}, folder / "model.json")


def truth_of(draw: UnlistedDraw, name: str) -> dict[str, Any]:
    """What was hidden and drawn; `size_m` is the largest side of the structure."""
    scene = draw.scene
    return {
        "case": name,
        "structure": draw.form,
        "size_m": scene.nominal.length,
        "hidden": [asdict(effect) for effect in draw.hidden],
        "true": {field: getattr(scene.true, field) for field in UNCERTAIN},
        "sensors": {one.name: one.true for one in scene.sensors},
        "actuators": {one.name: one.true for one in scene.actuators},
        "gains": scene.gains.tolist(),
        "noise": scene.noise,
        "chi2_nominal_fit": draw.chi2,
        "expected": expected(draw),
    }


def expected(draw: UnlistedDraw) -> list[dict[str, Any]]:
    """What a right answer says of each effect."""
    return [entry(effect) for effect in draw.hidden]


def entry(effect: Hidden) -> dict[str, Any]:
    places = [np.ravel(place).tolist() for place in effect.places]
    kinds = [effect.kind] if effect.kind != "body" else ["body", "displacement", "rotation"]
    laws = [] if effect.law in WORDS else of_one_stiffness(effect.law)
    names = NAMED.get((effect.kind, json.dumps(effect.law)), [])
    channel = {"on": effect.channel} if effect.channel else {}
    return {"acts_on": kinds, "place_m": places, "laws": laws, "names": names, **channel}


WORDS = ("body", "layer", "gain", "delay", "low_pass", "length")
"""Laws that are no network."""


def named(kind: str, **names: str) -> dict[tuple[str, str], list[str]]:
    return {(kind, json.dumps(law)): [name] for law, name in names.items()}


NAMED = {
    **named("displacement", k="ground_spring", c="ground_dashpot", m="point_mass"),
    ("displacement", json.dumps(ABSORBER)): ["tuned_absorber"],
    ("displacement", json.dumps(["-", "c", "k"])): ["maxwell_mount"],
    ("displacement", json.dumps(["|", "k", "p"])): ["fractional_mount"],
    **named("rotation", k="rotational_spring", m="rotary_inertia"),
    **named("body", body="eccentric_mass"),
    **named("relative", k="strut"),
    **named("cut", k="local_stiffness_loss"),
    **named("region", k="foundation", m="segment_mass", layer="damping_layer"),
    **named("channel", gain="gain_error", delay="channel_delay", low_pass="low_pass"),
    **named("all_channels", delay="time_delay", low_pass="low_pass"),
    **named("structure", length="dimension_error"),
}
"""Names of effects in a library, of each kind and law that has one."""
