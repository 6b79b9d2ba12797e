"""ringlet groom: what its commands do to a groom, and what they say when they cannot."""
import json
import os
import re

import h5py
import numpy as np
import pytest

import tiny
from conftest import run
from tiny import LENGTH, PARTICLES, STRANDS, data_bytes, strands, write_mesh

SEGMENT = LENGTH / (PARTICLES - 1)


class Groom:
    """A groom file as h5py reads it."""

    def __init__(self, path):
        with h5py.File(path) as file:
            self.offsets, self.points = file["offsets"][()], file["points"][()]
            self.up = np.asarray(file.attrs["up"]).astype(str)
            self.metres = file.attrs["metres_per_unit"]
            self.widths = file["widths"][()] if "widths" in file else None
            self.roots = file["root_triangles"][()] if "root_triangles" in file else None

    def __len__(self):
        return len(self.offsets) - 1

    def strand(self, number):
        return self.points[self.offsets[number]:self.offsets[number + 1]]

    @property
    def roots_and_tips(self):
        return self.points[self.offsets[:-1]], self.points[self.offsets[1:] - 1]

    @property
    def lengths(self):
        return np.array([np.linalg.norm(np.diff(self.strand(s), axis=0), axis=1).sum() for s in range(len(self))])


@pytest.fixture(scope="module")
def groom(tmp_path_factory):
    """Straight strands of 15 cm, 9 particles each, in metres; the format declares no unit."""
    path = tmp_path_factory.mktemp("groom") / "groom.data"
    path.write_bytes(data_bytes(strands()))
    return path


@pytest.fixture
def edit(program, groom, tmp_path):
    """Runs `ringlet groom NAME groom.data OPTIONS -o out.h5` and opens what it wrote."""

    def edit(name, *options):
        out = tmp_path / "out.h5"
        result = run(program, "groom", name, groom, "-o", out, *options)
        assert result.returncode == 0, result.stderr
        opened = Groom(out)
        assert result.stdout == f"wrote {out}: {len(opened)} strands, {len(opened.points)} particles\n"
        assert opened.metres == 1 and os.listdir(tmp_path) == ["out.h5"]
        return opened

    return edit


# ---- Trim ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [[0, 0.12, 0, 0, -2, 0], [0, 0.12, 0, 0, 1, 0, "--keep", "inside"]])
def test_trim_by_a_plane_keeps_what_its_normal_points_to(edit, options):
    trimmed = edit("trim", "--plane", *options)
    whole = strands()
    assert len(trimmed) == np.count_nonzero(whole[:, 0, 1] + 0.1 * (whole[:, 1, 1] - whole[:, 0, 1]) < 0.12)
    assert trimmed.points[:, 1].max() <= 0.12 + 1e-9
    tips = trimmed.roots_and_tips[1]
    assert np.count_nonzero(np.abs(tips[:, 1] - 0.12) < 1e-9) > 50  # the others were short of it, or lost a stub


def test_lengths_and_places_are_in_the_unit(edit):
    metres = edit("trim", "--box", "-0.5", "0.15", "-0.5", "0.5", "0.16", "0.5")
    shrunk = edit("trim", "--box", "-50", "16", "50", "50", "15", "-50", "--unit", "0.01")  # of a groom 1.5 mm long
    assert metres.points.shape < (STRANDS * PARTICLES, 3) and shrunk.points.shape == (STRANDS * PARTICLES, 3)
    assert np.allclose(shrunk.points, 0.01 * strands().reshape(-1, 3), atol=1e-9)


def test_trim_by_sphere_and_length(edit):
    ball = edit("trim", "--sphere", 0, 0, 0, "0.2", "--keep", "inside")
    tips = ball.roots_and_tips[1]
    distance = np.linalg.norm(tips, axis=1)
    assert distance.max() <= 0.2 + 1e-9 and np.count_nonzero(np.abs(distance - 0.2) < 1e-9) > 0.8 * STRANDS
    assert np.allclose(edit("trim", "--length", 4, "--unit", "cm").lengths.max(), 0.15 * 0.01)
    assert np.allclose(edit("trim", "--length", 0.04).lengths, 0.04, atol=1e-8)


