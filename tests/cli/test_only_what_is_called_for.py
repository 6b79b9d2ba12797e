"""What a scene does not call for is no stage, no memory, no launch and no library; what has no strength changes nothing."""
import json
import os
import re
import shutil
import subprocess

import h5py
import numpy as np
import pytest

from conftest import run
from tiny import LAST, LENGTH, data_bytes, steps, strands, write_scene
from tiny_mesh import write_mesh_scene

WIND = {"velocity": [4, 0, 1]}
class Effect:
    """An effect as it is there and without strength; the stages that run it, if not those of the model; what there must
    be for it to show, the farthest [strand lengths] that it may move anything without strength, and its set-up in a trace."""

    def __init__(self, pointer, there, zero, *stages, beside=None, bound=0, set_up=()):
        self.pointer, self.there, self.zero, self.stages = pointer, there, zero, set(stages)
        self.beside, self.bound, self.set_up = beside or {}, bound, set(set_up)


FAR = {"source": "solid.obj", "resolution": 16, "animation": {"keys": [{"frame": 1, "translate": [9, 0, 0]}]}}
NEAR = {"source": "solid.obj", "resolution": 16, "animation": {"keys": [{"frame": 1, "translate": [0, 0.12, 0]}]}}
EFFECTS = {
    "gravity": Effect("/effects/gravity", [2, -9.81, 0], [0, 0, 0]),
    "inextensible": Effect("/effects/inextensible", {}, {"tolerance": 1}),
    # Hooke's line goes on beyond any stretch there is.
    "non_hookean": Effect("/effects/non_hookean", {"curve": [[1e-4, 1e-4], [0.1, 0.001]]}, {"curve": [[50, 50], [60, 55]]}),
    "wind": Effect("/effects/wind", WIND, {"velocity": [0, 0, 0]}, "wind", set_up=["wind field"]),
    "gusts": Effect("/effects/wind/gusts", {"strength": 0.5}, {"strength": 0}, beside={"/effects/wind": WIND}),
    "turbulence": Effect("/effects/wind/turbulence", {"strength": 0.5}, {"strength": 0}, beside={"/effects/wind": WIND}),
    "shelter": Effect("/effects/wind/shelter", {"strength": 1}, {"strength": 0}, beside={"/effects/wind": WIND}),
    # Hair thinner than anything is touched by none.
    "contacts": Effect("/effects/hair_hair/contacts", {"radius": 2e-3}, {"radius": 1e-9}, "contacts"),
    "grid": Effect("/effects/hair_hair/grid", {"resolution": 16, "pic": 0.5}, {"resolution": 512, "pic": 0}, "grid"),
    "solids": Effect("/effects/solids", [NEAR], [FAR], "solids", set_up=["OpenVDB", "level set", "mesh"]),
    "trim": Effect("/effects/grooming", [{"frame": 2, "trim": {"length": 0.1}}], [{"frame": 2, "trim": {"length": 9}}], "grooming"),
    "lengthen": Effect("/effects/grooming", [{"frame": 2, "lengthen": {"factor": 1.5, "mode": "scale"}}],
                       [{"frame": 2, "lengthen": {"factor": 1, "mode": "scale"}}], "grooming"),
    "comb": Effect("/effects/grooming", [{"frame": 2, "comb": {"curve": [[0, 0.1, 0], [0.1, 0.2, 0]], "radius": 0.1}}],
                   [{"frame": 2, "comb": {"curve": [[0, 0.1, 0], [0.1, 0.2, 0]], "radius": 0.1, "strength": 0}}], "grooming"),
    # Guides follow themselves.
    "guides": Effect("/groom/interpolate", {"count": 8}, {"count": 48}, "interpolation"),
    "motion": Effect("/motion", {"keys": [{"frame": 1}, {"frame": 4, "translate": [0.1, 0, 0]}]}, {"keys": [{"frame": 1}]}),
}


# Of hair meshes, whose solids bring the minimisation of what they deform.
MESH_EFFECTS = {
    "wind": Effect("/effects/wind", WIND, {"velocity": [0, 0, 0]}, "wind", set_up=["wind field"]),
    "gusts": Effect("/effects/wind/gusts", {"strength": 0.5}, {"strength": 0}, beside={"/effects/wind": WIND}),
    "turbulence": Effect("/effects/wind/turbulence", {"strength": 0.5}, {"strength": 0}, beside={"/effects/wind": WIND}),
    "solids": Effect("/effects/solids", [NEAR], [FAR], "solids", "minimisation", set_up=["OpenVDB", "level set", "mesh"]),
    "ellipsoids": Effect("/model/hair_mesh/ellipsoids", [{"centre": [0, 0.17, 0], "radii": [0.05, 0.05, 0.05]}],
                         [{"centre": [9, 0, 0], "radii": [0.05, 0.05, 0.05]}], "solids", "minimisation"),
    "motion": EFFECTS["motion"],
}


