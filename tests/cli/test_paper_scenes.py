"""The paper's scenes in reduced form: they run within their bounds, and each shows what its figure claims."""
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from conftest import SOURCE, run
from reproduction.common import SCENES, Run, grooms_of, read_scene, run_scene, thinned
from reproduction.fig06_wig import few_strands, sag
from reproduction.fig07_hand import HAND
from reproduction.fig08_sphere import INNER, OUTER, caught, from_centre
from reproduction.fig11_grooming import CUT, apart
from reproduction.inside import deeper_than, distance, inside_mesh
from small_cache import RADIUS, ball
from test_make_head import read_obj

STRAIN = 1e-3  # of any segment at a frame's end
DEPTH = 1e-4  # that a particle may be inside a solid [m]

# The paper's table 1: strands, and thousands of particles (cut off, not rounded).
TABLE = {
    "wig": (10422, 214),
    "hand": (15000, 450),
    "sphere": (10298, 308),
    "wind": (14718, 294),
    "asymmetric": (7528, 150),
    "grooming": (7905, 166),
}

# By scene: share of its strands, last frame, frames in which particles inside solids are counted.
REDUCED = {
    "wig": (0.02, 30, (10, 20, 30)),
    "hand": (0.02, 60, (20, 30, 40, 50, 60)),
    "sphere": (0.02, 60, (20, 26, 34, 44, 54)),
    "wind": (0.015, 30, (10, 20, 30)),
    "asymmetric": (0.03, 60, (9, 17, 25, 60)),
    "grooming": (0.02, 40, (24, 30, 40)),
}


@pytest.fixture(scope="module")
def reduced(program, tmp_path_factory):
    """reduced(scene, overrides): the run of a scene's reduced form, made once."""
    runs, folder = {}, tmp_path_factory.mktemp("paper")

    def make(name, overrides=None, strands=None):
        share, last, _ = REDUCED[name]
        settings = (strands or thinned(read_scene(name), share)) | (overrides or {})
        key = name, json.dumps(settings, sort_keys=True)
        if key not in runs:
            runs[key] = run_scene(name, f"{name}_{len(runs)}", settings, last, folder)
        return runs[key]

    return make


