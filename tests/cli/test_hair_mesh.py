"""ringlet groom hair-mesh and ringlet info on what it writes."""
import json
import os
import pathlib
import re

import numpy as np
import pytest

from conftest import SOURCE, run
from small_cache import ball
from tiny import write_mesh

HEAD = SOURCE / "scenes/assets/head.obj"
DATA = pathlib.Path(os.environ.get("RINGLET_DATA", SOURCE / "../shared/data"))
CAP = ["--center", 0, 0, 0, "--pole", 0, 1, "-0.5", "--angle", 90]


@pytest.fixture
def extrude(program, tmp_path):
    """Runs `ringlet groom hair-mesh HEAD OPTIONS -o out.json`; the file, its layers as an array among its keys."""

    def extrude(head, *options):
        out = tmp_path / "out.json"
        result = run(program, "groom", "hair-mesh", head, "-o", out, *options)
        assert result.returncode == 0, result.stderr
        mesh = json.loads(out.read_text())
        mesh["layers"] = np.array(mesh["layers"])
        layers, vertices = mesh["layers"].shape[:2]
        faces = len(mesh["faces"])
        assert result.stdout == (
            f"wrote {out}: {faces} scalp faces, {layers} layers, {layers * vertices} vertices, {faces * (layers - 1)} prisms\n"
        )
        return mesh

    return extrude


@pytest.fixture
def sphere(tmp_path_factory):
    """A ball of 10 cm."""
    path = tmp_path_factory.mktemp("sphere") / "ball.obj"
    write_mesh(path, *ball(64, 96))
    return path


# ---- Styles ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "style, resolution, vertices, lowest, highest",
    [
        ("short", "low", 215, 0.05, 0.4),
        ("shoulder", "low", 361, -0.1, 0.45),
        ("long", "low", 361, -0.35, 0.45),
        ("long", "high", 2305, -0.35, 0.45),
    ],
)
def test_the_papers_styles_have_its_sizes(extrude, style, resolution, vertices, lowest, highest):
    mesh = extrude(HEAD, "--mesh", "scalp", "--style", style, "--resolution", resolution)
    points = mesh["layers"].reshape(-1, 3)
    assert len(points) == vertices
    assert lowest < points[:, 1].min() and points[:, 1].max() < highest
    assert {len(face) for face in mesh["faces"]} == {3, 4}
    if style == "long":  # down the back, not over the face
        assert np.all(mesh["layers"][-1][:, 2] < -0.08) and mesh["layers"][-1][:, 1].max() < -0.1


def test_options_go_before_the_style(extrude):
    options = ["--style", "short", "--vertices", 61, "--layers", 7, "--length", "0.03"]
    layers = extrude(HEAD, "--mesh", "scalp", *options)["layers"]
    assert layers.shape == (7, 61, 3)
    along = np.linalg.norm(np.diff(layers, axis=0), axis=-1).sum(axis=0)
    assert np.median(along) == pytest.approx(0.03, rel=0.1)


@pytest.mark.parametrize(
    "file, options",
    [
        ("curly/head_shake.glb", ["--unit", "cm", "--center", 0, 5, -5]),
        ("ponytail/head.obj", ["--unit", "0.0027", "--mesh", "Mesh_head", "--center", 0, 82, -8]),
        ("face/head_morph.glb", ["--unit", "cm", "--center", 0, 5, 2]),
    ],
)
@pytest.mark.parametrize("style, vertices", [("short", 215), ("shoulder", 361)])
def test_real_heads(extrude, file, options, style, vertices):
    if not (DATA / file).exists():
        pytest.skip(f"{file} is not there")
    mesh = extrude(DATA / file, *options, "--pole", 0, 1, "-0.7", "--angle", 80, "--style", style)
    assert mesh["layers"].size == 3 * vertices


# ---- Numbers ---------------------------------------------------------------------------------------


def test_hair_without_gravity_stands_straight_out(extrude, sphere):
    layers = extrude(sphere, *CAP, "--length", "0.06", "--layers", 4, "--gravity", 0, "--vertices", 61)["layers"]
    distance = np.linalg.norm(layers, axis=-1)
    for k in range(4):
        assert np.allclose(distance[k], distance[0] + 0.02 * k, atol=1e-6)


def test_units_and_axes(extrude, sphere):
    options = ["--length", 6, "--layers", 4, "--gravity", 0, "--vertices", 61]
    metres = extrude(sphere, "--unit", "m", *CAP, *options[:1], 6, *options[2:])
    small = extrude(sphere, "--unit", "cm", *CAP, *options)
    assert np.allclose(small["layers"], 0.01 * metres["layers"], atol=1e-9)
    assert small["units"] == {"length": "m", "up": "y"}
    upright = extrude(sphere, "--up", "z", "--center", 0, 0, 0, "--pole", 0, "0.5", 1, "--angle", 90, *options[:1], "0.06", *options[2:])
    assert upright["units"]["up"] == "z"
    assert upright["layers"][-1][:, 2].mean() > 0.05


