"""Wind and non-Hookean integrity through the program: what is absent costs nothing, what is there resumes."""
import json
import subprocess

import h5py
import numpy as np
import pytest

from scenes import run, setting
from small_cache import ball
from tiny import LAST, PARTICLES, RADIUS, STRANDS, data_bytes, frame_bytes, strands, write_scene

WIND = {"velocity": [4, 0, 1], "gusts": {}, "turbulence": {"strength": 0.5}, "shelter": {}}
SOFT = {"curve": [[0.02, 0.02], [0.1, 0.05]]}


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


@pytest.mark.parametrize("wind", [
    {"velocity": [0, 0, 0]}, {"velocity": [0, 0, 0], "turbulence": {}, "shelter": {}},
    {"velocity": [1, 0, 0], "keys": [{"frame": 1, "velocity": [-1, 0, 0]}], "gusts": {}},
])
def test_a_wind_of_zero_is_no_wind_bit_for_bit(program, scene, plain, tmp_path, wind):
    still = setting("/effects/wind", wind)
    assert plan(program, scene, *still) == plan(program, scene)
    assert "wind" not in plan(program, scene)
    assert run(program, scene, tmp_path / "out", *still).returncode == 0
    assert frame_bytes(tmp_path / "out") == frame_bytes(plain)


def test_the_plan_says_what_wind_takes(program, scene):
    rows = -(-STRANDS // 16) * PARTICLES  # of 16 strands
    air = rows * 16 * 3 * 4
    stage = plan(program, scene, *setting("/effects/wind", {"velocity": [4, 0, 1]}))["wind"]
    assert (stage["bytes"], stage["launches"]) == (air, (LAST - 1) * 4)
    stage = plan(program, scene, *setting("/effects/wind", WIND))["wind"]
    exposure, shelter_map = rows * 16 * 4, 2 * 193 * 193 * 4
    head = len(np.unique(ball()[0].round(9), axis=0)) * 3 * 8  # seams joined
    assert (stage["bytes"], stage["launches"]) == (air + exposure + shelter_map + head, (LAST - 1) * (4 + 1))


def test_the_plan_says_what_softening_takes(program, scene):
    plain, soft = plan(program, scene), plan(program, scene, *setting("/effects/non_hookean", {}))
    batches = -(-STRANDS // 16)
    more = batches * 16 * (PARTICLES + 1) * 4  # an elongation a particle, a length a strand
    assert soft["strands"]["bytes"] == plain["strands"]["bytes"] + more
    assert soft["strands"]["launches"] == plain["strands"]["launches"]
    assert {name for name in soft if soft[name] != plain[name]} == {"strands"}


@pytest.mark.parametrize("density, mass", [(5e-6, 1), (1e-5, 2)])
def test_limp_hair_hangs_along_its_weight_and_the_winds_drag(program, tmp_path, density, mass):
    def change(scene):
        del scene["head"], scene["effects"]["solids"]
        scene["groom"]["attach"] = "fixed"
        scene["frames"]["last"] = 121
        scene["model"] = {
            "stiffness": {"bend": 0, "twist": 0, "integrity": 0, "angular": 0}, "preload": False, "particle_mass": mass,
        }
        law = {"linear": 2e-4, "quadratic": 0}  # alike in every direction
        scene["effects"]["wind"] = {
            "velocity": [1, 0, -0.5], "linear_density": density, "normal_drag": law, "tangential_drag": law,
        }

    file = write_scene(tmp_path, change, data_bytes(strands(20)))
    assert run(program, file, tmp_path / "out").returncode == 0
    pull = np.array([0, -9.81, 0]) + 2e-4 / (density * mass) * np.array([1, 0, -0.5])
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        segments = np.diff(cache["position"][-1].reshape(20, PARTICLES, 3), axis=1)
    along = segments / np.linalg.norm(segments, axis=-1, keepdims=True)
    assert np.abs(along - pull / np.linalg.norm(pull)).max() < 2e-3


def test_the_head_shelters_what_is_behind_it(program, tmp_path):
    def change(scene):
        scene["head"].pop("animation")
        scene["effects"].pop("solids")
        scene["frames"]["last"] = 2  # before the hair is blown against the head

    file = write_scene(tmp_path, change)
    wind = {"velocity": [1, 0, 0]}
    effects = {
        "none": {"velocity": [0, 0, 0]}, "open": wind, "half": {**wind, "shelter": {"strength": 0.5}},
        "full": {**wind, "shelter": {"strength": 1, "wake": 1000}},
    }
    last = {}
    for name, effect in effects.items():
        assert run(program, file, tmp_path / name, *setting("/effects/wind", effect)).returncode == 0
        with h5py.File(tmp_path / name / "tiny.h5") as cache:
            last[name] = cache["position"][-1].reshape(STRANDS, PARTICLES, 3)
    rest = strands()
    across = np.hypot(rest[..., 1], rest[..., 2]).max(axis=1)
    before = rest[..., 0].max(axis=1) < -0.7 * RADIUS
    behind = (rest[:, :, 0].min(axis=1) > 0.6 * RADIUS) & (across < 0.8 * RADIUS)
    assert before.sum() > 5 and behind.sum() > 5
    moved = {name: np.linalg.norm(last[name] - last["none"], axis=-1)[:, -1] for name in last}
    for name in ["half", "full"]:
        assert (last[name][before] == last["open"][before]).all(), "all of it before the head"
    assert (moved["half"][behind] < 0.9 * moved["open"][behind]).all()
    assert (moved["half"][behind] > 0.1 * moved["open"][behind]).all()
    assert (moved["full"][behind] < 0.02 * moved["open"][behind]).all()


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


# Where the wind pauses and starts again within the frame that the cut comes before.
PAUSE = {
    "keys": [{"frame": LAST - 3, "velocity": [4, 0, 0]}, {"frame": LAST - 2, "velocity": [0, 0, 0]},
             {"frame": LAST - 1.6, "velocity": [0, 0, 0]}, {"frame": LAST, "velocity": [-9, 0, 0]}],
    "shelter": {},
}


@pytest.mark.parametrize("options", [["--threads", "1"], ["--instruction-set", "avx2"]])
@pytest.mark.parametrize("wind", [WIND, PAUSE])
def test_a_resumed_run_of_all_effects_has_the_same_bytes(program, scene, tmp_path, wind, options):
    effects = setting("/effects/non_hookean", SOFT) + setting("/effects/wind", wind)
    effects += setting("/cache/fields", ["position", "elongation"])
    assert run(program, scene, tmp_path / "whole", *effects).returncode == 0
    result = run(program, scene, tmp_path / "cut", *effects, *setting("/frames/last", LAST - 2), *options)
    if result.returncode == 2 and "no instruction set" in result.stderr:
        pytest.skip("this processor has no AVX2")
    assert result.returncode == 0
    assert run(program, scene, tmp_path / "cut", *effects, "--resume").returncode == 0
    assert frame_bytes(tmp_path / "cut") == frame_bytes(tmp_path / "whole")
