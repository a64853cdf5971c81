"""Meshes that meshio or other programs wrote, as numbers of nodes and positions in metres."""

import importlib.util
import sys

import numpy as np
import pytest

from bayes_placement._shared.errors import MissingExtraError
from bayes_placement.io import _reader_process, mesh
from bayes_placement.modes.finite_elements.modal_model import ModalModel

meshio = pytest.importorskip("meshio", reason='meshes need pip install "bayes_placement[mesh]"')

# Two unit squares side by side, the left one with its lower edge.
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], dtype=float)
CELLS = [("quad", np.array([[0, 1, 2, 3], [1, 4, 5, 2]])), ("line", np.array([[0, 1]]))]
NONE = np.array([], dtype=int)

# Typed by hand after the text of the format, with node numbers that are not 1, 2, 3.
GMSH = """\
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "edge"
2 1 "face"
$EndPhysicalNames
$Nodes
5
10 0 0 0
20 1 0 0
30 1 1 0
40 0 1 0
50 5 5 5
$EndNodes
$Elements
2
1 1 2 1 1 10 20
2 3 2 1 1 10 20 30 40
$EndElements
"""


def written(path, **sets):
    meshio.write(path, meshio.Mesh(POINTS, CELLS, **sets))
    return path


@pytest.mark.parametrize("ending", [".inp", ".vtk", ".vtu", ".bdf"])
def test_nodes_and_elements(tmp_path, ending):
    loaded = mesh.read(written(tmp_path / f"two{ending}"), length_unit=1e-3)
    np.testing.assert_allclose(loaded.position, POINTS * 1e-3, rtol=1e-12)
    assert loaded.node.tolist() == [1, 2, 3, 4, 5, 6]
    assert loaded.elements["quad"].tolist() == [[1, 2, 3, 4], [2, 5, 6, 3]]
    assert loaded.elements["line"].tolist() == [[1, 2]]


def test_sets_of_points_and_of_elements(tmp_path):
    path = written(
        tmp_path / "two.inp",
        point_sets={"corner": np.array([0, 5])},
        cell_sets={"right": [np.array([1]), NONE], "edge": [NONE, np.array([0])]},
    )
    sets = {name: nodes.tolist() for name, nodes in mesh.read(path).node_sets.items()}
    assert sets == {"corner": [1, 6], "right": [2, 3, 5, 6], "edge": [1, 2]}


def test_physical_groups_of_gmsh(tmp_path):
    """Two groups of the same tag and other dimensions are two groups."""
    (tmp_path / "typed.msh").write_text(GMSH)
    loaded = mesh.read(tmp_path / "typed.msh")
    assert {name: nodes.tolist() for name, nodes in loaded.node_sets.items()} == {
        "edge": [1, 2],
        "face": [1, 2, 3, 4],
    }


def test_a_mesh_takes_the_numbers_of_a_model(tmp_path):
    (tmp_path / "typed.msh").write_text(GMSH)
    loaded = mesh.read(tmp_path / "typed.msh")
    model = ModalModel.from_arrays(
        node=[50, 40, 30, 20, 10],
        position=loaded.position[::-1] + 1e-7,
        shape=np.ones((5, 3, 1)),
        natural_frequency=[1.0],
        modal_mass=1,
    )
    named = loaded.numbered_as(model)
    assert named.node.tolist() == [10, 20, 30, 40, 50]
    assert named.elements["quad"].tolist() == [[10, 20, 30, 40]]
    assert named.node_sets["edge"].tolist() == [10, 20]
    np.testing.assert_array_equal(named.position, loaded.position)
    in_mm = mesh.read(tmp_path / "typed.msh", length_unit=1e-3)
    with pytest.raises(ValueError, match=r"Node 5 of the mesh at .* Check the unit: mesh.read"):
        in_mm.numbered_as(model)


def test_plane_meshes_lie_at_zero(tmp_path):
    meshio.write(tmp_path / "plane.xml", meshio.Mesh(POINTS[:3, :2], [("triangle", [[0, 1, 2]])]))
    assert mesh.read(tmp_path / "plane.xml").position[:, 2].tolist() == [0.0, 0.0, 0.0]


def test_what_is_refused(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError, match=r"There is no file .*none.msh; a mesh is needed"):
        mesh.read(tmp_path / "none.msh")
    (tmp_path / "text.stranger").write_text("nodes")
    with pytest.raises(ValueError, match=r"cannot be read as a mesh \(Could not deduce"):
        mesh.read(tmp_path / "text.stranger")
    (tmp_path / "cut.msh").write_text(GMSH[:140])
    with pytest.raises(ValueError, match=r"cut.msh cannot be read as a mesh .*Convert it"):
        mesh.read(tmp_path / "cut.msh")
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(ImportError, match=r'pip install "bayes_placement\[mesh\]"'):
        mesh.read(tmp_path / "cut.msh")


