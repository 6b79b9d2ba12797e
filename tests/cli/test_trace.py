"""run --trace: what ran, where and how long, in Chrome's trace event format."""
import json
import signal
import subprocess
import time

import pytest

from conftest import run
from tiny import LAST, figures, steps, write_scene
from tiny_mesh import write_mesh_scene

EVERYTHING = {
    "wind": {"velocity": [4, 0, 1], "gusts": {}, "turbulence": {"strength": 0.5}, "shelter": {}},
    "hair_hair": {"grid": {"resolution": 32}, "contacts": {"radius": 5e-4}},
    "non_hookean": {},
    "grooming": [{"frame": 2, "trim": {"length": 0.1}}],
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return write_scene(tmp_path_factory.mktemp("trace"))


def effects(names):
    return [f"--set=/effects/{name}={json.dumps(EVERYTHING[name])}" for name in names]


def traced(program, scene, tmp_path, *options):
    """The events of a run, which must be JSON, and those of each name."""
    steps(program, scene, tmp_path / "out", "--overwrite", "-q", "--trace", tmp_path / "trace.json", *options)
    return events_of(tmp_path / "trace.json")


def events_of(file):
    named = {}
    for event in json.loads(file.read_text())["traceEvents"]:
        named.setdefault(event["name"], []).append(event)
    return named


def plan(program, scene, *options):
    result = run(program, "plan", scene, "--json", *options)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def expect_planned(named, planned):
    """Every stage of the plan ran and no other, with as many launches as it told."""
    ran = {event["name"] for events in named.values() for event in events if event.get("cat") == "stage"}
    assert ran == {stage["name"] for stage in planned["stages"]}
    for stage in planned["stages"]:
        launches = sum(event["args"].get("launches", 0) for event in named[stage["name"]])
        assert stage["least_launches"] <= launches <= stage["launches"], stage
        assert all(event["args"]["bytes"] == stage["bytes"] for event in named[stage["name"]] if "bytes" in event["args"])


@pytest.mark.parametrize("names", [[], ["wind"], ["non_hookean"], ["hair_hair"], ["grooming"], list(EVERYTHING)])
def test_what_the_trace_shows_is_what_the_plan_told(program, scene, tmp_path, names):
    named = traced(program, scene, tmp_path, *effects(names))
    planned = plan(program, scene, *effects(names))
    expect_planned(named, planned)
    for stage in planned["stages"]:
        if stage["name"] in ("roots", "strands", "solids"):
            assert stage["least_launches"] == stage["launches"] == (LAST - 1) * 4
    assert len(named["frame"]) == LAST - 1 and len(named["substep"]) == (LAST - 1) * 4
    assert len(named["write"]) == LAST  # on a thread of its own
    assert {e["tid"] for e in named["write"]}.isdisjoint({e["tid"] for e in named["frame"]})
    assert {"stepping", "writing"} <= {e["args"]["name"] for e in named["thread_name"]}


def test_events_lie_within_what_they_are_part_of(program, scene, tmp_path):
    named = traced(program, scene, tmp_path, *effects(["wind"]))

    def within(inner, outer):
        slack = 0.002  # of the microseconds' last digit
        return outer["ts"] - slack <= inner["ts"] and inner["ts"] + inner["dur"] <= outer["ts"] + outer["dur"] + slack

    for name, parts in (("frame", ("substep",)), ("substep", ("roots", "wind", "strands", "solids")), ("world", ("groom", "mesh"))):
        for part in parts:
            for event in named[part]:
                assert sum(within(event, outer) for outer in named[name]) == 1, event


def test_guides_and_hair_meshes_show_too(program, tmp_path):
    guides = write_scene(tmp_path, lambda scene: scene["groom"].update(interpolate={"count": 20}))
    expect_planned(traced(program, guides, tmp_path), plan(program, guides))
    mesh = write_mesh_scene(tmp_path, lambda scene: scene["effects"].update(wind=dict(velocity=[1, 0, 0])))
    expect_planned(traced(program, mesh, tmp_path), plan(program, mesh))


ELLIPSOID = [{"centre": [9, 0, 0], "radii": [0.1, 0.1, 0.1]}]


# By options: launches of a frame's three substeps in solids, of a frame in minimisation, of a stored frame in strands.
@pytest.mark.parametrize("options, solids, minimisation, placed", [
    ([], 3, 1, 1),
    ([f"--set=/model/hair_mesh/ellipsoids={json.dumps(ELLIPSOID)}"], 6, 1, 1),
    (["--set=/model/hair_mesh/deformation_minimisation=false", '--set=/cache/fields=["position","velocity"]'], 3, None, 2),
    (["--set=/effects/solids=null", "--set=/frames/preroll=2"], None, None, 1),
])
def test_a_hair_meshs_launches_are_shown_and_those_of_the_plan(program, tmp_path, options, solids, minimisation, placed):
    mesh = write_mesh_scene(tmp_path, lambda scene: scene["effects"].update(wind=dict(velocity=[1, 0, 0])))
    options = ["--set=/model/substeps=3", *options]
    planned = plan(program, mesh, *options)
    expect_planned(traced(program, mesh, tmp_path, *options), planned)
    frames = planned["frames"]
    expected = {name: 3 * frames for name in ("roots", "wind", "forces", "solve")} | {"strands": placed * LAST}
    expected |= {"solids": solids * frames} if solids else {}
    expected |= {"minimisation": minimisation * frames} if minimisation else {}
    assert {stage["name"]: stage["launches"] for stage in planned["stages"]} == expected
    assert all(stage["least_launches"] == stage["launches"] for stage in planned["stages"])


def test_a_hair_meshs_tries_are_within_the_plan(program, tmp_path):
    mesh = write_mesh_scene(tmp_path)
    options = ['--set=/model/substeps={"tolerance": 1e-3, "max": 8}']
    named = traced(program, mesh, tmp_path, *options)
    expect_planned(named, plan(program, mesh, *options))
    tried = figures(tmp_path / "out", "substeps_tried").sum()
    assert sum(event["args"]["launches"] for event in named["solve"]) == tried
    assert sum(event["args"]["launches"] for event in named["minimisation"]) == len(named["try"])


def test_tries_of_a_frame_are_shown_and_within_the_plan(program, scene, tmp_path):
    options = ['--set=/model/substeps={"tolerance": 1e-3, "max": 16}']
    named = traced(program, scene, tmp_path, *options)
    expect_planned(named, plan(program, scene, *options))
    tried = sum(event["args"]["substeps"] for event in named["try"])
    assert tried == figures(tmp_path / "out", "substeps_tried").sum() == len(named["substep"])


def test_a_trace_changes_no_byte(program, scene, tmp_path):
    traced(program, scene, tmp_path)
    with_trace = {path.name: path.read_bytes() for path in (tmp_path / "out").glob("tiny.0*.h5")}
    assert steps(program, scene, tmp_path / "without", "-q") == with_trace


def test_a_run_that_diverges_leaves_a_whole_trace(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--trace", tmp_path / "t.json", "--set=/limits/speed=1e-6")
    assert result.returncode == 4
    named = events_of(tmp_path / "t.json")
    assert len(named["frame"]) == 1 and len(named["strands"]) >= 1


@pytest.mark.parametrize("end, code", [(signal.SIGTERM, 128 + signal.SIGTERM), (signal.SIGKILL, -signal.SIGKILL)])
def test_a_run_that_is_stopped_leaves_a_whole_trace(program, scene, tmp_path, end, code):
    command = [program, "run", scene, "-o", tmp_path / "out", "-q", "--trace", tmp_path / "t.json", "--set=/frames/last=9999"]
    with subprocess.Popen([str(part) for part in command], stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while not (tmp_path / "out/tiny.0003.h5").exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(end)
        assert process.wait(60) == code
    assert len(events_of(tmp_path / "t.json")["frame"]) >= 2


def test_a_trace_that_cannot_be_written_is_told_before_anything_runs(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--trace", tmp_path / "no/t.json")
    assert result.returncode == 5 and "t.json: cannot be written" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_trace_replaces_nothing_but_a_trace(program, scene, tmp_path):
    """The scene, any other file; and of earlier traces only those of runs that come to step."""
    victim = tmp_path / "victim.json"
    victim.write_bytes(scene.read_bytes())
    for file in (scene, victim, scene.parent / "head.obj"):
        before = file.read_bytes()
        result = run(program, "run", scene, "-o", tmp_path / "out", "--trace", file)
        assert result.returncode == 2 and "is no trace" in result.stderr
        assert file.read_bytes() == before and not (tmp_path / "out").exists()

    traced(program, scene, tmp_path)
    earlier = (tmp_path / "trace.json").read_bytes()
    refused = [(["--set=/model/substeps=0"], 3), ([], 2), (["--resume", "--set=/model/substeps=3"], 2)]
    for options, code in refused:
        result = run(program, "run", scene, "-o", tmp_path / "out", "--trace", tmp_path / "trace.json", *options)
        assert result.returncode == code, result.stderr
        assert (tmp_path / "trace.json").read_bytes() == earlier
    result = run(program, "run", scene, "-o", tmp_path / "other", "--trace", tmp_path / "new.json", "--set=/model/substeps=0")
    assert result.returncode == 3 and not (tmp_path / "new.json").exists()
    traced(program, scene, tmp_path)
    assert (tmp_path / "trace.json").read_bytes() != earlier