def test_gravity_level_and_curl(extrude, sphere):
    options = [*CAP, "--vertices", 61, "--layers", 10]
    level = extrude(sphere, *options, "--length", 1, "--lift", "0.03", "--level", "-0.2")["layers"]
    assert np.median(np.abs(level[-1][:, 1] + 0.2)) < 1e-3
    plain = extrude(sphere, *options, "--length", "0.1", "--gravity", 0)["layers"]
    curled = extrude(sphere, *options, "--length", "0.1", "--gravity", 0, "--curl-radius", "0.005", "--curl-turns", 2)["layers"]
    offset = np.linalg.norm(curled - plain, axis=-1)
    assert np.all(offset.max(axis=1) <= 0.0051 * np.arange(10) / 9 + 1e-9) and offset[-1].max() > 0.0049


# ---- info ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mesh.json", "mesh.obj"])
def test_info_tells_what_a_hair_mesh_holds(program, sphere, tmp_path, name):
    out = tmp_path / name
    options = [*CAP, "--length", "0.05", "--gravity", 0, "--vertices", 169, "--layers", 3]
    assert run(program, "groom", "hair-mesh", sphere, "-o", out, *options).returncode == 0
    report = json.loads(run(program, "info", out, "--json").stdout)
    assert report["kind"] == "hair mesh"
    counts = report["scalp_faces"]
    assert counts["count"] == counts["triangles"] + counts["quads"] and min(counts.values()) > 0
    assert (report["layers"], report["vertices"], report["vertices_per_layer"]) == (3, 507, 169)
    assert report["prisms"] == 2 * counts["count"]
    # A shell over half the ball, less what the polygons' chords and the rim leave out.
    half_shell = 2 / 3 * np.pi * (0.15**3 - 0.1**3)
    assert 0.85 * half_shell < report["volume"] < half_shell
    assert 0.85 < report["scalp_area"] / (2 * np.pi * 0.1**2) < 1
    assert 0.13 < np.max(report["bounds"]["upper"]) < 0.1501
    text = run(program, "info", out).stdout
    assert "hair mesh" in text and "prisms" in text
    strand = run(program, "info", out, "--strand", 0)
    assert strand.returncode == 2 and "no strands of its own" in strand.stderr


def test_info_names_what_is_wrong(program, tmp_path):
    path = tmp_path / "bad.json"
    mesh = {
        "format": "ringlet-hair-mesh",
        "version": 1,
        "faces": [[0, 1, 2]],
        "layers": [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, -1], [0, 1, 1]]],
    }
    path.write_text(json.dumps(mesh))
    result = run(program, "info", path)
    assert (result.returncode, result.stdout) == (3, "")
    assert f"error: {path}: face 0, layers 0 to 1: the prism is inverted at rest" in result.stderr
    path.write_text(json.dumps(mesh)[:-9])
    broken = run(program, "info", path)
    assert broken.returncode == 3 and re.search(r"bad\.json:1:\d+: ", broken.stderr)


# ---- Errors ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options, named",
    [
        (["--style", "short"], "--mesh: is missing, and so is what may stand for it"),
        ([*CAP], "--length: is missing (give it, or a --style)"),
        ([*CAP, "--length", "-1"], "--length: found -1, expected a number above 0"),
        ([*CAP, "--length", "1", "--layers", "1"], "--layers: found 1, expected 2 to 1000"),
        ([*CAP, "--length", "1", "--vertices", "3"], "--vertices: found 3, expected 7 to 100000"),
        ([*CAP, "--length", "1", "--gravity", "-1"], "--gravity: found -1"),
        ([*CAP, "--length", "1", "--curl-turns", "9"], "--curl-turns: found 9, expected at most 1.33"),
        ([*CAP[:-1], "0", "--length", "1"], "--angle: found 0, expected above 0 to 180"),
        ([*CAP, "--length", "1", "--forward", "0", "0", "0"], "--forward: found 0 0 0, expected a direction"),
        ([*CAP, "--length", "1", "--box", "0", "0", "0", "0", "1", "1"], "--box: has no inside"),
        ([*CAP, "--style", "bald"], "--style"),
        ([*CAP, "--style", "short", "--up", "w"], "--up: `w` is no axis"),
    ],
)
def test_usage_errors_name_the_option(program, sphere, tmp_path, options, named):
    result = run(program, "groom", "hair-mesh", sphere, "-o", tmp_path / "out.json", *options)
    assert (result.returncode, result.stdout) == (2, ""), result.stderr
    assert named in result.stderr.splitlines()[-1]
    assert os.listdir(tmp_path) == []


def test_bad_input_and_output_are_told(program, sphere, tmp_path):
    options = [*CAP, "--length", "0.05", "--gravity", 0]
    named = run(program, "groom", "hair-mesh", sphere, "-o", tmp_path / "out.h5", *options)
    assert named.returncode == 2 and "out.h5: a hair mesh is written as JSON or OBJ" in named.stderr
    missing = run(program, "groom", "hair-mesh", tmp_path / "none.obj", "-o", tmp_path / "out.json", *options)
    assert missing.returncode == 3 and "none.obj" in missing.stderr
    scalp = run(program, "groom", "hair-mesh", sphere, "-o", tmp_path / "out.json", "--mesh", "wig", "--length", 1)
    assert scalp.returncode == 3 and 'the head has no mesh "wig"' in scalp.stderr
    nowhere = run(program, "groom", "hair-mesh", sphere, "-o", tmp_path / "no/out.json", *options)
    assert nowhere.returncode == 5 and "no/out.json" in nowhere.stderr
    assert os.listdir(tmp_path) == []
