"""The mass-spring model and the scene's own motion through the program."""
import json

import h5py
import numpy as np
import pytest

from conftest import run
from small_cache import ball
from tiny import LAST, PARTICLES, RADIUS, STRANDS, figures, steps, write_mesh, write_scene

RIDE = [{"frame": 1}, {"frame": 5, "translate": [0.1, 0, 0], "rotate": [0, 0.5, 0, 0.8]}]


# ---- mass-spring


@pytest.fixture(scope="module")
def mass_spring(tmp_path_factory):
    return write_scene(tmp_path_factory.mktemp("springs"), lambda scene: scene["model"].update(type="mass_spring"))


@pytest.mark.parametrize("scheme", ["projected", "paper"])
def test_mass_spring_takes_wind_solids_and_lengths_and_resumes(program, mass_spring, tmp_path, scheme):
    options = [f'--set=/model/scheme="{scheme}"', '--set=/effects/wind={"velocity": [3, 0, 0], "turbulence": {}}']
    whole = steps(program, mass_spring, tmp_path / "whole", *options)
    steps(program, mass_spring, tmp_path / "cut", *options, f"--set=/frames/last={LAST - 2}", "--threads", "1")
    assert steps(program, mass_spring, tmp_path / "cut", *options, "--resume") == whole
    assert figures(tmp_path / "whole", "edge_strain_free").max() <= 1e-3
    with h5py.File(tmp_path / "whole/tiny.h5") as cache:
        assert cache["figures/strands_moved"][-1] > 0
    other = "paper" if scheme == "projected" else "projected"
    assert steps(program, mass_spring, tmp_path / "other", *options, f'--set=/model/scheme="{other}"') != whole


