"""Hair against hair through the program: off is absent, what is there costs what the plan says, and neither threads, nor
instruction sets, nor a run that was cut show in the bytes."""
import json
import subprocess

import h5py
import numpy as np
import pytest

from scenes import run, setting
from tiny import LAST, LENGTH, PARTICLES, RADIUS, STRANDS, data_bytes, frame_bytes, strands, write_scene

GRID = {"grid": {"resolution": 24}}  # a few strands to a cell
BOTH = {**GRID, "contacts": {"radius": 0.001}}
GRID_FIGURES = {"grid_solves", "grid_iterations", "grid_residual", "grid_density", "grid_cells"}
CONTACT_FIGURES = {"contact_pairs", "contacts", "contact_depth", "crossings"}


def hair_hair(value):
    return setting("/effects/hair_hair", value)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """Dense enough that hair presses on hair: the tiny scene's head turns faster than its hair."""
    return write_scene(tmp_path_factory.mktemp("hair_hair"))


def finish(program, scene, out, *options):
    result = run(program, scene, out, "--backend", "cpu", *options)
    assert result.returncode == 0, result.stderr
    return out


@pytest.fixture(scope="module")
def whole(program, scene, tmp_path_factory):
    """Of grid and contacts, in one go."""
    return finish(program, scene, tmp_path_factory.mktemp("whole") / "out", *hair_hair(BOTH))


def plan(program, scene, *options):
    command = [program, "plan", scene, "--json", "--backend", "cpu", *options]
    told = json.loads(subprocess.run([str(w) for w in command], capture_output=True, text=True, check=True).stdout)
    return {stage["name"]: stage for stage in told["stages"]}, told["absent"]


def figures(out, name="tiny"):
    with h5py.File(out / f"{name}.h5") as cache:
        return {figure: values[:] for figure, values in cache["figures"].items()}


def positions(out, frame=-1):
    with h5py.File(out / "tiny.h5") as cache:
        return cache["position"][frame].astype(float)


def stages_timed(program, scene, out, *options):
    result = subprocess.run(
        [str(w) for w in [program, "run", scene, "-o", out, "--progress", "json", *options]],
        capture_output=True, text=True, check=True,
    )
    return [list(json.loads(line)["stages"]) for line in result.stdout.splitlines() if '"stages"' in line]


# ---- Off is absent ---------------------------------------------------------------------------------


def test_what_is_not_asked_for_is_not_there(program, scene, tmp_path):
    plain, absent = plan(program, scene)
    assert not {"grid", "contacts"} & set(plain) and {"grid", "contacts"} <= set(absent)
    out = tmp_path / "out"
    stages = stages_timed(program, scene, out)
    assert stages and all(names == ["roots", "strands", "solids"] for names in stages)
    assert not (GRID_FIGURES | CONTACT_FIGURES) & set(figures(out))


@pytest.mark.parametrize("on", [("grid",), ("contacts",), ("grid", "contacts")])
def test_what_is_asked_for_is_all_that_comes(program, scene, tmp_path, on):
    options = hair_hair({name: BOTH[name] for name in on})
    plain, _ = plan(program, scene)
    planned, absent = plan(program, scene, *options)
    assert set(planned) - set(plain) == set(on)
    assert {"grid", "contacts"} - set(on) == {"grid", "contacts"} & set(absent)
    assert all(planned[name] == plain[name] for name in plain if name != "strands")
    out = tmp_path / "out"
    stages = stages_timed(program, scene, out, *options)
    assert stages and all(names == ["roots", "strands", *on, "solids"] for names in stages)
    told = {"grid": GRID_FIGURES, "contacts": CONTACT_FIGURES}
    expected = set().union(*(told[name] for name in on))
    assert (GRID_FIGURES | CONTACT_FIGURES) & set(figures(out)) == expected


def test_the_plan_tells_memory_and_launches(program, scene):
    once, _ = plan(program, scene, *hair_hair(BOTH))
    often = {name: {**block, "cadence": "substep"} for name, block in BOTH.items()}
    each, _ = plan(program, scene, *hair_hair(often))
    assert once["grid"]["launches"] == LAST - 1 and each["grid"]["launches"] == 4 * once["grid"]["launches"]
    assert each["contacts"]["launches"] == 4 * once["contacts"]["launches"] > 0
    particles = STRANDS * PARTICLES
    assert once["grid"]["bytes"] > particles * 8 * 4, "places and velocities on the grid's axes, at the least"
    assert once["contacts"]["bytes"] > particles * 4, "a radius each, at the least"


