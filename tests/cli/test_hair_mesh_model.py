"""The hair-mesh model through the program."""
import json

import h5py
import numpy as np
import pytest

from conftest import SOURCE, run
from tiny import LAST, RADIUS, figures, steps, write_scene
from tiny_mesh import ACROSS, LAYERS, write_mesh_scene


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return write_mesh_scene(tmp_path_factory.mktemp("mesh"))


def positions(out, frame):
    with h5py.File(out / f"tiny.{frame:04}.h5") as cache:
        return cache["position"][:]


def stages(program, scene, *options):
    result = run(program, "plan", scene, "--json", *options)
    assert result.returncode == 0, result.stderr
    return {stage["name"]: stage for stage in json.loads(result.stdout)["stages"]}


# A solid that the mesh starts in, but for its roots.
AROUND = {"centre": [0, 0, 0], "radii": [1.5 * RADIUS, 1.5 * RADIUS, 1.5 * RADIUS], "friction": 0.3}
ELLIPSOIDS = f"--set=/model/hair_mesh/ellipsoids=[{json.dumps(AROUND)}]"

# ---- running


@pytest.mark.parametrize("precision", ["float", "double"])
def test_a_run_cut_in_the_middle_goes_on_bit_for_bit(program, scene, tmp_path, precision):
    options = ["--precision", precision, ELLIPSOIDS, '--set=/effects/wind={"velocity": [3, 0, 0], "turbulence": {}}']
    whole = steps(program, scene, tmp_path / "whole", *options)
    steps(program, scene, tmp_path / "cut", *options, f"--set=/frames/last={LAST - 2}", "--threads", "1")
    assert steps(program, scene, tmp_path / "cut", *options, "--resume") == whole
    assert figures(tmp_path / "whole", "mesh_touched").max() > 0


def test_steps_converge_at_first_order(program, scene, tmp_path):
    """Implicit Euler: what the next halving of the substep changes is half of what this one did."""
    ends = []
    for substeps in (16, 32, 64):
        out = tmp_path / str(substeps)
        options = ["--precision=double", "--set=/effects/solids=[]", "--set=/model/hair_mesh/residual=1e-8"]
        steps(program, scene, out, *options, f"--set=/model/substeps={substeps}")
        ends.append(positions(out, LAST))
    change = [np.linalg.norm(ends[k + 1] - ends[k]) for k in range(2)]
    assert 0.8 < np.log2(change[0] / change[1]) < 1.3


def test_frame_one_is_the_rest_shape_and_strands_start_on_the_head(program, scene, tmp_path):
    steps(program, scene, tmp_path / "out")
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        rest, offsets = cache["strands/rest_position"][:], cache["strands/offsets"][:]
    first = positions(tmp_path / "out", 1)
    assert np.allclose(first, rest, atol=1e-6)
    radii = np.linalg.norm(first[offsets[:-1]], axis=1)  # the scalp's faces are chords of the ball
    assert (radii < RADIUS + 1e-6).all() and (radii > 0.93 * RADIUS).all()


def test_the_figures_tell_of_the_solves(program, scene, tmp_path):
    steps(program, scene, tmp_path / "out", "--set=/model/substeps=2")
    out = tmp_path / "out"
    assert (figures(out, "mesh_solves")[1:] == 2).all()
    assert (figures(out, "mesh_iterations")[1:] > 0).all()
    assert figures(out, "mesh_residual").max() <= 1e-4
    assert np.abs(figures(out, "mesh_volume") - 1).max() < 0.5


