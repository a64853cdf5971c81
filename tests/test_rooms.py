"""rooms: imports go one way, files and functions stay small, and every door bears its plate."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "bayes_placement"

# A room may import from the rooms before it, never from those after it.
ORDER = """
    _types _files _executors _sites _eigenpairs _repeated _quadrature
    _vectors _bounds _ball_in_box places _voronoi _nearest_nodes _support
    _supports_in_space supports _placed orientation
    modes _beam_roots _beam_statics _uniform_line beams
    _modal_model_checks modal_model
    interpolation._interpolation interpolation._elements interpolation._frame_elements
    interpolation._linear_elements interpolation._plate_elements
    interpolation._scikit_fem_elements interpolation._scattered
    interpolation._geometric_stiffness interpolation
    _static_shapes nodal_modes _changed_modes _part_factors affine_modes
    matrices._symmetric_factor matrices._elimination_order matrices._rigid_body
    matrices._static_flexibility matrices._eigenmodes matrices._affine matrices._ritz_span
    matrices._reduced_basis matrices._dynamic_stiffness matrices._matrix_checks matrices
    soft_supports _openings _scikit_fem_rows finite_elements
    points damping _channel
    effects._words effects._lines effects._jumps effects._opened effects._yielding effects._hinges
    effects._effect effects._scales effects.soft_support
    effects.region_stiffness_loss effects.member_preload
    effects.point_mass effects.ground_spring effects.ground_dashpot effects.tuned_absorber
    effects.local_stiffness_loss effects.hysteretic_damping effects.viscoelastic_modulus
    effects.compliant_support effects.axial_preload effects.shear_and_rotary_inertia
    effects.cubic_stiffness effects.residual_modes effects.sensor_mass effects.time_delay
    effects.gain_error effects.mount_resonance effects.misplaced_sensor effects._library effects
    structure frf
    _measurement_checks measurement transducers channels observe noise
    _experiment_checks experiment
    _kernel_density _tensor_quadrature marginals
    engines._engine engines.importance engines.grid engines.map engines.nuts engines.smc engines
    _standard_normal _target estimates
    information._divergence information._points information._knowledge information._estimator
    information._kernels information._modal_products information.kde information.exact
    information._tangents information.expected_gain information.separation information
    design._candidates design._question design._fingerprint design._cells design._store
    design._running design._evaluation design.maps design.tolerance
    design._rules design._fewer design._offer design._regions design.search design.exhaustive
    design.sequential design.forward design.evolutionary design.place
    design.effective_independence design.planned design
    _results simulate symmetries infer methods
    criticism._residuals criticism._edges criticism._statistics criticism.correlation
    criticism.discrepancy criticism.misfit criticism.check
    criticism._compiled criticism._groups criticism._problem criticism._descent criticism._search
    criticism._hypotheses criticism._odds
    criticism._branches criticism._randomised criticism._confirm
    criticism._estimates criticism._alternatives criticism._held_out
    criticism._whereabouts criticism._suspicion criticism.ledger criticism.explain criticism.improve
    criticism._same_data criticism.compare criticism
    report
    io._uff_blocks io._uff_units io._uff_nodes io._uff_write io.uff io.netcdf io.model
    io.uff_modes io.npz_modes io.matrix_files io.nastran io.mesh
    io._case_fields io._case_measurement io._case_model io._case_structure io._case_places
    io.case io
    _figures plots misfit_plots structure_plots ledger_plots placement_plots
    _outputs _terminal _studies _fitted commands criticism_commands placement_commands cli
""".split()  # noqa: SIM905

FILES = sorted(PACKAGE.rglob("*.py"))
LINES, FUNCTION_LINES = 400, 50
FORBIDDEN = {"hasattr", "super", "print"}


def room(path):
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


def imported(path):
    """Rooms that a file imports, also inside its functions."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            floor = path.relative_to(PACKAGE).parts[: -node.level]
            whole = ".".join([*floor, *([node.module] if node.module else [])])
            for alias in node.names:
                inside = f"{whole}.{alias.name}".lstrip(".")
                yield inside if inside in ORDER else whole
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            yield from (name for name in names if name.startswith("bayes_placement"))


ROOMS = [path for path in FILES if room(path) != "__init__"]


def test_every_room_has_its_place():
    assert sorted(room(path) for path in ROOMS) == sorted(ORDER), "add the room to ORDER, in place"


@pytest.mark.parametrize("path", ROOMS, ids=room)
def test_imports_go_one_way(path):
    for other in imported(path):
        assert other in ORDER, f"{room(path)} must import {other} relative to the package"
        assert ORDER.index(other) < ORDER.index(room(path)), (
            f"Imports go one way: {room(path)} stands before {other} and must not know of it."
        )


@pytest.mark.parametrize("path", ROOMS, ids=room)
def test_a_door_plate_says_what_goes_in_and_out(path):
    plate = " ".join((ast.get_docstring(ast.parse(path.read_text())) or "").lower().split())
    name = room(path).split(".")[-1]
    assert plate.startswith(f"{name}:"), f"the plate of {room(path)} must begin with its name"
    for word in ("in,", "out,", "not known here"):
        assert word in plate, f"the plate of {room(path)} must say {word!r}"


@pytest.mark.parametrize("path", FILES, ids=room)
def test_files_and_functions_stay_small(path):
    text = path.read_text()
    assert len(text.splitlines()) <= LINES, f"{room(path)} is longer than {LINES} lines: split it"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            words = len((ast.get_docstring(node) or "").splitlines())
            size = node.end_lineno - node.lineno + 1 - words  # the budget is for code
            assert size <= FUNCTION_LINES, f"{room(path)}.{node.name} has {size} lines: split it"


@pytest.mark.parametrize("path", FILES, ids=room)
def test_what_hides_trouble_is_not_used(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            place = f"{room(path)}, line {node.lineno}"
            assert node.func.id not in FORBIDDEN, f"{place}: {node.func.id} is not used here"
        if isinstance(node, ast.ExceptHandler):
            assert node.type is not None, f"{room(path)}, line {node.lineno}: name the exception"
