"""Wind and non-Hookean integrity through the program: what is absent costs nothing, what is there resumes."""
import json
import subprocess

import h5py
import numpy as np
import pytest

from tiny import LAST, frame_bytes, write_scene

WIND = {"velocity": [4, 0, 1], "gusts": {}, "turbulence": {"strength": 0.5}, "shelter": {}}
SOFT = {"curve": [[0.02, 0.02], [0.1, 0.05]]}


def run(program, scene, out, *options):
    return subprocess.run([program, "run", scene, "-o", out, "--progress", "none", *options], capture_output=True, text=True)


def setting(pointer, value):
    return ["--set", f"{pointer}={json.dumps(value)}"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return write_scene(tmp_path_factory.mktemp("effects"))


@pytest.fixture(scope="module")
def plain(program, scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("plain") / "out"
    assert run(program, scene, out).returncode == 0
    return out


def plan(program, scene, *options):
    result = subprocess.run([program, "plan", scene, "--json", *options], capture_output=True, text=True, check=True)
    return {stage["name"]: stage for stage in json.loads(result.stdout)["stages"]}


@pytest.mark.parametrize("wind", [{"velocity": [0, 0, 0]}, {"velocity": [0, 0, 0], "turbulence": {}, "shelter": {}}])
def test_a_wind_of_zero_is_no_wind_bit_for_bit(program, scene, plain, tmp_path, wind):
    still = setting("/effects/wind", wind)
    assert plan(program, scene, *still) == plan(program, scene)
    assert "wind" not in plan(program, scene)
    assert run(program, scene, tmp_path / "out", *still).returncode == 0
    assert frame_bytes(tmp_path / "out") == frame_bytes(plain)


def test_wind_is_a_stage_with_memory_and_launches(program, scene):
    stage = plan(program, scene, *setting("/effects/wind", WIND))["wind"]
    assert stage["bytes"] > 0 and stage["launches"] == (LAST - 1) * (4 + 1)  # substeps, and shelter once a frame


def test_wind_blows_hair_along(program, scene, plain, tmp_path):
    assert run(program, scene, tmp_path / "out", *setting("/effects/wind", WIND)).returncode == 0
    with h5py.File(tmp_path / "out/tiny.h5") as windy, h5py.File(plain / "tiny.h5") as still:
        moved = windy["position"][-1] - still["position"][-1]
    assert np.median(moved[:, 0]) > 0.01


def test_softening_far_away_changes_no_byte(program, scene, plain, tmp_path):
    far = {"curve": [[50, 50], [60, 55]]}
    assert run(program, scene, tmp_path / "out", *setting("/effects/non_hookean", far)).returncode == 0
    assert frame_bytes(tmp_path / "out") == frame_bytes(plain)


def test_elongation_is_in_the_cache_and_never_heals(program, scene, tmp_path):
    options = setting("/effects/non_hookean", SOFT) + setting("/cache/fields", ["position", "elongation"])
    assert run(program, scene, tmp_path / "out", *options, *setting("/effects/wind", WIND)).returncode == 0
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        elongation = cache["elongation"][:]
        assert elongation.shape == cache["position"].shape[:2]
    assert (elongation[0] == 0).all() and (np.diff(elongation, axis=0) >= 0).all() and elongation[-1].max() > 0.1


@pytest.mark.parametrize("options", [["--threads", "1"], ["--instruction-set", "avx2"]])
def test_a_resumed_run_of_all_effects_has_the_same_bytes(program, scene, tmp_path, options):
    effects = setting("/effects/non_hookean", SOFT) + setting("/effects/wind", WIND)
    effects += setting("/cache/fields", ["position", "elongation"])
    assert run(program, scene, tmp_path / "whole", *effects).returncode == 0
    part = setting("/frames/last", LAST - 2)
    result = run(program, scene, tmp_path / "cut", *effects, *part, *options)
    if result.returncode == 2 and "no instruction set" in result.stderr:
        pytest.skip("this processor has no AVX2")
    assert result.returncode == 0
    assert run(program, scene, tmp_path / "cut", *effects, "--resume").returncode == 0
    assert frame_bytes(tmp_path / "cut") == frame_bytes(tmp_path / "whole")
