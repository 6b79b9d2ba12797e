"""Substeps that a run chooses by the error they leave: /model/substeps as {"tolerance", "min", "max"}."""
import json

import h5py
import numpy as np
import pytest

from conftest import SOURCE, run
from tiny import LENGTH, PARTICLES, data_bytes, figures, steps, strands, write_scene
from tiny_mesh import write_mesh_scene

LAST = 5
SOFT = {"edge": 2e4, "bend": 2e3, "twist": 500, "integrity": 60, "angular": 20}


def chosen(tolerance, most=1000, least=1):
    return "--set=/model/substeps=" + json.dumps({"tolerance": tolerance, "min": least, "max": most})


STEP = '--set=/effects/inextensible/metric="step"'  # which is that of chosen substeps


def fixed(substeps):
    return f"--set=/model/substeps={substeps}"


def falling(scene):
    """Soft hair that falls from its rest shape, to one side."""
    del scene["head"]
    scene["groom"]["attach"] = "fixed"
    scene["effects"] = {"gravity": [3, -9.81, 0]}
    scene["frames"]["last"] = LAST
    scene["model"] = {"stiffness": SOFT, "preload": False, "drag": 1}


def blown(scene):
    falling(scene)
    scene["effects"]["wind"] = {"velocity": [1, 0, 0.5], "gusts": {}, "turbulence": {}}


def positions(out):
    with h5py.File(out / "tiny.h5") as cache:
        return cache["position"][:].astype(float)


def rms(difference):
    """[frames] over the particles, relative to the strands' length."""
    return np.sqrt((difference**2).sum(-1).mean(-1)) / LENGTH


# ---- The error


@pytest.mark.parametrize("change", [falling, blown])
def test_the_error_follows_the_tolerance_over_two_decades(program, tmp_path, change):
    scene = write_scene(tmp_path, change, data_bytes(strands(32)))

    def at(name, *options):
        steps(program, scene, tmp_path / name, "--precision=double", *options)
        return positions(tmp_path / name)

    finest = at("finest", fixed(1000))
    reference = finest + (finest - at("fine", fixed(500)))  # the method is of first order
    assert rms(finest - reference)[-1] < 3e-4  # and what is left of that, of second
    tolerances = [1e-2, 1e-3, 1e-4]
    errors = np.array([rms(at(f"{t}", chosen(t)) - reference)[1:] for t in tolerances])
    # A frame adds no more than the tolerance to what the earlier ones have left, and that swings with the hair.
    scaled = errors / np.array(tolerances)[:, None] / np.arange(1, LAST)
    assert (scaled < 1.5).all() and (scaled[:, -1] > 0.1).all(), scaled
    order = np.log(errors[0, -1] / errors[-1, -1]) / np.log(tolerances[0] / tolerances[-1])
    assert 0.85 < order < 1.15
    assert figures(tmp_path / "0.0001", "step_error_above").max() == 0
    assert figures(tmp_path / "0.0001", "substeps")[1:].min() > 30 * figures(tmp_path / "0.01", "substeps")[1:].max()


def test_the_estimate_is_the_error_of_a_frame(program, tmp_path):
    """In the first frame, which starts where the reference does."""
    scene = write_scene(tmp_path, falling, data_bytes(strands(32)))
    options = ["--precision=double", "--set=/frames/last=2"]
    steps(program, scene, tmp_path / "fine", fixed(1000), *options)
    steps(program, scene, tmp_path / "out", chosen(3e-3), *options)
    error = rms(positions(tmp_path / "out") - positions(tmp_path / "fine"))[1]
    assert figures(tmp_path / "out", "step_error")[1] == pytest.approx(error, rel=0.1)
    again = steps(program, scene, tmp_path / "again", *options, fixed(int(figures(tmp_path / "out", "substeps")[1])))
    assert (positions(tmp_path / "again") == positions(tmp_path / "out")).all() and again


