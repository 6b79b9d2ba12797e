"""effects.grooming through the program: cut, lengthened, combed and set hair, in the frame that the scene names."""
import json
import subprocess

import h5py
import numpy as np
import pytest

from scenes import run, setting
from tiny import LENGTH, PARTICLES, STRANDS, frame_bytes, write_scene

LAST = 8


def grooming(*operations):
    return setting("/effects/grooming", list(operations))


PLANE = {"trim": {"plane": {"point": [0, 0.12, 0], "normal": [0, -1, 0]}}}  # keeps what is below


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    directory = tmp_path_factory.mktemp("grooming")
    return write_scene(directory, lambda tiny: tiny["frames"].update(last=LAST))


@pytest.fixture(scope="module")
def plain(program, scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("plain") / "out"
    assert run(program, scene, out).returncode == 0
    with h5py.File(out / "tiny.h5") as cache:
        yield cache


class Groomed:
    """A run with operations: `strand(s, frame)` are its living particles."""

    def __init__(self, program, scene, out, *options):
        result = run(program, scene, out, *options)
        assert result.returncode == 0, result.stderr
        with h5py.File(out / "tiny.h5") as cache:
            self.position, self.living = cache["position"][:], cache["living"][:]
            self.offsets = cache["strands/offsets"][:]
            self.figures = {name: values[:] for name, values in cache["figures"].items()}

    def strand(self, number, frame):
        first = self.offsets[number]
        return self.position[frame - 1, first : first + self.living[frame - 1, number]]

    def strands(self, frame):
        return [self.strand(s, frame) for s in range(len(self.offsets) - 1)]

    def lengths(self, frame):
        return np.array([np.linalg.norm(np.diff(s, axis=0), axis=1).sum() for s in self.strands(frame)])


def test_a_trim_by_plane_cuts_in_its_frame_and_keeps_the_topology(program, scene, plain, tmp_path):
    run_ = Groomed(program, scene, tmp_path / "out", *grooming({"frame": 4, **PLANE}))
    np.testing.assert_array_equal(run_.offsets, plain["strands/offsets"][:])
    np.testing.assert_array_equal(run_.position[:3], plain["position"][:3])  # before, to the bit
    assert (run_.living[:3] == PARTICLES).all() and (run_.living[3:] == run_.living[3]).all()
    cut = 0
    for number, strand in enumerate(run_.strands(4)):
        whole = plain["position"][3, number * PARTICLES : (number + 1) * PARTICLES]
        if (whole[:, 1] < 0.12).all():  # nothing above: untouched, to the bit
            np.testing.assert_array_equal(strand, whole)
        elif whole[0, 1] > 0.12:
            assert len(strand) == 1
        else:
            cut += 1
            assert (strand[:, 1] < 0.12 + 1e-7).all() and strand[-1, 1] > 0.12 - 0.1 * LENGTH / (PARTICLES - 1) - 1e-7
        beyond = run_.position[3, run_.offsets[number] + len(strand) : run_.offsets[number + 1]]
        np.testing.assert_array_equal(beyond, np.broadcast_to(strand[-1], beyond.shape))
    assert cut > 30


SHAPES = {
    "box": ({"box": [[-0.5, 0.1, -0.5], [0.5, 0.5, 0.5]]}, lambda x: x[:, 1] - 0.1),
    "sphere": (
        {"sphere": {"centre": [0, 0, 0], "radius": 0.16}, "keep": "inside"},
        lambda x: np.linalg.norm(x, axis=1) - 0.16,
    ),
    "mesh": ({"mesh": "head.obj", "units": {"length": 1.7}, "keep": "inside"}, None),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_no_hair_is_left_where_a_shape_cuts(program, scene, tmp_path, shape):
    trim, beyond = SHAPES[shape]
    cut = Groomed(program, scene, tmp_path / "out", *grooming({"frame": 3, "trim": trim}))
    hair = [strand for strand in cut.strands(3) if len(strand) > 1]
    assert 30 < len(hair) and (cut.living[2] < PARTICLES).sum() > 30
    if beyond:
        assert max(beyond(strand[1:]).max() for strand in hair) < 1e-6
        return
    # The ball of radius 0.1 scaled by 1.7, a polyhedron: between its inscribed and circumscribed spheres.
    tips = np.array([np.linalg.norm(strand[-1]) for number, strand in enumerate(cut.strands(3)) if len(strand) < PARTICLES])
    assert (tips < 0.17 + 1e-6).all() and np.median(tips) > 0.16


def test_lengths_are_what_is_asked_for(program, scene, tmp_path):
    operations = [
        {"frame": 2, "trim": {"length": 0.08}},
        {"frame": 4, "lengthen": {"by": 0.05}},
        {"frame": 6, "lengthen": {"factor": 2, "mode": "scale"}},
        {"frame": 7, "lengthen": {"to": 0.3}},
    ]
    run_ = Groomed(program, scene, tmp_path / "out", *grooming(*operations))
    for frame, length in ((1, LENGTH), (2, 0.08), (3, 0.08), (4, 0.13), (5, 0.13), (6, 0.26), (7, 0.3), (8, 0.3)):
        spacing = 0.1 * LENGTH / (PARTICLES - 1) if frame in (2, 3) else 2e-4  # a stub that was dropped
        lengths = run_.lengths(frame)
        assert (lengths < length * (1 + 2e-4)).all(), frame
        assert np.median(lengths) > length * (1 - 2e-4) - spacing, frame
    assert (run_.living[3] > run_.living[2]).all() and (run_.living[5] == run_.living[4]).all()
    assert run_.living[-1].max() <= np.diff(run_.offsets).min()
    for frame in range(1, LAST + 1):
        assert np.isfinite(run_.position[frame - 1]).all()
    assert run_.figures["edge_strain_free"].max() <= 1e-3


WIND = {"keys": [{"frame": 1, "velocity": [6, 0, 0]}, {"frame": 20, "velocity": [6, 0, 0]}, {"frame": 21, "velocity": [0, 0, 0]}]}


def test_rest_keeps_the_shape_that_the_wind_gave(program, scene, tmp_path):
    still = setting("/head/animation/keys", []) + setting("/frames/last", 140) + setting("/model/drag", 4)
    blown = still + setting("/effects/wind", WIND)
    kept = Groomed(program, scene, tmp_path / "kept", *blown, *grooming({"frame": 20, "rest": {}}))
    # The same, with an operation that changes nothing.
    free = Groomed(program, scene, tmp_path / "free", *blown, *grooming({"frame": 20, "trim": {"length": 1}}))
    np.testing.assert_array_equal(kept.position[:20], free.position[:20])

    def far(a, b):
        return np.linalg.norm(a - b, axis=1)

    bent = far(free.position[19], free.position[0])
    assert np.median(bent) > 0.02
    assert np.median(far(free.position[-1], free.position[0])) < 0.05 * np.median(bent)
    assert np.median(far(kept.position[-1], kept.position[19])) < 0.05 * np.median(bent)
    assert np.median(far(kept.position[-1], kept.position[0])) > 0.8 * np.median(bent)


def test_a_comb_turns_hair_along_its_curve(program, scene, tmp_path):
    still = setting("/head/animation/keys", []) + setting("/frames/last", 60) + setting("/model/drag", 4)
    comb = {"curve": [[-0.4, 0.15, 0], [0.4, 0.15, 0]], "radius": 0.3}
    combed = Groomed(program, scene, tmp_path / "out", *still, *grooming({"frame": 2, "comb": comb}))

    def along(frame):
        strands = combed.strands(frame)
        near = [np.hypot(strand[0, 1] - 0.15, strand[0, 2]) < 0.08 for strand in strands]
        ends = np.array([strand[-1] - strand[0] for strand in strands])[near]
        assert len(ends) > 30
        return ends[:, 0] / np.linalg.norm(ends, axis=1)

    assert abs(np.mean(along(2))) < 0.2 and np.mean(along(60)) > 0.7
    np.testing.assert_allclose(combed.lengths(60), combed.lengths(1), rtol=2e-4)


def test_what_is_left_rises_when_weight_is_cut_off(program, scene, tmp_path):
    """Ghosts carry each particle's own weight; a strand that only its springs hold, clamped at the root, bends under all
    that hangs on it: without the lower half the upper half comes up."""
    sagging = setting("/model/preload", False) + setting("/head/animation/keys", []) + setting("/frames/last", 100)
    soft = setting("/model/stiffness", {"integrity": 0, "angular": 0}) + setting("/model/clamped_particles", 2)
    options = [*sagging, *soft, *setting("/model/drag", 4), *setting("/effects/inextensible", None)]
    options += setting("/effects/solids", [])
    half = {"frame": 60, "trim": {"length": LENGTH / 2}}
    cut = Groomed(program, scene, tmp_path / "cut", *options, *grooming(half))
    whole = Groomed(program, scene, tmp_path / "whole", *options, *grooming({"frame": 60, "trim": {"length": 1}}))
    middle = cut.offsets[:-1] + PARTICLES // 2 - 1
    sag = [np.linalg.norm(run_.position[-1, middle] - run_.position[0, middle], axis=1) for run_ in (cut, whole)]
    assert np.mean(sag[0] < sag[1]) > 0.95 and np.median(sag[0] / sag[1]) < 0.6


@pytest.mark.parametrize("frames", ["1-2", "1-4", "1-6"])
def test_a_cut_run_resumes_to_the_same_bytes(program, scene, tmp_path, frames):
    operations = [{"frame": 2, "trim": {"length": 0.1}}, {"frame": 4, "rest": {}}, {"frame": 5, "lengthen": {"by": 0.04}}]
    options = [*grooming(*operations), *setting("/effects/non_hookean", {"curve": [[0.02, 0.02], [0.1, 0.05]]})]
    assert run(program, scene, tmp_path / "whole", *options).returncode == 0
    assert run(program, scene, tmp_path / "cut", *options, "--frames", frames, "--threads", "1").returncode == 0
    assert run(program, scene, tmp_path / "cut", *options, "--resume").returncode == 0
    assert frame_bytes(tmp_path / "cut") == frame_bytes(tmp_path / "whole")


def test_without_grooming_there_is_no_count_and_no_stage(program, scene, plain, tmp_path):
    assert "living" not in plain
    plan = subprocess.run([program, "plan", scene, "--json"], capture_output=True, text=True, check=True)
    assert "grooming" in json.loads(plan.stdout)["absent"]
    command = [program, "plan", scene, "--json", *grooming({"frame": 4, "lengthen": {"by": 0.05}})]
    planned = json.loads(subprocess.run([str(w) for w in command], capture_output=True, text=True, check=True).stdout)
    assert "grooming" in [stage["name"] for stage in planned["stages"]]
    assert planned["particles"] == STRANDS * PARTICLES  # those that are there, not the room for more


def test_info_counts_what_is_left(program, scene, tmp_path):
    run_ = Groomed(program, scene, tmp_path / "out", *grooming({"frame": 4, **PLANE}))
    told = subprocess.run([program, "info", tmp_path / "out", "--json"], capture_output=True, text=True, check=True)
    left = run_.living[-1]
    assert json.loads(told.stdout)["last_frame"]["living"] == {"strands": (left > 1).sum(), "particles": left.sum()}


def test_a_trim_that_leaves_nothing_names_itself_and_keeps_earlier_frames(program, scene, tmp_path):
    everything = {"frame": 5, "trim": {"sphere": {"centre": [0, 0, 0], "radius": 5}}}
    result = run(program, scene, tmp_path / "out", *grooming({"frame": 3, **PLANE}, everything))
    assert result.returncode == 3
    assert "error: /effects/grooming/1/trim: leaves nothing of any strand in frame 5" in result.stderr
    assert sorted(path.name for path in (tmp_path / "out").glob("tiny.0*")) == [f"tiny.000{f}.h5" for f in (1, 2, 3, 4)]


@pytest.mark.parametrize(
    "operation, expected",
    [
        ({"frame": 99, "rest": {}}, "#/effects/grooming/0/frame: found 99, expected a frame from first to last, 1 to 8"),
        ({"frame": 2, "trim": {"mesh": "none.obj"}}, '#/effects/grooming/0/trim/mesh: found "none.obj"'),
        ({"frame": 2, "groom": "wig", "rest": {}}, '#/effects/grooming/0/groom: found "wig", expected the name of a groom'),
    ],
)
def test_operations_that_cannot_be_are_refused_before_the_run(program, scene, tmp_path, operation, expected):
    result = run(program, scene, tmp_path / "out", *grooming(operation))
    assert result.returncode == 3 and expected in result.stderr and not (tmp_path / "out").exists()


SOFT = {"curve": [[0.02, 0.02], [0.1, 0.05]]}  # breaks early


@pytest.mark.parametrize("operation", [{"comb": {"curve": [[-1, 0.2, 0], [1, 0.2, 0]], "radius": 1}}, {"rest": {}}])
def test_no_operation_heals_what_is_broken(program, scene, tmp_path, operation):
    options = setting("/effects/non_hookean", SOFT) + setting("/cache/fields", ["position", "elongation"])
    options += setting("/effects/wind", {"velocity": [8, 0, 0]})
    out = tmp_path / "out"
    assert run(program, scene, out, *options, *grooming({"frame": 5, **operation})).returncode == 0
    with h5py.File(out / "tiny.h5") as cache:
        elongation = cache["elongation"][:]
    assert np.mean(elongation[3] > 0.1) > 0.3  # broken before
    assert (np.diff(elongation, axis=0) >= 0).all()


def test_a_comb_that_hardly_touches_moves_nothing(program, scene, tmp_path):
    """Whatever the head's pose: what hair bears is not combed into its rest shape."""
    turned = setting("/head/animation/keys", [{"frame": 1}, {"frame": 9, "rotate": [0, 0, 0.7071, 0.7071]}])
    options = [*turned, *setting("/frames/last", 100), *setting("/model/drag", 4)]
    comb = {"curve": [[-1, 0.2, 0], [1, 0.2, 0]], "radius": 1, "strength": 1e-9}
    combed = Groomed(program, scene, tmp_path / "combed", *options, *grooming({"frame": 60, "comb": comb}))
    alone = Groomed(program, scene, tmp_path / "alone", *options, *grooming({"frame": 60, "trim": {"length": 1}}))
    np.testing.assert_allclose(combed.position[-1], alone.position[-1], atol=2e-6)


def test_a_comb_leaves_the_clamped_segment(program, scene, tmp_path):
    clamped = setting("/model/clamped_particles", 2) + setting("/head/animation/keys", [])
    comb = {"curve": [[-1, 0.2, 0], [1, 0.2, 0]], "radius": 1}
    combed = Groomed(program, scene, tmp_path / "out", *clamped, *grooming({"frame": 3, "comb": comb}))
    second = combed.offsets[:-1] + 1
    np.testing.assert_array_equal(combed.position[:, second], np.broadcast_to(combed.position[0, second], (LAST, STRANDS, 3)))
    assert np.abs(combed.position[-1] - combed.position[0]).max() > 0.01


def test_a_length_of_another_unit_is_refused(program, scene, tmp_path):
    result = run(program, scene, tmp_path / "out", *grooming({"frame": 3, "lengthen": {"by": 1000}}))
    assert result.returncode == 3 and "particles, expected at most 16384" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_first_frame_that_cannot_be_leaves_an_old_cache_alone(program, scene, tmp_path):
    assert run(program, scene, tmp_path / "out").returncode == 0
    before = frame_bytes(tmp_path / "out")
    result = run(program, scene, tmp_path / "out", "--overwrite", *grooming({"frame": 1, "trim": {"length": 1e-6}}))
    assert result.returncode == 3 and "leaves nothing" in result.stderr
    assert frame_bytes(tmp_path / "out") == before


def test_the_first_frame_can_be_groomed(program, scene, tmp_path):
    cut = Groomed(program, scene, tmp_path / "out", *grooming({"frame": 1, "trim": {"length": 0.1}}))
    assert (cut.lengths(1) < 0.1001).all() and (cut.living[0] == cut.living[-1]).all()


def test_compare_minds_living_particles(program, scene, tmp_path):
    Groomed(program, scene, tmp_path / "a", *grooming({"frame": 1, "trim": {"length": 0.1}}))
    Groomed(program, scene, tmp_path / "b", *grooming({"frame": 1, "trim": {"length": 0.05}}))
    compared = subprocess.run(
        [program, "compare", tmp_path / "a", tmp_path / "b", "--tolerance", "10"], capture_output=True, text=True
    )
    assert compared.returncode == 1 and f"other living particles in frames: 1-{LAST}" in compared.stdout