def test_trim_by_a_mesh_stops_at_it(edit, tmp_path_factory):
    shell = tmp_path_factory.mktemp("mesh") / "shell.obj"
    vertices, triangles = tiny.ball(64, 96)
    write_mesh(shell, 2000 * vertices, triangles)  # a radius of 20 cm in millimetres
    trimmed = edit("trim", "--mesh", shell, "--mesh-unit", "mm", "--keep", "inside")
    distance = np.linalg.norm(trimmed.roots_and_tips[1], axis=1)
    assert distance.max() <= 0.2 + 1e-6
    assert np.count_nonzero(distance > 0.2 * np.cos(np.pi / 64)) > 0.8 * STRANDS


def test_trim_that_leaves_nothing_is_bad_input(program, groom, tmp_path):
    out = tmp_path / "out.h5"
    result = run(program, "groom", "trim", groom, "-o", out, "--plane", 0, 5, 0, 0, 1, 0)
    assert (result.returncode, result.stdout) == (3, "")
    error = result.stderr.splitlines()[-1]
    assert error.startswith(f"error: trim of {groom}: leaves nothing of any of {STRANDS} strands, expected ")
    assert os.listdir(tmp_path) == []


# ---- Lengthen, comb, resample ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "options, length, particles",
    [
        (["--by", 3, "--unit", "m"], 3 + LENGTH, PARTICLES + 160),
        (["--by", "0.0375"], 0.0375 + LENGTH, PARTICLES + 2),
        (["--to", "0.2"], 0.2, PARTICLES + 3),
        (["--to", "0.1"], LENGTH, PARTICLES),
        (["--factor", "2"], 2 * LENGTH, 2 * PARTICLES - 1),
        (["--factor", "2", "--mode", "scale"], 2 * LENGTH, PARTICLES),
    ],
)
def test_lengthen(edit, options, length, particles):
    longer = edit("lengthen", *options)
    assert np.allclose(longer.lengths, length, atol=1e-6)
    assert np.all(np.diff(longer.offsets) == particles)
    root, tip = longer.roots_and_tips
    before = strands()
    assert np.allclose(root, before[:, 0], atol=1e-9)
    along = (before[:, -1] - before[:, 0]) / LENGTH
    assert np.allclose(tip - root, length * along, atol=1e-4 * length)  # straight on


def test_comb_turns_strands_along_the_curve(edit, program, tmp_path_factory):
    combed = edit("comb", "--curve", 0, "0.1", 0, "0.5", "0.1", 0, "--radius", "0.3")
    root, tip = combed.roots_and_tips
    before = strands()
    assert np.allclose(combed.lengths, LENGTH, atol=1e-6) and np.allclose(root, before[:, 0], atol=1e-9)
    low, high = [0, 0.1, 0], [0.5, 0.1, 0]
    was, now = (np.linalg.norm(tips - np.clip(tips, low, high), axis=1) for tips in (before[:, -1], tip))
    assert np.all(now < was) and np.median(now) < 0.3 * np.median(was)

    curve = tmp_path_factory.mktemp("curve") / "curve.data"
    curve.write_bytes(data_bytes(np.array([[[9, 9, 9], [8, 8, 8]], [[0, 0.1, 0], [0.5, 0.1, 0]]], "<f4")))
    same = edit("comb", "--curve-file", curve, "--curve-strand", 1, "--radius", "0.3")
    assert np.allclose(same.points, combed.points, atol=1e-7)
    untouched = edit("comb", "--curve-file", curve, "--radius", "0.3", "--strength", 1)
    assert np.array_equal(untouched.points, strands().reshape(-1, 3).astype(float))


def test_resample(edit):
    many = edit("resample", "--particles", 41)
    assert np.all(np.diff(many.offsets) == 41) and np.allclose(many.lengths, LENGTH, atol=1e-6)
    stepped = edit("resample", "--step", 1, "--unit", "cm")  # of grooms 1.5 mm long: one segment each
    assert np.all(np.diff(stepped.offsets) == 2)
    for old, new in zip(strands()[:, [0, -1]].swapaxes(0, 1), many.roots_and_tips):
        assert np.array_equal(old.astype(float), new)


def test_the_axes_of_a_groom_file_are_kept(program, groom, tmp_path):
    upright = tmp_path / "z.h5"
    assert run(program, "groom", "convert", groom, "--up", "z", "-o", upright).returncode == 0
    assert Groom(upright).up == "z"
    out = tmp_path / "out.h5"
    assert run(program, "groom", "trim", upright, "--length", "0.04", "-o", out).returncode == 0
    assert Groom(out).up == Groom(upright).up
    assert np.array_equal(Groom(out).strand(0)[:2], Groom(upright).strand(0)[:2])
    turned = run(program, "groom", "trim", upright, "--length", "0.04", "--up", "y", "-o", out)
    assert turned.returncode == 0
    x, y, z = Groom(upright).strand(0)[0]
    assert np.array_equal(Groom(out).strand(0)[0], [x, z, -y])