def test_an_empty_grid_takes_no_more_where_it_is_fine(program, scene):
    coarse, fine = (plan(program, scene, *hair_hair({"grid": {"resolution": n}}))[0]["grid"]["bytes"] for n in (64, 512))
    assert fine < 4 * 512**3, "a dense grid would take 76 bytes a cell"
    # Eight times as fine: hair that lies apart takes 8 times the tiles, a sheet of it 64 times, a box 512 times.
    assert fine < 64 * coarse


# ---- Bytes -----------------------------------------------------------------------------------------


def test_hair_presses_in_this_scene(whole, program, scene, tmp_path):
    """What the bytes are compared of is no run of stages that had nothing to do."""
    told = figures(whole)
    assert told["grid_iterations"].max() > 0 and told["contacts"].max() > 0
    assert (told["grid_residual"] <= 1e-4).all()
    without = finish(program, scene, tmp_path / "out")
    assert np.abs(positions(whole) - positions(without)).max() > 1e-4


@pytest.mark.parametrize("options", [["--threads", "1"], ["--threads", "2"], ["--instruction-set", "avx2"]])
def test_threads_and_instruction_sets_change_no_byte(program, scene, whole, tmp_path, options):
    result = run(program, scene, tmp_path / "out", "--backend", "cpu", *hair_hair(BOTH), *options)
    if result.returncode == 2 and "no instruction set" in result.stderr:
        pytest.skip("this processor has no AVX2")
    assert result.returncode == 0, result.stderr
    assert frame_bytes(tmp_path / "out") == frame_bytes(whole)


TRIM = [{"frame": 2, "trim": {"length": 0.1}}, {"frame": 4, "lengthen": {"by": 0.03}}]
WIND = {"velocity": [4, 0, 1], "turbulence": {"strength": 0.5}}
SHELTERED = {**BOTH, "grid": {**GRID["grid"], "shelter": {}}}
EACH_SUBSTEP = {name: {**block, "cadence": "substep"} for name, block in BOTH.items()}


@pytest.mark.parametrize("frames", ["1-2", "1-4"])
@pytest.mark.parametrize(
    "effects",
    [
        hair_hair(BOTH),
        hair_hair(EACH_SUBSTEP),
        hair_hair(BOTH) + setting("/effects/grooming", TRIM),
        hair_hair(SHELTERED) + setting("/effects/wind", WIND),
        hair_hair(SHELTERED) + setting("/effects/wind", WIND) + setting("/effects/grooming", TRIM),
    ],
    ids=["both", "each_substep", "groomed", "sheltered", "sheltered_groomed"],
)
def test_a_cut_run_resumes_to_the_same_bytes(program, scene, tmp_path, effects, frames):
    options = [*effects, *setting("/frames/last", 6)]
    finish(program, scene, tmp_path / "whole", *options)
    finish(program, scene, tmp_path / "cut", *options, "--frames", frames, "--threads", "1")
    finish(program, scene, tmp_path / "cut", *options, "--resume")
    assert frame_bytes(tmp_path / "cut") == frame_bytes(tmp_path / "whole")


def test_a_checkpoint_with_touches_that_are_no_numbers_is_refused(program, scene, tmp_path):
    options = hair_hair(EACH_SUBSTEP)
    out = finish(program, scene, tmp_path / "out", *options, "--frames", "1-2")
    before = frame_bytes(out)
    with h5py.File(out / "tiny.state.h5", "r+") as state:
        touches = state["state/touches"]
        broken = np.frombuffer(touches[:].tobytes(), np.float32).copy()
        broken[0] = np.nan
        touches[:] = np.frombuffer(broken.tobytes(), touches.dtype).reshape(touches.shape)
    result = run(program, scene, out, "--backend", "cpu", *options, "--resume")
    assert result.returncode == 3 and "`touches`" in result.stderr and "--resume" in result.stderr, result.stderr
    assert frame_bytes(out) == before


def test_order_of_strands_changes_no_byte(program, scene, whole, tmp_path):
    order = np.random.default_rng(7).permutation(STRANDS)
    permuted = write_scene(tmp_path, groom=data_bytes(strands()[order]))
    out = finish(program, permuted, tmp_path / "out", *hair_hair(GRID))
    straight = finish(program, scene, tmp_path / "straight", *hair_hair(GRID))
    by_strand = [positions(cache).reshape(STRANDS, PARTICLES, 3) for cache in (straight, out)]
    np.testing.assert_array_equal(by_strand[1], by_strand[0][order])


# ---- Motion ----------------------------------------------------------------------------------------


SIZE = 2 * (RADIUS + LENGTH)  # of the scene [m]