def setting(pointer, value):
    return f"--set={pointer}={json.dumps(value)}"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """Sparse hair on a head under gravity, and nothing else."""
    def change(scene):
        scene["effects"] = {"gravity": [0, -9.81, 0]}
        scene["model"].update(preload=False)
        del scene["head"]["animation"]

    directory = tmp_path_factory.mktemp("called")
    file = write_scene(directory, change, data_bytes(strands(48)))
    shutil.copy(directory / "head.obj", directory / "solid.obj")
    return file


class Outcome:
    """A run: its plan by stage, what its trace names, its positions and bytes."""

    def __init__(self, program, scene, out, *options):
        self.bytes = steps(program, scene, out, "-q", "--trace", out.with_suffix(".trace"), *options)
        plan = json.loads(run(program, "plan", scene, "--json", *options).stdout)
        self.plan = {stage["name"]: stage for stage in plan["stages"]}
        self.absent = set(plan["absent"])
        events = json.loads(out.with_suffix(".trace").read_text())["traceEvents"]
        self.stages = {event["name"] for event in events if event.get("cat") == "stage"}
        self.set_up = {event["name"] for event in events if event.get("cat") == "set-up"}
        with h5py.File(out / "tiny.h5") as cache:
            self.positions = cache["position"][:]


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    """A hair mesh on a head under gravity, and nothing else."""
    def change(scene):
        scene["effects"] = {"gravity": [0, -9.81, 0]}
        scene["model"] = {"type": "hair_mesh", "substeps": 4}
        del scene["head"]["animation"]

    directory = tmp_path_factory.mktemp("mesh")
    file = write_mesh_scene(directory, change)
    shutil.copy(directory / "head.obj", directory / "solid.obj")
    return file


@pytest.fixture(scope="module")
def without(program, tmp_path_factory):
    """Runs of a scene without an effect, by what is beside it."""
    known = {}

    def outcome(scene, beside):
        key = scene, json.dumps(beside)
        if key not in known:
            out = tmp_path_factory.mktemp("without") / "out"
            known[key] = Outcome(program, scene, out, *(setting(*each) for each in beside.items()))
        return known[key]

    return outcome


def options_of(effect, value):
    return [*(setting(*each) for each in effect.beside.items()), setting(effect.pointer, value)]


# By the scene's fixture and the effect's name.
CASES = [("scene", name) for name in EFFECTS if name != "gravity"] + [("mesh", name) for name in MESH_EFFECTS]


def effect_of(case):
    return (MESH_EFFECTS if case[0] == "mesh" else EFFECTS)[case[1]]


@pytest.mark.parametrize("case", CASES, ids="-".join)
def test_what_is_absent_is_nowhere_and_what_is_there_shows(program, request, without, tmp_path, case):
    effect, scene = effect_of(case), request.getfixturevalue(case[0])
    absent = without(scene, effect.beside)
    there = Outcome(program, scene, tmp_path / "there", *options_of(effect, effect.there))
    assert np.abs(there.positions[-1] - absent.positions[-1]).max() > 1e-4 * LENGTH
    assert absent.stages == set(absent.plan) and there.stages == set(there.plan)
    assert there.stages == absent.stages | effect.stages and there.absent == absent.absent - effect.stages
    assert there.set_up == absent.set_up | effect.set_up
    others = set(absent.plan) - {"strands", "roots", "wind"}  # which may carry it
    assert {stage: absent.plan[stage] for stage in others} == {stage: there.plan[stage] for stage in others}


def test_a_scene_of_gravity_alone_runs_strands_alone(scene, without):
    plain = without(scene, {})
    assert plain.stages == {"roots", "strands"}
    assert plain.set_up == {"scene", "simulation", "world", "groom", "mesh"}
    assert plain.plan["roots"]["launches"] == 0 and plain.plan["strands"]["launches"] == (LAST - 1) * 4
    assert plain.absent == {"tries", "wind", "grid", "contacts", "solids", "grooming", "interpolation"}


def test_a_hair_mesh_of_gravity_alone_runs_the_mesh_alone(mesh, without):
    plain = without(mesh, {})
    assert plain.stages == {"roots", "forces", "solve", "strands"}
    assert plain.set_up == {"scene", "simulation", "world", "groom", "mesh"}
    assert plain.absent == {"tries", "wind", "solids", "minimisation"}


@pytest.mark.parametrize("of", ["scene", "mesh"])
def test_no_gravity_is_a_gravity_of_zero(program, request, tmp_path, of):
    scene = request.getfixturevalue(of)
    none = steps(program, scene, tmp_path / "none", "--set=/effects/gravity=null")
    assert steps(program, scene, tmp_path / "zero", "--set=/effects/gravity=[0,0,0]") == none
    assert steps(program, scene, tmp_path / "some") != none


