"""What is wrong with a scene or its assets is said, with exit code 3 and nothing written."""
import json
import os
import pathlib
import resource
import shutil
import struct
import tempfile

import h5py
import numpy as np
import pytest

import tiny
from conftest import run

MEMORY = 6 << 30  # bytes of address space: room for the threads of a large machine, not for a count of 4 billion
FOUR_BILLION, TWO_BILLION = 4_000_000_000, 2_000_000_000


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def refused(program, scene, *options):
    """The errors, without `error: `, of a run that must end with 3 before it writes anything."""
    out = scene.parent / "out"
    result = run(program, "run", scene, "-o", out, *options, preexec_fn=limit_memory)
    assert result.returncode == 3, (result.returncode, result.stderr)
    assert not out.exists() and result.stdout == ""
    lines = [line for line in result.stderr.splitlines() if not line.startswith(("info: ", "warning: "))]
    assert lines and all(line.startswith("error: ") for line in lines), result.stderr
    return [line.removeprefix("error: ") for line in lines]


# ---- The scene -------------------------------------------------------------------------------------


def test_broken_json_is_placed_by_line_and_column(program, tmp_path):
    scene = tmp_path / "tiny.json"
    scene.write_text('{\n  "name": "tiny",\n  "frames": {"first": 1,, "last": 3}\n}\n')
    (error,) = refused(program, scene)
    assert error.startswith(f"{scene}:3:25: ")


@pytest.mark.parametrize("text", ["", "{", "[]", "7", '{"name": "a", "name": "b"}', "\x00\xff", "[" * 100000])
def test_texts_that_are_no_scene(program, tmp_path, text):
    scene = tmp_path / "tiny.json"
    scene.write_text(text, encoding="latin-1")
    assert refused(program, scene)[0].startswith(str(scene))


@pytest.mark.parametrize(
    "pointer, value, expected",
    [
        ("/frames/last", "ten", '/frames/last: found "ten", expected'),
        ("/frames/fps", 0, "/frames/fps: found 0, expected"),
        ("/frames/last", -5, "/frames/last: found -5, expected"),
        ("/effects/gravity", [0, -9.81], "/effects/gravity: found [0,-9.81], expected"),
        ("/model/substep", 3, "/model/substep: found an unknown key"),
        ("/head/mesh", "none.obj", "/head/mesh: found \"none.obj\", expected"),
        ("/groom/file", "none.hair", "/groom/file: found \"none.hair\", expected"),
        ("/effects/solids/0/source", "none.obj", "/effects/solids/0/source: found \"none.obj\", expected"),
        ("/groom/attach", "glued", '/groom/attach: found "glued", expected'),
        ("/cache/fields", ["colour"], "/cache/fields/0: found \"colour\", expected"),
    ],
)
def test_one_wrong_value_is_named_with_what_was_expected(program, tmp_path, pointer, value, expected):
    scene = tiny.write_scene(tmp_path)
    (error,) = refused(program, scene, "--set", f"{pointer}={json.dumps(value)}")
    assert error.startswith(f"{scene}#{expected}"), error


def test_every_error_is_told_at_once(program, tmp_path):
    scene = tiny.write_scene(tmp_path)
    document = json.loads(scene.read_text())
    document["frames"]["fps"] = -1
    document["modle"] = {}
    document["head"]["mesh"] = "none.obj"
    del document["groom"]["file"]
    document["model"]["substeps"] = 1.5
    scene.write_text(json.dumps(document))
    places = {error.split(": ")[0].partition("#")[2] for error in refused(program, scene)}
    assert places >= {"/frames/fps", "/modle", "/head/mesh", "/model/substeps"}


def test_a_scene_that_is_not_there(program, tmp_path):
    assert refused(program, tmp_path / "none.json") == [f"{tmp_path / 'none.json'}: there is no such file"]
    (tmp_path / "folder").mkdir()
    assert "found a folder" in refused(program, tmp_path / "folder")[0]


# ---- The groom -------------------------------------------------------------------------------------


def h5_bytes(tmp_path, strands, **changes):
    """Ringlet's own groom; `changes` replaces data sets."""
    file = tmp_path / "made.h5"
    count, particles = strands.shape[:2]
    arrays = {"offsets": np.arange(count + 1, dtype="i8") * particles, "points": strands.reshape(-1, 3), **changes}
    with h5py.File(file, "w") as groom:
        groom.attrs.update(format="ringlet-groom", version=1, metres_per_unit=1.0, up="y")
        for name, array in arrays.items():
            if isinstance(array, tuple):  # a shape that nothing is stored for
                groom.create_dataset(name, array, "f4", chunks=True)
            else:
                groom[name] = array
    return file.read_bytes()