def test_a_scene_that_moves_with_all_that_is_in_it_moves_as_the_still_one(program, tmp_path):
    """Head, hair and grid from rest to 1 m/s: a head that falls as freely as its hair, through what the substeps make of
    a constant acceleration, beside one that stays. Hair sags on both heads alike, and presses."""
    substeps, last = 4, 9
    step, fall = 1 / (24 * substeps), np.array([1.0, 1.5, -2.0])  # [s], [m/s^2]

    def change(scene):
        scene["frames"]["last"] = last
        scene["model"] = {"substeps": substeps, "drag": 0, "preload": False}
        scene["effects"]["hair_hair"] = BOTH
        del scene["head"]["animation"]

    scene = write_scene(tmp_path, change)
    keys = [
        {"frame": 1 + n / substeps, "translate": list(fall * step**2 * n * (n + 1) / 2)}
        for n in range((last - 1) * substeps + 1)
    ]
    falling = setting("/head/animation", {"keys": keys, "interpolation": "linear"})
    falling += setting("/effects/gravity", list(fall + [0, -9.81, 0]))
    still = finish(program, scene, tmp_path / "still", "--precision", "double")
    moved = finish(program, scene, tmp_path / "moved", "--precision", "double", *falling)
    told = figures(still)
    assert told["grid_iterations"].max() > 0 and told["contacts"].max() > 0
    assert np.abs(positions(still, last - 1) - positions(still, 0)).max() > 0.1 * LENGTH
    for frame in range(last):
        shift = np.array(keys[frame * substeps]["translate"])
        assert np.abs(positions(moved, frame) - shift - positions(still, frame)).max() < 1e-4 * SIZE, frame + 1


def test_hair_shelters_hair_from_the_wind(program, scene, tmp_path):
    def blown(name, grid):
        options = hair_hair({"grid": {**GRID["grid"], **grid}}) + setting("/effects/wind", {"velocity": [4, 0, 1]})
        return finish(program, scene, tmp_path / name, *options)

    still = positions(finish(program, scene, tmp_path / "still", *hair_hair(GRID)))
    unsheltered = blown("none", {})
    assert frame_bytes(blown("zero", {"shelter": {"strength": 0}})) == frame_bytes(unsheltered)
    moved, parted = [np.abs(positions(unsheltered) - still).mean()], [0]
    for strength in (1, 10, 100, 1000):
        sheltered = positions(blown(str(strength), {"shelter": {"strength": strength}}))
        moved.append(np.abs(sheltered - still).mean()), parted.append(np.abs(sheltered - positions(unsheltered)).mean())
    assert parted == sorted(set(parted)), parted
    # At 1 the wind is 4 % weaker, and how far hair swings out in it no more than 0.03 % different, either way.
    assert moved[1] == pytest.approx(moved[0], rel=1e-3), moved
    assert moved[1:] == sorted(moved[1:], reverse=True) and moved[-1] < 0.7 * moved[0], moved


def densest(points, cell):
    """Hair in a cell [cells' edges], the most there is: of [strands, particles, 3], each segment in eight pieces, shared
    out among the eight cells about a piece. Cells as the grid has them: the roots' mean is a corner."""
    a, b = points[:, :-1], points[:, 1:]
    middle = points[:, 0].mean(axis=0) + cell / 2
    along = (np.arange(8) + 0.5)[:, None, None, None] / 8
    places = ((1 - along) * a + along * b - middle).reshape(-1, 3) / cell
    hair = np.broadcast_to(np.linalg.norm(b - a, axis=-1) / (8 * cell), (8, *a.shape[:2])).ravel()
    low = np.floor(places).astype(int)
    density = np.zeros(low.max(axis=0) - low.min(axis=0) + 2)
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(1 - np.abs(places - low - corner), axis=1)
        np.add.at(density, tuple((low - low.min(axis=0) + corner).T), weight * hair)
    return density.max()


def test_a_squeezed_bundle_keeps_its_volume(program, source, tmp_path):
    """A hand closes on it within a second, to the room of its rest volume, and holds it. By the program's figures, and by
    the cache's positions."""
    scene = source / "scenes/hair_hair/squeezed_bundle.json"
    coarse = hair_hair({"grid": {"resolution": 64, "cadence": "substep"}}) + setting("/frames/last", 49)
    most = {}
    for name, options in {"on": coarse, "off": coarse + hair_hair(None)}.items():
        out = finish(program, scene, tmp_path / name, *options)
        with h5py.File(out / "squeezed_bundle.h5") as cache:
            points = cache["position"][:].reshape(49, 1200, 24, 3)
        cell = np.ptp(points[0], axis=(0, 1)).max() / 64
        most[name] = max(densest(points[frame], cell) for frame in range(40, 49, 2)) / densest(points[0], cell)
    assert most["off"] > 1.6, "what hair does that nothing holds apart"
    assert most["on"] <= 1.5
    assert figures(tmp_path / "on", "squeezed_bundle")["grid_density"][-10:].max() <= 1.5