def test_an_input_may_be_its_own_output(program, groom, tmp_path):
    path = tmp_path / "groom.h5"
    assert run(program, "groom", "convert", groom, "-o", path).returncode == 0
    for length in (0.1, 0.05):
        assert run(program, "groom", "trim", path, "--length", length, "-o", path).returncode == 0
        assert np.allclose(Groom(path).lengths, length, atol=1e-7)


# ---- A cache's frame -------------------------------------------------------------------------------


def test_rest_is_the_frame_of_a_cache_as_a_groom(program, tmp_path):
    scene = tiny.write_scene(tmp_path, lambda s: s.update(units={"length": "cm", "up": "y"}, groom=centimetres(s)))
    assert run(program, "run", scene, "-o", tmp_path / "cache", "--backend", "cpu").returncode == 0
    out = tmp_path / "rest.h5"
    result = run(program, "groom", "rest", tmp_path / "cache", "--frame", 3, "-o", out)
    assert (result.returncode, result.stderr) == (0, "")
    with h5py.File(tmp_path / "cache/tiny.0003.h5") as frame, h5py.File(tmp_path / "cache/tiny.h5") as master:
        rest = Groom(out)
        assert np.allclose(rest.points, 0.01 * frame["position"][()].astype(float), atol=1e-12)
        assert np.array_equal(rest.offsets, master["strands/offsets"])
        assert np.allclose(rest.widths, 0.01 * master["strands/width"][()])
        assert np.array_equal(rest.roots, master["strands/root_triangle"])
    missing = run(program, "groom", "rest", tmp_path / "cache", "--frame", 9, "-o", tmp_path / "no.h5")
    assert missing.returncode == 2
    assert re.fullmatch(r"error: --frame: .*tiny.h5 has no frame 9, there are 1 to 4\n", missing.stderr)
    assert not (tmp_path / "no.h5").exists()


def centimetres(scene):
    """The scene's groom and head in metres, in a scene of centimetres."""
    scene["head"]["units"] = {"length": "m"}
    return {**scene["groom"], "units": {"length": "m"}}


# ---- Errors ----------------------------------------------------------------------------------------

PLANE = ["--plane", "0", "0", "0", "0", "1", "0"]


@pytest.mark.parametrize(
    "arguments, named",
    [
        (["trim"], "--plane: is missing, and so is what may stand for it (give one of --plane, --box, "),
        (["trim", *PLANE, "--length", "1"], "--plane: is given together with --length"),
        (["trim", *PLANE[:-1]], "--plane"),
        (["trim", "--plane", "0", "0", "0", "0", "0", "0"], "--plane: the normal is 0 0 0"),
        (["trim", "--plane", "nan", "0", "0", "0", "1", "0"], "--plane: found a number that is not finite"),
        (["trim", "--box", "0", "0", "0", "0", "1", "1"], "--box: has no inside"),
        (["trim", "--sphere", "0", "0", "0", "-1"], "--sphere: found -1, expected a number above 0"),
        (["trim", "--length", "0"], "--length: found 0, expected a number above 0"),
        (["trim", "--length", "1", "--keep", "inside"], "--keep: is given together with --length"),
        (["trim", *PLANE, "--keep", "both"], "--keep"),
        (["trim", *PLANE, "--mesh-unit", "cm"], "--mesh-unit: is given without --mesh"),
        (["trim", *PLANE, "--unit", "ell"], "--unit: `ell` is no unit of length"),
        (["trim", *PLANE, "--up", "w"], "--up: `w` is no axis"),
        (["lengthen"], "--by: is missing"),
        (["lengthen", "--by", "1", "--to", "2", "--factor", "2"], "--by: is given together with --to, --factor"),
        (["lengthen", "--by", "-1"], "--by: found -1"),
        (["lengthen", "--factor", "0.5"], "--factor: found 0.5, expected 1 to 1000"),
        (["lengthen", "--by", "1", "--mode", "shrink"], "--mode"),
        (["comb", "--radius", "1"], "--curve: is missing"),
        (["comb", "--curve", "0", "0", "0", "1", "1", "1", "2", "--radius", "1"], "--curve: found 7 numbers"),
        (["comb", "--curve", "0", "0", "0", "0", "0", "0", "--radius", "1"], "--curve: leads nowhere"),
        (["comb", "--curve-file", "{groom}", "--curve-strand", "300", "--radius", "1"], "has no strand 300"),
        (["comb", "--curve", "0", "0", "0", "1", "1", "1"], "--radius"),
        (["comb", "--curve", "0", "0", "0", "1", "1", "1", "--radius", "0"], "--radius: found 0"),
        (["comb", "--curve", "0", "0", "0", "1", "1", "1", "--radius", "1", "--strength", "2"], "--strength: found 2"),
        (["resample"], "--particles: is missing"),
        (["resample", "--particles", "1"], "--particles: found 1, expected 2 or more"),
        (["resample", "--step", "0"], "--step: found 0"),
        (["resample", "--particles", "5", "--step", "1"], "--particles: is given together with --step"),
    ],
)
def test_usage_errors_name_the_option(program, groom, tmp_path, arguments, named):
    options = [argument.format(groom=groom) for argument in arguments[1:]]
    result = run(program, "groom", arguments[0], groom, "-o", tmp_path / "out.h5", *options)
    assert (result.returncode, result.stdout) == (2, ""), result.stderr
    assert re.fullmatch(r"error: [^\n]+\n", result.stderr) and named in result.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["trim", "lengthen", "comb", "resample"])
