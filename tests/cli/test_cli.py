"""The program as users and farm scripts see it: options, exit codes, progress, what a stopped run leaves."""
import json
import os
import pathlib
import re
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest

import tiny
from conftest import run
from tiny import LAST, PARTICLES, STRANDS, frame_bytes


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return tiny.write_scene(tmp_path_factory.mktemp("tiny"))


@pytest.fixture(scope="module")
def cache(program, scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("cache") / "tiny"
    result = run(program, "run", scene, "-o", out, "--backend", "cpu")
    assert result.returncode == 0, result.stderr
    return out


# ---- The command line ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["fly"],
        ["run"],
        ["run", "{scene}", "--sideways"],
        ["run", "{scene}", "--threads", "0"],
        ["run", "{scene}", "--backend", "abacus"],
        ["run", "{scene}", "--precision", "half"],
        ["run", "{scene}", "--progress", "song"],
        ["run", "{scene}", "--resume", "--overwrite"],
        ["run", "{scene}", "--frames", "3-2"],
        ["run", "{scene}", "--frames", "2-9"],
        ["run", "{scene}", "--frames", "0-2"],
        ["run", "{scene}", "--frames", "two"],
        ["run", "{scene}", "--frames", "2-"],
        ["run", "{scene}", "--set", "/frames/last"],
        ["run", "{scene}", "--set", "frames/last=3"],
        ["run", "{scene}", "--set", "/name=wedge"],
        ["run", "{scene}", "--set", "/frames/last/deeper=3"],
        ["run", "{scene}", "--precision", "double", "--backend", "cuda"],
        ["compare", "a"],
        ["groom"],
        ["groom", "convert", "{scene}", "-o", "groom.hair"],
        ["info"],
    ],
)
def test_usage_errors_end_with_2_and_write_nothing(program, scene, tmp_path, arguments):
    result = run(program, *(part.format(scene=scene) for part in arguments), cwd=tmp_path)
    assert result.returncode == 2, result.stderr
    assert re.fullmatch(r"error: [^\n]+: [^\n]+\n", result.stderr)
    assert result.stdout == "" and os.listdir(tmp_path) == []


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["run", "--help"], ["groom", "grow", "--help"]])
def test_what_is_asked_for_is_no_error(program, arguments):
    result = run(program, *arguments)
    assert (result.returncode, result.stderr) == (0, "") and result.stdout


def test_set_changes_the_scene(program, scene, tmp_path):
    changes = ["--set", "/frames/last=2", "--set", "/model/drag=2.5", "--set", "/effects/solids=null"]
    out = tmp_path / "out"
    assert run(program, "run", scene, "-o", out, *changes).returncode == 0
    assert len(frame_bytes(out)) == 2
    with h5py.File(out / "tiny.h5") as master:
        resolved = json.loads(master["scene"][()])
    assert resolved["model"]["drag"] == 2.5 and resolved["effects"]["solids"] == []


@pytest.mark.parametrize(
    "change, expected",
    [
        ("/model/substeps=0", "#/model/substeps: found 0, expected"),
        ("/model/substep=4", "did you mean substeps?"),
        ('/frames/fps="fast"', '#/frames/fps: found "fast", expected'),
    ],
)
def test_a_set_that_the_schema_refuses_is_bad_input(program, scene, tmp_path, change, expected):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--set", change)
    assert result.returncode == 3
    assert expected in result.stderr and "given by --set" in result.stderr
    assert not (tmp_path / "out").exists()


def test_frames_writes_a_part_of_the_same_run(program, scene, cache, tmp_path):
    out = tmp_path / "out"
    assert run(program, "run", scene, "-o", out, "--frames", f"3-{LAST}", "--backend", "cpu").returncode == 0
    assert frame_bytes(out) == {name: frame_bytes(cache)[name] for name in ("tiny.0003.h5", "tiny.0004.h5")}


# ---- Progress --------------------------------------------------------------------------------------


def test_plain_progress_is_a_line_a_frame(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--progress", "plain")
    lines = result.stdout.splitlines()
    assert lines[-1] == f"wrote {tmp_path / 'out/tiny.h5'}"
    for frame, line in enumerate(lines[:-1], 2):
        percent = f"{100 * (frame - 1) / (LAST - 1):.1f}"
        assert re.fullmatch(rf"frame {frame}/{LAST} {percent}% \d+ ms/frame eta \d\d:\d\d:\d\d", line), line
    assert len(lines) == LAST


def test_json_progress_is_an_object_a_frame_and_none_is_silent(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "a", "--progress", "json")
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["frame"] for line in lines] == [2, 3, 4]
    assert all(line["seconds"] > 0 and set(line["stages"]) == {"roots", "strands", "solids"} for line in lines)
    assert run(program, "run", scene, "-o", tmp_path / "b", "--progress", "none").stdout == ""