def test_the_plan_says_what_companions_take(program, mass_spring):
    def stages(*options):
        result = run(program, "plan", mass_spring, "--json", *options)
        return {stage["name"]: stage for stage in json.loads(result.stdout)["stages"]}

    ams, springs = stages('--set=/model/type="ams"'), stages()
    rows = -(-STRANDS // 16) * PARTICLES * 16  # of particles
    assert springs["strands"]["bytes"] - ams["strands"]["bytes"] == rows * 3 * 4 * 3  # rest, position, velocity
    assert springs["strands"]["launches"] == ams["strands"]["launches"]


# ---- motion


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    return write_scene(tmp_path_factory.mktemp("still"), lambda scene: scene["head"].pop("animation"))


def motion(**block):
    return f"--set=/motion={json.dumps(block)}"


def test_no_motion_is_no_motion_bit_for_bit(program, still, tmp_path):
    plain = steps(program, still, tmp_path / "plain")
    assert steps(program, still, tmp_path / "empty", motion()) == plain
    assert steps(program, still, tmp_path / "fast", motion(speed=10)) == plain
    assert steps(program, still, tmp_path / "held", motion(keys=[{"frame": 1}])) == plain


def test_a_scene_that_moves_carries_its_head_as_the_heads_own_keys_do(program, still, tmp_path):
    own = f"--set=/head/animation={json.dumps({'keys': RIDE})}"
    assert steps(program, still, tmp_path / "scene", motion(keys=RIDE)) == steps(program, still, tmp_path / "head", own)


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_speed_is_the_same_keys_closer_together(program, still, tmp_path, interpolation):
    closer = [{**key, "frame": 1 + (key["frame"] - 1) / 4} for key in RIDE]
    fast = steps(program, still, tmp_path / "fast", motion(keys=RIDE, speed=4, interpolation=interpolation))
    assert fast == steps(program, still, tmp_path / "close", motion(keys=closer, interpolation=interpolation))


def test_a_resumed_ride_meets_the_same_poses(program, still, tmp_path):
    ride = motion(keys=RIDE, speed=3)
    whole = steps(program, still, tmp_path / "whole", ride)
    steps(program, still, tmp_path / "cut", ride, f"--set=/frames/last={LAST - 2}", "--threads", "1")
    assert steps(program, still, tmp_path / "cut", ride, "--resume") == whole


def quaternion_matrix(x, y, z, w):
    x, y, z, w = np.array([x, y, z, w]) / np.linalg.norm([x, y, z, w])
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


# At speed 10 and 24 frames a second: up to 6 m and 2.5 rad a frame, 140 m/s.
RIDE_KEYS = [
    {"frame": 1}, {"frame": 31, "translate": [0.6, 0.4, 0], "rotate": [0, 0.9, 0, 0.4]},
    {"frame": 61, "translate": [1.2, -0.2, 0.3], "rotate": [0.4, 0, 0, 0.9]}, {"frame": 101, "translate": [0, 0.3, 0]},
]


def slerp(a, b, weight):
    a, b = (np.array(q) / np.linalg.norm(q) for q in (a, b))
    b = b if a @ b >= 0 else -b
    angle = np.arccos(min(1, a @ b))
    return a if angle < 1e-9 else (np.sin((1 - weight) * angle) * a + np.sin(weight * angle) * b) / np.sin(angle)


def pose(keys, frame):
    """(rotation, translation) of linear keys."""
    frame = min(frame, keys[-1]["frame"])
    k = max(i for i, key in enumerate(keys[:-1]) if key["frame"] <= frame)
    before, after = keys[k], keys[k + 1]
    weight = (frame - before["frame"]) / (after["frame"] - before["frame"])
    turn, place = (lambda key: key.get("rotate", [0, 0, 0, 1])), (lambda key: np.array(key.get("translate", [0, 0, 0])))
    return (quaternion_matrix(*slerp(turn(before), turn(after), weight)),
            (1 - weight) * place(before) + weight * place(after))


def ride(program, directory, speed, change=lambda scene: None):
    """Positions [frames, strands, particles, 3] in the carrier's axes, and the cache."""

    def carried(scene):
        scene["head"].pop("animation")
        scene["frames"]["last"] = 13
        scene["model"]["substeps"] = 8 * speed  # the same way a substep
        scene["motion"] = {"keys": RIDE_KEYS, "speed": speed, "interpolation": "linear"}
        change(scene)

    steps(program, write_scene(directory, carried), directory / "out")
    with h5py.File(directory / "out/tiny.h5") as cache:
        frames, position = cache["frames"][:], cache["position"][:]
    local = []
    for frame, points in zip(frames, position):
        turn, place = pose(RIDE_KEYS, 1 + (frame - 1) * speed)
        local.append((points - place) @ turn)
    return np.array(local).reshape(len(frames), STRANDS, PARTICLES, 3)


@pytest.mark.parametrize("model", ["ams", "mass_spring"])
@pytest.mark.parametrize("speed", [1, 3, 10])
def test_hair_stays_on_and_outside_a_head_that_rides(program, tmp_path, speed, model):
    local = ride(program, tmp_path, speed, lambda scene: scene["model"].update(type=model))
    assert np.abs(local[:, :, 0] - local[0, :, 0]).max() < 1e-5, "roots stay where they grow"
    # The triangles of the ball reach down to 0.986 of its radius.
    assert np.linalg.norm(local[:, :, 1:], axis=-1).min() > 0.985 * RADIUS
    assert figures(tmp_path / "out", "edge_strain_free").max() <= 1e-3
    assert figures(tmp_path / "out", "edge_strain_moved").max() <= 1e-3
    if speed > 1:
        assert figures(tmp_path / "out", "strands_moved").max() > 0


# A head that deforms so little that hair cannot tell: it collides as a rigid one does, whatever way it goes between
# two of its level sets.
@pytest.mark.parametrize("speed", [3, 10])
def test_a_deforming_head_that_rides_is_met_as_a_rigid_one(program, tmp_path, speed):
    def breathing(scene):
        scene["head"]["mesh"] = "head.#.obj"

    for name in ["rigid", "deforming"]:
        (tmp_path / name).mkdir()
    vertices, triangles = ball()
    for number in range(1, 12 * speed + 2):
        write_mesh(tmp_path / f"deforming/head.{number}.obj", vertices * (1 + 1e-4 * (number // 3 % 2)), triangles)
    rigid = ride(program, tmp_path / "rigid", speed)
    deforming = ride(program, tmp_path / "deforming", speed, breathing)
    apart = np.linalg.norm(deforming - rigid, axis=-1)
    assert np.median(apart, axis=(1, 2)).max() < 0.01
    fastest = [figures(tmp_path / name / "out", "speed_max").max() for name in ["rigid", "deforming"]]
    assert fastest[1] < 1.1 * fastest[0]
    assert figures(tmp_path / "deforming/out", "particles_swept").max() == 0
    assert np.linalg.norm(deforming[:, :, 1:], axis=-1).min() > 0.985 * RADIUS