def test_what_meshio_prints_is_a_warning(tmp_path, capfd):
    (tmp_path / "cut.msh").write_text(GMSH[:-13])
    with pytest.warns(UserWarning, match=r"meshio says: Warning: \$Elements not closed"):
        mesh.read(tmp_path / "cut.msh")
    assert not capfd.readouterr().err


ABAQUS = """*HEADING
part
*NODE
1, 0.0, 0.0, 0.0
2, 1.0, 0.0, 0.0
3, 1.0, 1.0, 0.0
*ELEMENT, TYPE=S3, ELSET=skin
1, 1, 2, 3
*END
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("2, 1.0, 0.0", "2, nan, 0.0", "holds nan as coordinates"),
        ("2, 1.0, 0.0", "2, 1e300, 0.0", r"holds 1e\+300 as coordinates"),
        ("1, 1, 2, 3", "1, 1, 2, 9", "cannot be read as a mesh"),
        (
            "*NODE\n1, 0.0, 0.0, 0.0\n2, 1.0, 0.0, 0.0\n3, 1.0, 1.0, 0.0\n",
            "",
            "cannot be read as a mesh",
        ),
    ],
)
def test_damaged_meshes_are_refused(tmp_path, old, new, message):
    path = tmp_path / "part.inp"
    path.write_text(ABAQUS)
    assert mesh.read(path).elements["triangle"].tolist() == [[1, 2, 3]]
    assert old in ABAQUS
    path.write_text(ABAQUS.replace(old, new))
    with pytest.raises(ValueError, match=message) as caught:
        mesh.read(path)
    assert "part.inp" in str(caught.value)


VTK = """# vtk DataFile Version 4.2
part
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 3 double
0 0 0 1 0 0 1 1 0
CELLS 1 4
3 0 1 2
CELL_TYPES 1
5
"""


def test_elements_of_nodes_that_are_not_there_are_refused(tmp_path):
    path = tmp_path / "part.vtk"
    path.write_text(VTK)
    assert mesh.read(path).elements["triangle"].tolist() == [[1, 2, 3]]
    for number in ("7", "-1"):
        path.write_text(VTK.replace("3 0 1 2", f"3 0 1 {number}"))
        with pytest.raises(ValueError, match="triangle has a node that is not among its 3"):
            mesh.read(path)


@pytest.mark.parametrize("header", ["ply\nformat ascii 1.0\nelement vertex 3\n", "ply\n", ""])
def test_a_ply_file_whose_header_has_no_end_is_refused_at_once(tmp_path, monkeypatch, header):
    """meshio reads on for ever behind the end of the file."""
    monkeypatch.setattr(_reader_process, "run", None)
    path = tmp_path / "part.PLY"
    path.write_text(header + "comment end_header\n")
    with pytest.raises(ValueError, match=r"part\.PLY cannot be read .*no line end_header"):
        mesh.read(path)


@pytest.mark.parametrize("suffix", ["bdf", "nas", "fem"])
def test_bulk_data_without_an_end_are_refused_at_once(tmp_path, monkeypatch, suffix):
    """meshio looks for a first card for ever."""
    monkeypatch.setattr(_reader_process, "run", None)
    path = tmp_path / f"part.{suffix}"
    path.write_text("$ ENDDATA\nBEGIN BULK\n$ a comment\nGRI")
    with pytest.raises(ValueError, match=r"cannot be read as a mesh .*no line ENDDATA"):
        mesh.read(path)


LONG_WAIT = pytest.param(12.0, "s of computing", marks=pytest.mark.longest)


@pytest.mark.long
@pytest.mark.parametrize(("waiting", "unit"), [(-4.0, "s of waiting"), LONG_WAIT])
def test_a_mesh_that_never_ends_is_given_up(tmp_path, monkeypatch, waiting, unit):
    monkeypatch.setattr(_reader_process, "SECONDS_OF_WAITING", waiting)
    for_ever = tmp_path / "for_ever.py"
    for_ever.write_text("def read(path, extra):\n    while True:\n        pass\n")
    monkeypatch.setattr(_reader_process, "_LIBRARIES", for_ever)
    path = written(tmp_path / "part.ply")
    with pytest.raises(
        ValueError, match=rf"part.ply cannot be read as a mesh \(it did not end within . {unit}\)"
    ):
        mesh.read(path)


def test_a_file_that_may_not_be_read_is_named(tmp_path, monkeypatch):
    def forbidden(path, *mode):
        raise PermissionError(13, "Permission denied", str(path))

    path = tmp_path / "part.inp"
    path.write_text(ABAQUS)
    monkeypatch.setattr(mesh.Path, "open", forbidden)
    with pytest.raises(PermissionError, match=r"part\.inp"):
        mesh.read(path)


# Typed by hand after the descriptions of the formats; numbers of nodes are not 1, 2, 3.
UNIVERSAL_MESH = """\
    -1
   164
         2                  mm         1
  1.0000000000000000D+03  1.0000000000000000D+00  1.0000000000000000D+00
  0.0000000000000000D+00
    -1
    -1
  2411
{nodes}    -1
    -1
  2412
        11        94         1         1         7         4
        10        20        30        40
        12        21         1         1         7         2
         0         1         1
        10        20
        13        92         1         1         7         6
        10        50        20        60        30        70
        14       161         1         1         7         1
        10
    -1