def groom_error(program, tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    scene = tiny.write_scene(tmp_path, lambda scene: scene["groom"].update(file=name))
    (error,) = refused(program, scene)
    assert error.startswith(str(tmp_path / name)), error
    return error


def whole(tmp_path, points):
    return {
        "a.hair": tiny.hair_bytes(points),
        "a.data": tiny.data_bytes(points),
        "a3.tfx": tiny.tfx_bytes(points, 3),
        "a4.tfx": tiny.tfx_bytes(points, 4),
        "a.h5": h5_bytes(tmp_path, points),
    }


FORMATS = ["a.hair", "a.data", "a3.tfx", "a4.tfx", "a.h5"]


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_read_when_it_is_whole(program, tmp_path, name):
    (tmp_path / name).write_bytes(whole(tmp_path, tiny.strands(20))[name])
    scene = tiny.write_scene(tmp_path, lambda scene: scene["groom"].update(file=name))
    result = run(program, "plan", scene, "--json", preexec_fn=limit_memory)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["strands"] == 20


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("part", [0, 0.01, 0.5, 0.99])
def test_truncated_grooms(program, tmp_path, name, part):
    content = whole(tmp_path, tiny.strands(20))[name]
    groom_error(program, tmp_path, name, content[: int(part * len(content))])


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_coordinates_that_are_not_finite(program, tmp_path, name, value):
    points = tiny.strands(20)
    points[7, 3, 1] = value
    error = groom_error(program, tmp_path, name, whole(tmp_path, points)[name])
    assert "strand 7, particle 3" in error and "expected a finite number" in error


@pytest.mark.parametrize(
    "name, make",
    [
        ("strands.hair", lambda points, _: tiny.hair_bytes(points, strand_count=FOUR_BILLION)),
        ("points.hair", lambda points, _: tiny.hair_bytes(points, point_count=FOUR_BILLION)),
        ("strands.data", lambda points, _: tiny.data_bytes(points, strand_count=TWO_BILLION)),
        ("vertices.data", lambda points, _: tiny.data_bytes(points, vertex_count=TWO_BILLION)),
        ("negative.data", lambda points, _: tiny.data_bytes(points, strand_count=-3)),
        ("strands3.tfx", lambda points, _: tiny.tfx_bytes(points, 3, strand_count=FOUR_BILLION)),
        ("strands4.tfx", lambda points, _: tiny.tfx_bytes(points, 4, strand_count=FOUR_BILLION)),
        ("offset.tfx", lambda points, _: tiny.tfx_bytes(points, 4, offset=FOUR_BILLION)),
        ("points.h5", lambda points, folder: h5_bytes(folder, points, points=(FOUR_BILLION, 3))),
        ("offsets.h5", lambda points, folder: h5_bytes(folder, points, offsets=np.array([0, FOUR_BILLION], "i8"))),
    ],
)
def test_lying_headers_allocate_nothing(program, tmp_path, name, make):
    groom_error(program, tmp_path, name, make(tiny.strands(20), tmp_path))


@pytest.mark.parametrize(
    "name, content",
    [
        ("a.hair", b""),
        ("a.hair", tiny.hair_bytes(tiny.strands(1))[:4] + struct.pack("<III", 0, 0, 2) + bytes(112)),
        ("a.data", struct.pack("<i", 0)),
        ("a.data", struct.pack("<iifff", 1, 1, 0, 0, 0)),
        ("a.tfx", struct.pack("<fII", 4, 0, 9) + bytes(148)),
        ("a.xyz", b"0 0 0"),
    ],
)
def test_empty_grooms(program, tmp_path, name, content):
    error = groom_error(program, tmp_path, name, content)
    assert "empty" in error or "no groom" in error


# ---- The head --------------------------------------------------------------------------------------


@pytest.mark.parametrize("mesh", ["v 0 0 0\nv 1 0 0\nv 0 1 0\n", "", "l 1 2\n", "v 0 0 0\nv 1 0 0\nl 1 2\n", "f 1 2 3\n", "\x00\x01junk"])
def test_meshes_without_triangles(program, tmp_path, mesh):
    scene = tiny.write_scene(tmp_path)
    (tmp_path / "head.obj").write_text(mesh)
    (error,) = refused(program, scene)
    assert error.startswith(str(tmp_path / "head.obj")), error


def test_a_mesh_with_a_vertex_that_is_not_finite(program, tmp_path):
    scene = tiny.write_scene(tmp_path)
    text = (tmp_path / "head.obj").read_text()
    (tmp_path / "head.obj").write_text(text.replace(text.splitlines()[40], "v nan 0 0"))
    (error,) = refused(program, scene)
    assert "finite" in error


def test_roots_far_from_the_head(program, tmp_path):
    scene = tiny.write_scene(tmp_path, groom=tiny.data_bytes(100 * tiny.strands(20)))
    (error,) = refused(program, scene)
    assert "attach_distance" in error and "units" in error


# ---- The output ------------------------------------------------------------------------------------


@pytest.fixture
def open_folder():
    """A folder that everybody may enter, unlike pytest's own."""
    with tempfile.TemporaryDirectory() as name:
        os.chmod(name, 0o755)
        yield pathlib.Path(name)


def as_nobody(program, scene):
    """What goes before a command so that it runs without root's rights."""
    if os.geteuid() != 0:
        return []
    prefix = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
    if not shutil.which("setpriv") or run(*prefix, program, "validate", scene).returncode != 0:
        pytest.skip("root, and nobody else may run the program")
    return prefix


def test_an_output_directory_without_permission(program, open_folder):
    scene = tiny.write_scene(open_folder)
    locked = open_folder / "locked"
    locked.mkdir(mode=0o555)
    result = run(*as_nobody(program, scene), program, "run", scene, "-o", locked / "out")
    assert result.returncode == 5, result.stderr
    error = result.stderr.splitlines()[-1]
    assert str(locked) in error and "Permission denied" in error and "-o" in error
    assert os.listdir(locked) == []


def test_an_input_without_permission(program, open_folder):
    scene = tiny.write_scene(open_folder)
    prefix = as_nobody(program, scene)
    (open_folder / "groom.data").chmod(0)
    result = run(*prefix, program, "validate", scene)
    assert result.returncode == 3 and "#/groom/file: " in result.stderr and "cannot be opened" in result.stderr