@pytest.mark.parametrize("case", CASES, ids="-".join)
def test_no_strength_changes_nothing_and_the_plan_tells_what_it_costs(program, request, without, tmp_path, case):
    effect, scene = effect_of(case), request.getfixturevalue(case[0])
    absent = without(scene, effect.beside)
    zero = Outcome(program, scene, tmp_path / "zero", *options_of(effect, effect.zero))
    change = np.abs(zero.positions - absent.positions).max() / LENGTH
    assert change <= effect.bound, change
    assert zero.stages == set(zero.plan)
    if case[1] == "wind":  # that never blows: it is not there
        assert zero.plan == absent.plan and zero.bytes == absent.bytes
    else:
        assert effect.stages <= zero.stages
        cost = "launches" if case[0] == "mesh" else "bytes"
        assert all(zero.plan[stage][cost] > 0 for stage in effect.stages)


def test_minimisation_that_is_off_is_nowhere_and_one_of_nothing_changes_nothing(program, mesh, tmp_path):
    def outcome(name, solid, on):
        options = setting("/effects/solids", [solid]), setting("/model/hair_mesh/deformation_minimisation", on)
        return Outcome(program, mesh, tmp_path / name, *options)

    there, absent = outcome("there", NEAR, True), outcome("absent", NEAR, False)
    assert np.abs(there.positions[-1] - absent.positions[-1]).max() > 1e-4 * LENGTH
    assert there.stages == absent.stages | {"minimisation"} == set(there.plan) and absent.stages == set(absent.plan)
    assert absent.absent == there.absent | {"minimisation"}
    assert all(there.plan[stage] == absent.plan[stage] for stage in absent.plan)
    zero, without = outcome("zero", FAR, True), outcome("without", FAR, False)
    assert zero.bytes == without.bytes and zero.plan["minimisation"]["launches"] > 0


def test_openvdb_is_called_only_where_there_are_solids(program, scene, mesh, tmp_path):
    """By the dynamic linker's own account: the program's first call of a function of another library is bound then."""
    linked = subprocess.run(["readelf", "-d", program], capture_output=True, text=True, check=True).stdout
    if re.search(r"BIND_NOW|FLAGS_1.*\bNOW\b", linked):
        pytest.skip("linked so that everything is bound at the start")

    def bound(scene, *options):
        environment = {**os.environ, "LD_DEBUG": "bindings"}
        result = run(program, "run", scene, "-o", tmp_path / "out", "--overwrite", "-q", *options, env=environment)
        assert result.returncode == 0
        calls = re.findall(r"binding file \S*ringlet \[0\] to \S*libopenvdb\S* \[0\]: normal symbol `(\S+)'", result.stderr)
        return any("openvdb" in name and "initialize" in name for name in calls)

    solids = setting("/effects/solids", [NEAR])
    assert not bound(scene) and not bound(scene, setting("/effects/wind", WIND))
    assert not bound(mesh) and not bound(mesh, setting("/model/hair_mesh/ellipsoids", MESH_EFFECTS["ellipsoids"].there))
    assert bound(scene, solids) and bound(mesh, solids)


# ---- What it costs

ALLOWED = 0.02  # of the instructions of the strands' kernel


def instructions(program, scene, directory, frames):
    """Of a run that writes its last frame alone: all, and those of the kernel that steps the strands."""
    out = directory / f"callgrind.{frames}"
    result = run(
        "valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", program, "run", scene, "-o", directory / str(frames),
        "--instruction-set=avx2", "--threads=1", "--progress=none", "-q", f"--set=/frames/last={frames}",
        f"--frames={frames}-{frames}", setting("/cache/compression", "none"),
    )
    if result.returncode == 2 and "no instruction set `avx2`" in result.stderr:
        pytest.skip("this processor has no AVX2")
    assert result.returncode == 0, result.stderr
    told = run("callgrind_annotate", "--inclusive=yes", "--threshold=100", out).stdout
    kernel = re.search(r"^ *([\d,]+) .*void ringlet::kernels::avx2::\S*(?: \S+)*strand_step<", told, re.MULTILINE)
    total = re.search(r"^ *([\d,]+) .*PROGRAM TOTALS", told, re.MULTILINE)
    return [int(match[1].replace(",", "")) for match in (total, kernel)]


def test_a_scene_of_gravity_alone_costs_what_the_bare_solver_costs(program, tmp_path, monkeypatch):
    """Instructions of a frame, from runs of two lengths: setting up and writing are the same in both."""
    if not shutil.which("valgrind"):
        pytest.skip("valgrind is not installed")
    monkeypatch.setattr("tiny.PARTICLES", 30)

    def change(scene):
        del scene["head"]
        scene["groom"]["attach"] = "fixed"
        scene["effects"] = {"gravity": [0, -9.81, 0]}
        scene["model"] = {"preload": False}

    scene = write_scene(tmp_path, change, data_bytes(strands(256)))
    (all_short, kernel_short), (all_long, kernel_long) = (instructions(program, scene, tmp_path, n) for n in (2, 5))
    program_cost, kernel_cost = all_long - all_short, kernel_long - kernel_short
    assert kernel_cost > 1e7
    assert kernel_cost < program_cost <= (1 + ALLOWED) * kernel_cost, program_cost / kernel_cost