"""
CORNERS = {10: (0, 0, 0), 20: (1, 0, 0), 30: (1, 1, 0), 40: (0, 1, 0)}
MIDDLES = {50: (0.5, 0, 0), 60: (1, 0.5, 0), 70: (0.5, 0.5, 0)}
PLACES = CORNERS | MIDDLES


def universal_mesh(places=PLACES):
    rows = [
        f"{node:10d}{1:10d}{1:10d}{11:10d}\n" + "".join(f"{1e3 * x:25.16E}" for x in place) + "\n"
        for node, place in places.items()
    ]
    return UNIVERSAL_MESH.format(nodes="".join(rows))


def calculix(width, form, places=PLACES):
    """Results of CalculiX: short or long lines, a block of results behind the mesh."""
    nodes = [
        f" -1{node:{width}d}" + "".join(f"{x:12.5E}" for x in place)
        for node, place in places.items()
    ]

    def element(number, kind, corners):
        return [
            f" -1{number:{width}d}{kind:5d}{0:5d}{1:5d}",
            " -2" + "".join(f"{corner:{width}d}" for corner in corners),
        ]

    return "\n".join(
        [
            "    1C",
            f"    2C{'':18}{len(nodes):12d}{'':37}{form}",
            *nodes,
            " -3",
            f"    3C{'':18}{3:12d}{'':37}{form}",
            *element(11, 9, (10, 20, 30, 40)),
            *element(12, 11, (10, 20)),
            *element(13, 8, (10, 20, 30, 50, 60, 70)),
            " -3",
            "  100CL  101 1.000000000           7                     0    1           1",
            " -4  DISP        4    1",
            " -3",
            " 9999",
        ]
    )


@pytest.mark.parametrize(
    ("name", "content", "unit"),
    [
        ("two.unv", universal_mesh(), None),
        ("two.txt", universal_mesh(), None),
        ("two.frd", calculix(10, 1), 1.0),
        ("two.frd", calculix(5, 0), 1.0),
    ],
)
@pytest.mark.filterwarnings("ignore:.*FE descriptor 161 are left out")
def test_universal_meshes_and_calculix_keep_the_numbers_of_their_nodes(
    tmp_path, name, content, unit
):
    (tmp_path / name).write_text(content)
    loaded = mesh.read(tmp_path / name, length_unit=unit)
    assert loaded.node.tolist() == [*PLACES]
    np.testing.assert_allclose(loaded.position, [*PLACES.values()], atol=1e-12)
    assert {kind: rows.tolist() for kind, rows in loaded.elements.items()} == {
        "quad": [[10, 20, 30, 40]],
        "line": [[10, 20]],
        "triangle6": [[10, 20, 30, 50, 60, 70]],
    }


def test_what_of_a_universal_mesh_is_left_out_or_missing_is_told(tmp_path):
    path = tmp_path / "two.unv"
    path.write_text(universal_mesh())
    with pytest.warns(UserWarning, match=r"two\.unv was read, .*FE descriptor 161 are left out"):
        mesh.read(path)
    path.write_text(universal_mesh(CORNERS))
    with pytest.raises(ValueError, match=r"two\.unv: an element names node 50, which is not there"):
        mesh.read(path)
    path.write_text(universal_mesh().replace("         7         4\n", "         7         5\n"))
    with pytest.raises(ValueError, match=r"an element has .* nodes where 5 are announced"):
        mesh.read(path)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ((" -3\n    3C", "    3C"), "stands in its block 2C"),
        ((f"{'':37}1", f"{'':37}2"), r"block 2C is in format 2; text \(0 or 1\) is needed"),
        (("        50", "        5x"), "stands where a whole number is needed"),
        (("   11    9", "   11    8"), "an element of type 8 has 4 nodes"),
    ],
)
def test_damaged_results_of_calculix_are_refused(tmp_path, change, sentence):
    (tmp_path / "two.frd").write_text(calculix(10, 1).replace(*change))
    with pytest.raises(ValueError, match=sentence):
        mesh.read(tmp_path / "two.frd")


def test_the_library_of_a_format_is_named_where_it_is_missing(tmp_path):
    if importlib.util.find_spec("netCDF4"):
        pytest.skip("netCDF4 is installed, which reads the file")
    (tmp_path / "part.exo").write_bytes(b"CDF\x01" + b"\0" * 60)
    with pytest.raises(MissingExtraError, match=r"part\.exo .* netCDF4 is not installed"):
        mesh.read(tmp_path / "part.exo")