# ---- Backends and machines -------------------------------------------------------------------------


def test_cuda_without_a_device_ends_with_6(program, scene, tmp_path):
    result = run(program, "run", scene, "-o", tmp_path / "out", "--backend", "cuda", env={"CUDA_VISIBLE_DEVICES": ""})
    assert result.returncode == 6
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: --backend cuda: ") and line.endswith("(use --backend cpu or auto)")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("solids, tolerance", [("null", 1e-6), ('[{"source": "head", "resolution": 32}]', 1e-4)])
def test_cuda_and_cpu_agree(program, scene, tmp_path, solids, tolerance):
    options = ["--set", f"/effects/solids={solids}"]
    result = run(program, "run", scene, "-o", tmp_path / "cuda", "--backend", "cuda", *options)
    if result.returncode == 6:
        pytest.skip(result.stderr.strip())
    assert result.returncode == 0, result.stderr
    assert run(program, "run", scene, "-o", tmp_path / "cpu", "--backend", "cpu", *options).returncode == 0
    result = run(program, "compare", tmp_path / "cuda", tmp_path / "cpu", "--tolerance", tolerance)
    assert result.returncode == 0, result.stdout


def test_auto_without_a_device_says_nothing_of_it(program, scene):
    result = run(program, "plan", scene, env={"CUDA_VISIBLE_DEVICES": ""})
    assert result.returncode == 0 and "steps on" not in result.stderr


def cpu_flags():
    info = pathlib.Path("/proc/cpuinfo")
    return set(re.search(r"^flags\s*:(.*)$", info.read_text(), re.M)[1].split()) if info.exists() else set()


@pytest.mark.parametrize("options", [["--threads", "1"], ["--threads", "2"], ["avx2", "fma"], ["avx512", "avx512f"]])
def test_frame_files_are_the_same_on_any_machine(program, scene, cache, tmp_path, options):
    if not options[0].startswith("--"):
        if options[1] not in cpu_flags():
            pytest.skip(f"this processor has no {options[0]}")
        options = ["--instruction-set", options[0]]
    out = tmp_path / "out"
    result = run(program, "run", scene, "-o", out, "--backend", "cpu", *options)
    assert result.returncode == 0, result.stderr
    assert frame_bytes(out) == frame_bytes(cache)


def test_an_instruction_set_the_processor_lacks_is_a_usage_error(program, scene, tmp_path):
    if "avx512f" in cpu_flags():
        pytest.skip("this processor has them all")
    result = run(program, "run", scene, "-o", tmp_path / "out", "--instruction-set", "avx512")
    assert result.returncode == 2 and "avx512" in result.stderr


def test_a_report_that_cannot_be_written_whole_ends_with_5(program, scene):
    full = pathlib.Path("/dev/full")
    if not full.exists():
        pytest.skip("no /dev/full here")
    with full.open("w") as nowhere:
        command = [program, "plan", scene, "--json"]
        result = subprocess.run(command, stdout=nowhere, stderr=subprocess.PIPE, text=True, check=False)
    assert result.returncode == 5 and "error: standard output: cannot be written" in result.stderr


# ---- plan and compare ------------------------------------------------------------------------------


def plan(program, scene, *options):
    return json.loads(run(program, "plan", scene, "--json", *options).stdout)


def test_an_absent_effect_has_no_stage_and_no_bytes(program, scene):
    whole, bare = plan(program, scene), plan(program, scene, "--set", "/effects/solids=null")
    assert [stage["name"] for stage in whole["stages"]] == ["roots", "strands", "solids"]
    assert [stage["name"] for stage in bare["stages"]] == ["roots", "strands"]
    assert whole["absent"] == ["tries", "wind", "grid", "contacts", "grooming", "interpolation"]
    assert bare["absent"] == ["tries", "wind", "grid", "contacts", "solids", "grooming", "interpolation"]
    assert all(stage["bytes"] > 0 and stage["launches"] == 4 * (LAST - 1) for stage in whole["stages"])
    assert bare["stages"] == whole["stages"][:2]
    assert (whole["strands"], whole["particles"]) == (STRANDS, STRANDS * PARTICLES)


def test_the_plan_names_sizes_in_the_unit_that_shows_them(program, scene):
    sizes = {stage["name"]: stage["bytes"] for stage in plan(program, scene)["stages"]}
    units = {"B": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}
    shown = re.findall(r"^ +(\w+) +([0-9.]+) (B|kB|MB|GB) +\d+ ", run(program, "plan", scene).stdout, re.MULTILINE)
    assert {name for name, _, _ in shown} == set(sizes)
    for name, value, unit in shown:
        assert float(value) * units[unit] == pytest.approx(sizes[name], rel=0.005) and 1 <= float(value) < 1000