@pytest.mark.parametrize("tolerance", [1e-3, 3e-4])
def test_with_lengths_held_and_solids_no_more_than_the_tolerance_is_left(program, tmp_path, tolerance):
    """Errors fall with an order below 1 there, which the estimate must not take for granted."""
    options = ['--set=/name="tiny"', "--set=/frames/last=2", "--set=/groom/grow/strands=200", "--precision=double", STEP]

    def at(name, *more):
        steps(program, SOURCE / "scenes/quickstart.json", tmp_path / name, *options, *more)
        return positions(tmp_path / name)

    finest = at("finest", fixed(1000))
    length = np.linalg.norm(np.diff(finest[0].reshape(200, -1, 3), axis=1), axis=-1).sum(1).mean()
    error = np.sqrt(((at("out", chosen(tolerance))[1] - finest[1]) ** 2).sum(-1).mean()) / length
    assert error <= tolerance and figures(tmp_path / "out", "step_error")[1] <= tolerance
    assert figures(tmp_path / "out", "substeps")[1] <= 256  # and not by waste


def test_a_hard_frame_gets_more_substeps_than_a_still_one(program, tmp_path):
    def jerked(scene):
        keys = [{"frame": f} for f in (1, 4)] + [{"frame": f, "translate": [0.03, 0, 0]} for f in (5, 12)]
        scene["head"]["animation"] = {"keys": keys, "interpolation": "linear"}
        scene["effects"] = {"gravity": [0, -9.81, 0]}
        scene["frames"]["last"] = 12
        scene["model"] = {"drag": 60}

    scene = write_scene(tmp_path, jerked, data_bytes(strands(32)))
    steps(program, scene, tmp_path / "out", chosen(1e-3))
    substeps, tried = figures(tmp_path / "out", "substeps"), figures(tmp_path / "out", "substeps_tried")
    assert (substeps[1:4] == 2).all() and (tried[1:4] == 3).all()  # preloaded hair at rest
    assert substeps[4] >= 16
    assert substeps[-1] < substeps[4] / 2
    assert (figures(tmp_path / "out", "step_error") <= 1e-3).all()


def test_the_most_substeps_are_told_where_they_are_not_enough(program, tmp_path):
    scene = write_scene(tmp_path, falling, data_bytes(strands(32)))
    result = run(program, "run", scene, "-o", tmp_path / "out", "--progress=none", chosen(1e-4, most=6, least=3))
    assert result.returncode == 0
    assert result.stderr.count("above the tolerance of 0.0001") == 1 and "frame 2: 6 substeps" in result.stderr
    assert (figures(tmp_path / "out", "substeps")[1:] == 6).all()
    assert (figures(tmp_path / "out", "step_error_above")[1:] == 1).all()
    assert (figures(tmp_path / "out", "step_error")[1:] > 1e-4).all()


def test_what_too_few_substeps_break_more_mend(program, tmp_path):
    """A try that leaves the limits is one of too few substeps."""
    scene = write_scene(tmp_path, blown, data_bytes(strands(32)))
    options = ["--set=/limits/edge_strain=0.19", "--set=/frames/last=2", "-q", "--progress=none", "--overwrite"]
    assert run(program, "run", scene, "-o", tmp_path / "few", *options, fixed(8)).returncode == 4
    result = run(program, "run", scene, "-o", tmp_path / "out", *options, chosen(0.5, most=64))
    assert result.returncode == 0, result.stderr
    assert figures(tmp_path / "out", "substeps")[1] == 32  # 16 and 32 are the first two that do not leave them
    assert run(program, "run", scene, "-o", tmp_path / "out", *options, chosen(0.5, most=8)).returncode == 4


# ---- The same bytes


def hair_against_hair(scene):
    scene["effects"]["hair_hair"] = {"grid": {"resolution": 32}, "contacts": {"radius": 5e-4}}
    scene["effects"]["wind"] = {"velocity": [4, 0, 1], "gusts": {}, "turbulence": {}, "shelter": {}}
    scene["effects"]["non_hookean"] = {"curve": [[0.02, 0.02], [0.1, 0.05]]}