def test_bad_input_and_output_are_told(program, groom, tmp_path, name):
    options = {
        "trim": PLANE,
        "lengthen": ["--by", "1"],
        "comb": ["--curve", "0", "0", "0", "1", "1", "1", "--radius", "1"],
        "resample": ["--particles", "5"],
    }[name]
    missing = run(program, "groom", name, tmp_path / "none.data", "-o", tmp_path / "out.h5", *options)
    assert missing.returncode == 3 and "none.data" in missing.stderr
    named = run(program, "groom", name, groom, "-o", tmp_path / "out.hair", *options)
    assert named.returncode == 2 and "out.hair: a groom is written as HDF5" in named.stderr
    nowhere = run(program, "groom", name, groom, "-o", tmp_path / "no/out.h5", *options)
    assert nowhere.returncode == 5 and "no/out.h5" in nowhere.stderr
    assert os.listdir(tmp_path) == []


def test_a_step_far_too_small_is_refused(program, groom, tmp_path):
    result = run(program, "groom", "resample", groom, "--step", "1e-9", "-o", tmp_path / "out.h5")
    assert result.returncode == 3 and "particles, at most 1000000 are allowed (look at the unit)" in result.stderr
    assert os.listdir(tmp_path) == []


# ---- info ------------------------------------------------------------------------------------------


def test_info_measures_a_groom(program, groom, tmp_path):
    helix = tmp_path / "helix.data"
    angle = 0.2 * np.arange(100)
    points = 0.01 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    helix.write_bytes(data_bytes(np.stack([points + [0.1 * k, 0, 0] for k in range(20)]).astype("<f4")))
    report = json.loads(run(program, "info", helix, "--json").stdout)
    chord = 2 * 0.01 * np.sin(0.1)
    for name in ("min", "mean", "median", "max"):
        assert np.isclose(report["length"][name], 99 * chord, rtol=1e-5)
    for name in ("min", "mean", "max"):
        assert np.isclose(report["segment_length"][name], chord, rtol=1e-3)
    assert np.isclose(report["curvature"]["mean"], 0.2 / chord, rtol=1e-4)
    assert report["curvature"]["mean"] <= report["curvature"]["percentile_99"] <= report["curvature"]["max"]
    assert report["units"]["root_density"] == "roots/unit^2"
    text = run(program, "info", groom).stdout
    assert re.search(r"^curvature$", text, re.M) and re.search(r"^root density +\d", text, re.M)

    few = tmp_path / "few.h5"
    assert run(program, "groom", "convert", groom, "-o", few).returncode == 0
    assert json.loads(run(program, "info", few, "--json").stdout)["units"]["curvature"] == "1/m"
    few_strands = tmp_path / "few.data"
    few_strands.write_bytes(data_bytes(strands(8)))
    assert json.loads(run(program, "info", few_strands, "--json").stdout)["root_density"] is None