def test_a_still_head_moves_no_roots(program, scene):
    roots = plan(program, scene, "--set", "/head/animation=null")["stages"][0]
    assert roots["name"] == "roots" and roots["launches"] == 0


def test_compare_tells_other_frames_and_other_strands(program, scene, cache, tmp_path):
    fewer_frames, fewer_strands = tmp_path / "frames", tmp_path / "strands"
    assert run(program, "run", scene, "-o", fewer_frames, "--frames", "1-3").returncode == 0
    directory = tmp_path / "scene"
    directory.mkdir()
    other = tiny.write_scene(directory, groom=tiny.data_bytes(tiny.strands(20)))
    assert run(program, "run", other, "-o", fewer_strands).returncode == 0
    assert run(program, "compare", cache, cache, "--exact").returncode == 0
    result = run(program, "compare", cache, fewer_frames)
    assert result.returncode == 1 and "frames only in A: 4" in result.stdout
    result = run(program, "compare", cache, fewer_strands)
    assert result.returncode == 1 and "other strands: " in result.stdout
    assert run(program, "compare", cache, tmp_path / "nothing").returncode == 3


# ---- Runs that end early ---------------------------------------------------------------------------


def diverge(program, scene, out, *options):
    options = ["--set", '/model/scheme="paper"', "--set", "/frames/last=30", *options]
    return run(program, "run", scene, "-o", out, *options, "--backend", "cpu")


@pytest.mark.parametrize("limit", ["/limits/speed=1", "/limits/edge_strain=1e-5"])
def test_divergence_ends_with_4_and_keeps_the_failing_state(program, scene, tmp_path, limit):
    out = tmp_path / "out"
    result = diverge(program, scene, out, "--set", limit, "--set", "/effects/inextensible=null")
    assert result.returncode == 4, result.stderr
    error = result.stderr.splitlines()[-1]
    frame, strand, particle = map(int, re.match(r"error: frame (\d+): .*strand (\d+), particle (\d+)", error).groups())
    assert frame > 1 and 0 <= strand < STRANDS and 0 <= particle < PARTICLES
    assert list(frame_bytes(out)) == [f"tiny.{number:04d}.h5" for number in range(1, frame)]
    with h5py.File(out / "tiny.h5") as master:
        assert list(master["frames"]) == list(range(1, frame))
        assert np.isfinite(master["position"][:]).all()
    report = json.loads(run(program, "info", out / "tiny.failed.h5", "--json").stdout)
    assert report["failure"]["frame"] == frame and report["failure"]["strand"] == strand
    assert report["failure"]["particle"] == PARTICLES * strand + particle


def test_a_diverged_run_is_refused_as_it_stands_and_overwritten(program, scene, tmp_path):
    out = tmp_path / "out"
    assert diverge(program, scene, out, "--set", "/limits/speed=1").returncode == 4
    assert run(program, "run", scene, "-o", out).returncode == 2
    assert run(program, "run", scene, "-o", out, "--overwrite").returncode == 0
    assert not (out / "tiny.failed.h5").exists()


@pytest.fixture(scope="module")
def long_run(program, scene, tmp_path_factory):
    """(options, frame files) of a run long enough to be cut."""
    out = tmp_path_factory.mktemp("long") / "out"
    options = ["--set", "/frames/last=300", "--backend", "cpu"]
    assert run(program, "run", scene, "-o", out, *options).returncode == 0
    return options, frame_bytes(out)