def every_substep(scene):
    hair_against_hair(scene)
    scene["effects"]["hair_hair"] = {
        "grid": {"resolution": 32, "cadence": "substep", "shelter": {}}, "contacts": {"radius": 5e-4, "cadence": "substep"},
    }


def mesh_in_wind(scene):
    scene["effects"]["wind"] = {"velocity": [3, 0, 0], "turbulence": {}}


@pytest.mark.parametrize("write, change, tolerance, most", [
    (write_scene, hair_against_hair, 7.2e-2, 32), (write_scene, every_substep, 0.12, 16), (write_mesh_scene, mesh_in_wind, 2.4e-2, 16),
])
def test_a_cut_run_and_any_number_of_threads_choose_the_same(program, tmp_path, write, change, tolerance, most):
    scene = write(tmp_path, change)
    options = [chosen(tolerance, most=most), "-q"]
    whole = steps(program, scene, tmp_path / "whole", "--threads=1", *options)
    assert steps(program, scene, tmp_path / "threads", "--threads=3", *options) == whole
    steps(program, scene, tmp_path / "cut", "--set=/frames/last=2", *options)
    assert steps(program, scene, tmp_path / "cut", "--resume", *options) == whole
    assert len(set(figures(tmp_path / "whole", "substeps")[1:])) > 1


@pytest.mark.parametrize("write, change", [(write_scene, every_substep), (write_mesh_scene, mesh_in_wind)])
def test_a_try_leaves_nothing_behind(program, tmp_path, write, change):
    """A frame that was tried before ends as if it had been taken once."""
    scene = write(tmp_path, change)
    options = ["--set=/frames/last=2", "-q"] + ([STEP] if write is write_scene else [])
    steps(program, scene, tmp_path / "chosen", chosen(1e-12, most=8), *options)
    assert figures(tmp_path / "chosen", "substeps_tried")[1] == 1 + 2 + 4 + 8
    steps(program, scene, tmp_path / "once", fixed(8), *options)
    assert (positions(tmp_path / "chosen") == positions(tmp_path / "once")).all()


# ---- The plan


def test_the_plan_tells_from_how_many_to_how_many(program, tmp_path):
    scene = write_scene(tmp_path, blown, data_bytes(strands(32)))
    result = run(program, "plan", scene, "--json", chosen(1e-3, most=8))
    plan = json.loads(result.stdout)
    assert (plan["least_substeps"], plan["substeps"]) == (2, 8)
    stages = {stage["name"]: stage for stage in plan["stages"]}
    frames = LAST - 1
    # 1 and 2 substeps at the least; 1, 2, 4 and 8 at the most.
    assert (stages["strands"]["least_launches"], stages["strands"]["launches"]) == (3 * frames, 17 * frames)
    # The frame's start, and the positions of two tries in double precision: three arrays of [32 lanes][particles][3] at the least.
    assert stages["tries"]["bytes"] > 32 * PARTICLES * 3 * (4 + 4 + 2 * 8) and stages["tries"]["launches"] == 0
    assert "tries" in json.loads(run(program, "plan", scene, "--json", fixed(8)).stdout)["absent"]
    assert "of 2 to 8 substeps" in run(program, "plan", scene, chosen(1e-3, most=8)).stdout
    steps(program, scene, tmp_path / "out", chosen(1e-3, most=8), "-q")
    tried = figures(tmp_path / "out", "substeps_tried").sum()
    assert stages["strands"]["least_launches"] <= tried <= stages["strands"]["launches"]


def test_info_tells_what_may_be_chosen(program, tmp_path):
    scene = write_scene(tmp_path)
    described = json.loads(run(program, "info", scene, "--json").stdout)
    assert described["substeps"] == 4
    scene = write_scene(tmp_path, lambda scene: scene["model"].update(substeps={}))
    described = json.loads(run(program, "info", scene, "--json").stdout)
    assert described["substeps"] == {"tolerance": 1e-4, "min": 1, "max": 64}