# ---- The scenes --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TABLE)
def test_counts_are_those_of_the_papers_table(name):
    grown = [groom["grow"] for _, groom in grooms_of(read_scene(name))]
    strands = sum(grow["strands"] for grow in grown)
    particles = sum(grow["strands"] * grow["particles"] for grow in grown)
    assert (strands, particles // 1000) == TABLE[name]


@pytest.mark.parametrize("name", TABLE)
def test_constants_are_the_papers(name):
    assert set(read_scene(name)["model"]) <= {"substeps"}  # all else is the schema's default, which is the paper's


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.json")), ids=lambda path: path.stem)
def test_scenes_are_described_and_need_nothing_from_outside(path):
    assert f"| {path.name} |" in (SCENES / "README.md").read_text()
    assert json.loads(path.read_text())["name"] == path.stem
    assert "shared" not in path.read_text()


@pytest.mark.parametrize("name", REDUCED)
def test_a_scene_runs_within_its_bounds(reduced, name):
    result = reduced(name)
    assert result.code == 0, result.log
    assert result.frames[-1] == REDUCED[name][1]
    health = result.health(REDUCED[name][2], DEPTH)
    assert 0 < health["edge_strain_free"] < STRAIN
    assert health["edge_strain_moved"] < STRAIN
    assert health["inside_worst"] == 0
    measured = max(abs(result.edge_strain(frame)).max() for frame in REDUCED[name][2])
    assert measured < STRAIN  # from the positions themselves


# ---- What they claim ---------------------------------------------------------------------------------------------


def test_wind_carries_the_tips_away(reduced):
    result = reduced("wind")
    wind = np.array(result.scene["effects"]["wind"]["keys"][-1]["velocity"])
    downwind = (result.position(30) - result.carried_rest(30))[result.tips] @ wind / np.linalg.norm(wind)
    assert np.median(downwind) > 0.1 and np.mean(downwind > 0) > 0.95


def test_the_wig_does_not_sag(reduced):
    still = reduced("wig", {"/effects/wind": None})
    assert sag(still)["largest"] < 1e-6
    moved = np.linalg.norm(reduced("wig").position(30) - still.position(30), axis=1)
    assert np.median(moved) > 0.02


def test_few_strands_of_the_wig_are_1024():
    assert sum(few_strands().values()) == 1024


def short_side_after(result):
    """Mean deviation of the short side's particles, roots excepted, in the last frame, over the strand's length."""
    short = np.repeat(result.groom, result.counts) == 1
    short[result.roots] = False
    return result.deviation(result.frames[-1])[short].mean()


@pytest.mark.parametrize("scheme, bound", [("projected", 0.08), ("paper", 0.2)])
def test_the_short_side_stays_a_style_with_ams_alone(reduced, scheme, bound):
    ams, plain = (
        short_side_after(reduced("asymmetric", {"/model/type": model, "/model/scheme": scheme}))
        for model in ("ams", "mass_spring")
    )
    assert ams < bound < 0.25 < plain


def test_the_hand_moves_hair(reduced):
    result = reduced("hand")
    moved = [np.linalg.norm(result.position(frame) - result.cache.rest_position, axis=1).max() for frame in (8, 40)]
    assert moved[0] < 0.001 and moved[1] > 0.08  # the hand has not come yet, and is in the hair


def test_hair_is_in_the_sphere_and_round_it(reduced):
    result = reduced("sphere")
    assert caught(result, 6) == 0
    assert caught(result, 44) > 0.005 * len(result.cache.rest_position)
    radius = from_centre(result, 44)
    assert (abs(radius - INNER) < 1e-4).sum() > 5  # it rests on the inner wall
    assert (abs(radius - OUTER) < 1e-4).sum() > 5  # and on the outer


def test_skinned_strands_go_through_the_hand_and_simulated_ones_do_not(reduced):
    guides = reduced("hand", {"/groom/interpolate": {"count": 12}})
    frames = REDUCED["hand"][2]
    inside = {run: [int(run.inside(frame, DEPTH, HAND).sum()) for frame in frames] for run in (reduced("hand"), guides)}
    assert max(inside[reduced("hand")]) == 0 and max(inside[guides]) > 10


def test_hair_that_is_cut_moves_otherwise_than_its_picture_cut(reduced):
    cut, uncut = reduced("grooming"), reduced("grooming", {"/effects/grooming": None})
    assert cut.living(CUT - 1).all() and 0.6 < cut.living(CUT).mean() < 0.9
    assert cut.position(CUT)[cut.living(CUT)][:, 1].min() > 0.12  # the box's upper side is at 0.13, and hair swings
    assert apart(cut, uncut, CUT)["median"] < 1e-7
    assert apart(cut, uncut, 40)["median"] > 2e-3


@pytest.mark.parametrize(
    "parameter, values, measure, rises",
    [
        ("step", (0.003, 0.009), "length", True),
        ("helix_radius", (0, 30), "straightness", False),
        ("gravity_influence", (0, 0.16), "drop", True),
    ],
)
def test_growth_parameters_do_what_the_tables_show(program, tmp_path, parameter, values, measure, rises):
    from reproduction.growth import shape

    settings = {"/groom/grow/strands": 200, "/groom/grow/step": 0.006}
    shapes = [
        shape(run_scene("growth", str(value), settings | {f"/groom/grow/{parameter}": value}, 1, tmp_path))
        for value in values
    ]
    low, high = ([value for key, value in each.items() if key.startswith(measure)][0] for each in shapes)
    assert (high > low + 0.02) if rises else (high < low - 0.02)


# ---- Assets and tools --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["hand", "sphere"])
def test_solids_are_what_the_tool_makes_and_closed(tmp_path, name):
    tool = SOURCE / "tools/make-paper-assets"
    subprocess.run([sys.executable, tool, "-o", tmp_path], check=True, capture_output=True)
    committed = SCENES / "assets" / f"{name}.obj"
    assert (tmp_path / committed.name).read_bytes() == committed.read_bytes()
    vertices, triangles, _ = read_obj(committed)
    edges = [(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)]
    assert len(set(edges)) == len(edges) and all((b, a) in set(edges) for a, b in edges[:300])
    assert set(edges) == {(b, a) for a, b in edges}
    assert len(vertices) - len(edges) // 2 + len(triangles) == 2 and len(triangles) < 10_000


def test_the_sphere_is_hollow_and_open():
    vertices, triangles, _ = read_obj(SCENES / "assets/sphere.obj")
    points = np.array([[0, 0, 0], [0, 0.106, 0], [0, 0, -0.106], [0, 0.112, 0], [0, 0.1, 0], [0, 0, 0.106]])
    assert inside_mesh(points, vertices, triangles).tolist() == [False, True, True, False, False, False]


def test_crossings_tell_inside_from_outside():
    vertices, triangles = ball(48, 64)
    random = np.random.default_rng(5)
    points = random.normal(size=(5000, 3))
    points *= random.uniform(0.5, 1.5, (5000, 1)) * RADIUS / np.linalg.norm(points, axis=1, keepdims=True)
    radius = np.linalg.norm(points, axis=1)
    clear = abs(radius - RADIUS) > 3e-4  # the mesh is a little smaller than the ball
    assert (inside_mesh(points, vertices, triangles) == (radius < RADIUS))[clear].all()
    away = distance(points[:200], vertices, triangles)
    assert abs(away - abs(radius[:200] - RADIUS)).max() < 3e-4
    assert (deeper_than(points[:200], 0.01, vertices, triangles) == (away > 0.01)).all()


def test_a_particle_in_a_solid_is_found(reduced, monkeypatch):
    result = reduced("hand")
    position, (vertices, _) = result.position(30), result.surfaces(30)[1]
    position[7] = vertices[:50].mean(0)  # in the forearm
    monkeypatch.setattr(Run, "position", lambda self, frame: position)
    assert np.flatnonzero(result.inside(30, DEPTH)).tolist() == [7]


def test_figures_are_listed_and_a_wrong_name_is_an_error(source):
    listed = run(source / "tools/figures", "--list")
    assert listed.returncode == 0 and "fig06_wig" in listed.stdout and "Figure 6" in listed.stdout
    wrong = run(source / "tools/figures", "fig99")
    assert wrong.returncode == 2 and "no figure fig99" in wrong.stderr


# ---- The document ------------------------------------------------------------------------------------------------

REPRODUCTION = SOURCE / "docs/reproduction.md"


def health_of(figure):
    numbers = json.loads((SOURCE / f"docs/figures/{figure}.json").read_text())
    return next(numbers[key] for key in ("health", "full") if key in numbers) if "strands" not in numbers else numbers


@pytest.mark.parametrize(
    "scene, figure",
    [
        ("wind", "fig01_wind"),
        ("asymmetric", "fig01_asymmetric"),
        ("wig", "fig06_wig"),
        ("hand", "fig07_hand"),
        ("sphere", "fig08_sphere"),
        ("grooming", "fig11_grooming"),
    ],
)
def test_the_table_of_times_tells_what_was_measured(scene, figure):
    row = re.search(rf"^\| {scene} \|(.*)\|$", REPRODUCTION.read_text(), re.MULTILINE)[1]
    told = [float(cell.replace(",", "")) for cell in row.split("|")]
    health = health_of(figure)
    keys = ("strands", "particles", "core_ms_per_frame", "edge_strain_free", "edge_strain_moved")
    measured = [health[key] for key in keys]
    measured += [1e3 * health["push_out_max_m"], health["inside_worst"]]
    assert told[:2] + told[3:] == pytest.approx(measured, rel=0.05)
    assert health["edge_strain_free"] < STRAIN and health["edge_strain_moved"] < STRAIN and health["inside_worst"] == 0
    assert (health["strands"], health["particles"] // 1000) == TABLE[scene]


def test_the_documents_pictures_are_there_and_small():
    named = re.findall(r"\((figures/[^)]+)\)", REPRODUCTION.read_text())
    assert len(named) > 20
    for name in named:
        assert (REPRODUCTION.parent / name).stat().st_size < 300_000