@pytest.mark.parametrize("cut, code", [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_run_cut_anywhere_resumes_to_the_same_bytes(program, scene, long_run, tmp_path, cut, code):
    options, whole = long_run
    out = tmp_path / "out"
    command = [program, "run", scene, "-o", out, *options]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as child:
        while child.poll() is None and not (out / "tiny.0010.h5").exists():
            time.sleep(0.001)
        child.send_signal(cut)
        said = child.stderr.read()
    assert child.returncode == code
    assert (f"stopped by signal {cut.value}; --resume continues" in said) == (cut != signal.SIGKILL)
    left = frame_bytes(out)
    assert 10 <= len(left) < len(whole)
    assert left.items() <= whole.items()
    result = run(*command, "--resume")
    assert result.returncode == 0, result.stderr
    assert frame_bytes(out) == whole


def test_resume_refuses_another_scene(program, scene, tmp_path):
    out = tmp_path / "out"
    assert run(program, "run", scene, "-o", out, "--frames", "1-2").returncode == 0
    result = run(program, "run", scene, "-o", out, "--resume", "--set", "/model/substeps=7")
    assert result.returncode == 2 and "the scene's /model/substeps was 4 and is 7" in result.stderr


def test_resume_refuses_an_instruction_set_that_rounds_otherwise(program, scene, tmp_path):
    out = tmp_path / "out"
    command = ["run", scene, "-o", out, "--backend", "cpu", "--instruction-set"]
    assert run(program, *command, "generic", "--frames", "1-2").returncode == 0
    result = run(program, *command, "generic", "--resume")
    assert result.returncode == 0, result.stderr
    best = run(program, "run", scene, "-o", out, "--backend", "cpu", "--resume")
    if "generic" in best.stderr and best.returncode == 0:
        pytest.skip("this processor has no fused multiply-add")
    assert best.returncode == 2 and "its instruction set was generic, now avx" in best.stderr, best.stderr


# ---- Quiet -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["before", "after"])
def test_quiet_says_nothing(program, scene, tmp_path, place):
    command = ["run", scene, "-o", tmp_path / "out"]
    result = run(program, *(["-q", *command] if place == "before" else [*command, "-q"]))
    assert result.returncode == 0 and result.stdout == "" and result.stderr == "", result
    asked = run(program, "-q", *command, "--overwrite", "--progress", "plain")
    assert f"frame {LAST}/{LAST}" in asked.stdout + asked.stderr


@pytest.mark.parametrize("arguments, word", [(["rum", "scene.json"], "rum"), (["groom", "gruw", "a.hair"], "gruw")])
def test_a_mistyped_subcommand_is_named(program, arguments, word):
    result = run(program, *arguments)
    assert result.returncode == 2 and f"`{word}` is no subcommand" in result.stderr


def test_what_is_no_file_is_not_called_missing(program):
    result = run(program, "info", "/dev/null")
    assert result.returncode == 3 and "no such file" not in result.stderr


# ---- Grooms ----------------------------------------------------------------------------------------


def test_a_grown_groom_is_a_file_that_a_scene_takes(program, tmp_path):
    grow = {"strands": 40, "particles": 6, "step": 0.01, "seed": 5, "scalp": {"direction": [0, 1, 0], "max_angle_degrees": 60}}
    growing = tiny.write_scene(tmp_path, lambda scene: scene.update(groom={"grow": grow}))
    result = run(program, "groom", "grow", growing, "-o", tmp_path / "grown.h5")
    assert result.returncode == 0 and "40 strands, 240 particles" in result.stdout, result.stderr
    directory = tmp_path / "next"
    directory.mkdir()
    taking = tiny.write_scene(directory, lambda scene: scene.update(groom={"file": "../grown.h5", "attach": "stored"}))
    for scene, out in ((growing, tmp_path / "a"), (taking, tmp_path / "b")):
        result = run(program, "run", scene, "-o", out, "--backend", "cpu")
        assert result.returncode == 0, result.stderr
    with h5py.File(tmp_path / "a/tiny.h5") as a, h5py.File(tmp_path / "b/tiny.h5") as b:
        assert a["position"].shape == (LAST, 240, 3)
        assert np.allclose(a["position"][:], b["position"][:], rtol=0, atol=1e-6)


def test_a_converted_groom_holds_the_same_points(program, scene, tmp_path):
    converted = tmp_path / "groom.h5"
    result = run(program, "groom", "convert", scene.parent / "groom.data", "--unit", "cm", "-o", converted)
    assert result.returncode == 0, result.stderr
    with h5py.File(converted) as groom:
        assert np.allclose(groom["points"][:], 0.01 * tiny.strands().reshape(-1, 3), rtol=1e-12)
        assert list(np.diff(groom["offsets"])) == [PARTICLES] * STRANDS
    report = json.loads(run(program, "info", converted, "--json").stdout)
    assert (report["strands"], report["particles"]) == (STRANDS, STRANDS * PARTICLES)


def test_lengths_finer_than_single_precision_tells_them_are_warned_of_and_held_as_it_can(program, scene, tmp_path):
    fine = ["--set", "/effects/inextensible/tolerance=1e-7"]
    single = run(program, "run", scene, "-o", tmp_path / "single", "--precision", "float", *fine)
    assert single.returncode == 0 and single.stderr.count("held to 6.4e-07 (--precision double") == 1, single.stderr
    double = run(program, "run", scene, "-o", tmp_path / "double", "--precision", "double", *fine)
    assert double.returncode == 0 and "--precision double" not in double.stderr