def test_a_solve_that_is_cut_short_is_told_once(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--set=/model/hair_mesh/max_iterations=1")
    assert result.returncode == 0
    assert result.stderr.count("a hair mesh's solve stopped at a relative residual of") == 1
    assert figures(tmp_path / "out", "mesh_residual").max() > 1e-4


@pytest.mark.parametrize("stretch", ["1e8", "1e10"])
def test_stiffness_that_single_precision_cannot_solve_is_told(program, scene, tmp_path, stretch):
    options = ["-o", tmp_path / "out", "--overwrite", f"--set=/model/hair_mesh/stretch={stretch}"]
    result = run(program, "run", scene, *options, "--precision=float")
    assert result.returncode == 4 and "double precision solves" in result.stderr
    assert "particle -1" not in result.stderr
    steps(program, scene, tmp_path / "double", "--precision=double", *options[3:])
    assert figures(tmp_path / "double", "mesh_residual").max() <= 1e-4


def test_velocities_are_those_of_the_way(program, scene, tmp_path):
    out = tmp_path / "out"
    steps(program, scene, out, '--set=/cache/fields=["position", "velocity"]', "--set=/effects/solids=[]")
    with h5py.File(out / f"tiny.{LAST:04}.h5") as cache:
        velocity = cache["velocity"][:]
    way = 24 * (positions(out, LAST) - positions(out, LAST - 1))
    assert np.abs(velocity - way).max() < 1e-3 * np.abs(way).max()


def test_collapsed_hair_recovers(program, scene, tmp_path):
    options = ["--set=/head/animation=null", "--set=/effects/solids=[]", "--set=/frames/last=121"]
    steps(program, scene, tmp_path / "rest", *options)
    steps(program, scene, tmp_path / "collapsed", *options, '--set=/model/hair_mesh/start="collapsed"')
    start = positions(tmp_path / "collapsed", 1)
    assert np.ptp(start.reshape(200, -1, 3), axis=1).max() < 1e-6
    settled, recovered = positions(tmp_path / "rest", 121), positions(tmp_path / "collapsed", 121)
    assert np.linalg.norm(settled - recovered, axis=1).max() < 0.01 * 0.09
    volumes = [figures(tmp_path / name, "mesh_volume")[-1] for name in ("rest", "collapsed")]
    assert volumes[1] == pytest.approx(volumes[0], rel=0.01)


def test_ellipsoids_keep_hair_out_and_minimisation_is_left_out_when_not_asked_for(program, scene, tmp_path):
    options = ["--set=/effects/solids=[]", ELLIPSOIDS]
    steps(program, scene, tmp_path / "on", *options)
    assert figures(tmp_path / "on", "mesh_touched").max() > 0
    off = "--set=/model/hair_mesh/deformation_minimisation=false"
    steps(program, scene, tmp_path / "off", *options, off)
    assert figures(tmp_path / "off", "minimisations").max() == 0
    assert "minimisation" in stages(program, scene, *options)
    assert "minimisation" not in stages(program, scene, *options, off)


BALL = """v 0.06 0 0\nv -0.06 0 0\nv 0 0.06 0\nv 0 -0.06 0\nv 0 0 0.06\nv 0 0 -0.06
f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n"""


@pytest.mark.parametrize("minimise", ["true", "false"])
def test_a_level_set_that_flies_through_within_a_frame_takes_the_hair_along(program, scene, tmp_path, minimise):
    """The solid's way from frame 2 to 3 leads from one side of the hair to the other."""
    (tmp_path / "ball.obj").write_text(BALL)
    level = RADIUS + 0.07
    keys = [{"frame": frame, "translate": [x, level, 0.0]} for frame, x in ((2, -0.3), (3, 0.25))]
    ball = {"source": str(tmp_path / "ball.obj"), "friction": 0.0, "animation": {"keys": keys}}
    still = ["--set=/head/animation=null", "--set=/effects/gravity=null", "--set=/frames/last=3"]
    options = [*still, f"--set=/effects/solids=[{json.dumps(ball)}]"]
    steps(program, scene, tmp_path / "out", *options, f"--set=/model/hair_mesh/deformation_minimisation={minimise}")
    before, after = (positions(tmp_path / "out", frame) for frame in (2, 3))
    met = (np.abs(before[:, 1] - level) < 0.01) & (np.abs(before[:, 2]) < 0.01)
    assert met.any() and (after[met, 0] - before[met, 0]).mean() > 0.03


def test_the_walk_at_ten_times_its_speed_comes_back(program, tmp_path):
    """Around a head and shoulders that hair is thrown against, within the scene's own limits."""
    options = ["-q", "--set=/motion/speed=10", "--set=/groom/hair_mesh/strands=50", '--set=/name="tiny"']
    result = run(program, "run", SOURCE / "scenes/hair_mesh/walk.json", "-o", tmp_path / "out", *options)
    assert result.returncode == 0, result.stderr
    assert 2 < figures(tmp_path / "out", "mesh_strain").max() < 10, "it is thrown, and not beyond the limits"
    assert figures(tmp_path / "out", "mesh_speed")[-1] < 0.1
    assert figures(tmp_path / "out", "mesh_volume")[-1] > 0.9


def test_the_plan_has_what_the_scene_calls_for(program, scene):
    assert set(stages(program, scene, "--set=/effects/solids=[]")) == {"roots", "forces", "solve", "strands"}
    windy = stages(program, scene, '--set=/effects/wind={"velocity": [1, 0, 0]}')
    assert windy["wind"]["bytes"] == ACROSS * ACROSS * LAYERS * 24


def test_the_strands_of_a_mesh_can_be_simulated_themselves(program, scene, tmp_path):
    options = ["--set=/model=null", "--set=/effects/inextensible={}"]
    steps(program, scene, tmp_path / "ams", *options)
    steps(program, scene, tmp_path / "mesh")
    with h5py.File(tmp_path / "ams/tiny.h5") as one, h5py.File(tmp_path / "mesh/tiny.h5") as other:
        assert (one["strands/offsets"][:] == other["strands/offsets"][:]).all()
    assert figures(tmp_path / "ams", "edge_strain_free").max() <= 1e-3


# ---- what is refused


@pytest.mark.parametrize(
    "change, expected",
    [
        ("/effects/inextensible={}", "/effects/inextensible: found an effect of simulated strands"),
        ('/effects/hair_hair={"grid": {}}', "/effects/hair_hair: found an effect of simulated strands"),
        ("/groom/hair_mesh/strands=0", "/groom/hair_mesh: found neither strands nor density above 0, expected one of them"),
        ("/groom/hair_mesh/density=5e4", "/groom/hair_mesh: found both strands and density, expected one of them"),
        ("/groom/hair_mesh=null", "/groom: found none of file, grow, hair_mesh"),
        ('/groom/attach="stored"', "/groom/attach: found \"stored\", expected none with hair_mesh"),
        ('/groom/interpolate={"count": 3}', "/groom/interpolate: found a key of simulated strands"),
        ("/groom/particles=5", "/groom/particles: found a key of simulated strands"),
        ('/effects/wind={"velocity": [1, 0, 0], "shelter": {}}', "/effects/wind/shelter: found"),
        ('/model/hair_mesh={"stretch": -1}', "/model/hair_mesh/stretch: found -1, expected a number"),
        ('/model/type="ams"', "/model/hair_mesh: found hair_mesh with model \"ams\""),
    ],
)
def test_what_the_model_cannot_do_is_told(program, tmp_path, change, expected):
    scene = write_mesh_scene(tmp_path, lambda scene: scene["model"].update(hair_mesh={}))
    result = run(program, "validate", scene, "--set", change)
    assert result.returncode == 3
    assert expected in result.stderr


def test_the_model_needs_hair_meshes(program, tmp_path):
    scene = write_scene(tmp_path, lambda scene: scene["model"].update(type="hair_mesh"))
    result = run(program, "validate", scene, "--set=/effects/inextensible=null")
    assert result.returncode == 3
    assert "/groom: found strands without a hair mesh, expected hair_mesh" in result.stderr


def test_cuda_is_refused(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--backend", "cuda")
    assert result.returncode == 6
    assert "error: --backend cuda: the model hair_mesh steps on the CPU (use --backend cpu or auto)" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_run_beyond_the_limits_names_the_vertex(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--set=/limits/speed=0.01")
    assert result.returncode == 4
    assert "vertex" in result.stderr and "layer" in result.stderr and "beyond the limit of 0.01 m/s" in result.stderr
    assert (tmp_path / "out/tiny.failed.h5").exists()
