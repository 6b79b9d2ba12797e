"""scenes/hair_hair: they load, plan and run; their files are what the tool makes; and what the figures count by is
right about strands whose way is known."""
import json
import re
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from conftest import SOURCE
from reproduction.common import read_scene, run_scene
from reproduction.crossings import went_through
from reproduction.density import Lattice, over_target, volume

SCENES = SOURCE / "scenes/hair_hair"
NAMES = ["squeezed_bundle", "two_locks"]


# ---- The scenes --------------------------------------------------------------------------------------------------


def test_every_scene_is_described_and_needs_nothing_from_outside():
    assert sorted(path.stem for path in SCENES.glob("*.json")) == NAMES
    for name in NAMES:
        text = (SCENES / f"{name}.json").read_text()
        assert f"| {name}.json |" in (SCENES / "README.md").read_text()
        assert json.loads(text)["name"] == name and "shared" not in text


def test_assets_are_what_the_tool_makes(tmp_path):
    tool = SOURCE / "tools/make-hair-hair-assets"
    subprocess.run([sys.executable, tool, "-o", tmp_path], check=True, capture_output=True)
    made, committed = sorted(tmp_path.iterdir()), sorted((SCENES / "assets").iterdir())
    assert [path.name for path in made] == [path.name for path in committed]
    for one, other in zip(made, committed):
        assert one.read_bytes() == other.read_bytes(), one.name


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_plans_what_it_asks_for(program, name):
    command = [program, "plan", SCENES / f"{name}.json", "--json"]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    planned = {stage["name"] for stage in json.loads(told.stdout)["stages"]}
    asked = set(read_scene(f"hair_hair/{name}")["effects"]["hair_hair"])
    assert planned & {"grid", "contacts"} == asked


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_runs(program, tmp_path, name):
    run = run_scene(f"hair_hair/{name}", name, {"/model/substeps": 2}, 3, tmp_path)
    assert run.code == 0 and run.frames == [1, 2, 3], run.log
    assert np.isfinite(run.position(3)).all()
    assert abs(run.edge_strain(3)).max() < 1e-3
    assert np.abs(run.position(1) - run.cache.rest_position).max() < 1e-6


# ---- What the figures count by -------------------------------------------------------------------------------------


def made(*frames, groom=None):
    """What Run is to crossings and density, of strands as they are in `frames` [strands, particles, 3]."""
    frames = [np.asarray(frame, float) for frame in frames]
    strands, particles = frames[0].shape[:2]
    segments = np.linalg.norm(np.diff(frames[0], axis=1), axis=2)
    return SimpleNamespace(
        frames=list(range(1, len(frames) + 1)),
        position=lambda frame: frames[frame - 1].reshape(-1, 3),
        cache=SimpleNamespace(rest_position=frames[0].reshape(-1, 3)),
        groom=np.arange(strands) if groom is None else np.asarray(groom),
        strand=np.repeat(np.arange(strands), particles),
        roots=particles * np.arange(strands),
        rest_lengths=np.column_stack([np.zeros(strands), segments]).ravel(),
    )


def along(axis, offset, particles=6):
    """A strand of length 2 through `offset`."""
    return np.linspace(-1, 1, particles)[:, None] * np.eye(3)[axis] + offset


def test_a_strand_that_goes_through_another_is_counted_and_one_that_comes_back_has_not_gone():
    x = along(0, [0, 0, 0])
    at = [np.stack([x, along(2, [0.03, height, 0.01])]) for height in (0.3, 0.1, -0.2, -0.1, 0.2)]
    found = went_through(made(*at), 0, 1)
    assert list(found["net"].values()) == [0, 0, 1, 1, 0]
    assert list(found["ever"].values()) == [0, 0, 1, 1, 1]


@pytest.mark.parametrize("shift", [[0, 0, -0.9], [0, 0, 1.4]])
def test_only_what_cuts_is_counted(shift):
    """The second strand goes down in one frame, across the first one or past its end."""
    x = along(0, [0, 0, 0])
    above, below = (along(2, [0.03, height, 0.01]) + shift for height in (0.2, -0.2))
    found = went_through(made(np.stack([x, above]), np.stack([x, below])), 0, 1)
    assert found["net"][2] == (abs(shift[2]) < 1)


def test_locks_that_turn_together_do_not_go_through_each_other():
    random = np.random.default_rng(8)
    places = random.uniform(-0.05, 0.05, (2, 20, 2))
    lock = np.array([along(0, [0, y, z]) for y, z in places[0]])
    other = np.array([along(2, [x, 0.15 + y, 0]) for x, y in places[1]])
    both = np.concatenate([lock, other])
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    groom = np.repeat([0, 1], 20)
    assert went_through(made(both, both @ turn.T, both @ turn.T @ turn.T, groom=groom), 0, 1)["net"][3] == 0
    fallen = np.concatenate([lock, other - [0, 0.5, 0]])
    assert went_through(made(both, fallen, groom=groom), 0, 1)["net"][2] == 400


def straight(spacing, side=10, particles=6):
    """side x side strands along y, 0.3 long, `spacing` apart."""
    places = spacing * np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    y = np.broadcast_to(-np.linspace(0, 0.3, particles), (side * side, particles))
    x, z = (np.broadcast_to(places[:, axis, None], y.shape) for axis in (0, 1))
    return np.stack([x, y, z], axis=2)


def test_density_is_strands_in_a_cell():
    block = made(straight(0.001, side=20))
    density = Lattice(block, block.position(1), 0.005).density
    assert density.max() == pytest.approx(5 * 5)
    assert density.sum() == pytest.approx(400 * 0.3 / 0.005)


def test_hair_that_is_pressed_together_is_over_its_target():
    block = straight(0.001, side=20)
    squeezed = block * [0.5, 1, 1]
    found = over_target(made(block, block, squeezed), [1, 2, 3], resolution=60)
    assert found[1][0] == pytest.approx(1) and found[2] == found[1]
    assert 1.8 < found[3][0] < 2.2 and found[3][1] > 0.5


def test_volume_is_counted_on_the_heads_axes():
    block = straight(0.001, side=20, particles=12)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    run = made(block + 1e-4, block @ turn.T + 0.1, block * [1, 1, 0.5] + 1e-4)
    still, turned, pressed = (volume(run, frame, 0.003) for frame in run.frames)
    assert still == pytest.approx(0.02 * 0.02 * 0.3, rel=0.2)
    assert turned == pytest.approx(still, rel=0.02)
    assert pressed < 0.65 * still


# ---- The document ------------------------------------------------------------------------------------------------


def told(label):
    """The numbers of a row of docs/reproduction.md."""
    text = (SOURCE / "docs/reproduction.md").read_text()
    row = re.search(rf"^\| {re.escape(label)} \|(.*)\|$", text, re.MULTILINE)[1]
    return [float(cell.strip(" %cm")) for cell in row.split("|")]


def figure(name):
    return json.loads((SOURCE / f"docs/figures/{name}.json").read_text())


@pytest.mark.parametrize(
    "label, name",
    [
        ("grid once a frame", "once a frame"),
        ("each substep", "each substep"),
        ("each substep, 4 passes (the scene)", "each substep, 4 passes"),
    ],
)
def test_the_densities_told_are_those_measured(label, name):
    measured = figure("hair_squeezed")[name]
    values = [measured["largest_over_target_held"], 100 * measured["share_of_hair_over_bound_held"]]
    assert told(label) == pytest.approx([*values, measured["health"]["core_ms_per_frame"]], rel=0.05)


def test_the_scenes_density_is_within_its_bound():
    with_grid, off = (figure("hair_squeezed")[name] for name in ("each substep, 4 passes", "off"))
    assert with_grid["largest_over_target_held"] <= 1.5 < off["largest_over_target_held"]


@pytest.mark.parametrize("scene", ["wind", "wig"])
@pytest.mark.parametrize("name", ["off", "grid", "grid, shelter"])
def test_what_the_grid_changes_is_told_as_measured(scene, name):
    measured = figure("hair_paper")[scene][name]
    centimetres = 100 * measured["tips_downwind_m"]["median"]
    values = measured["least_volume_over_first"], centimetres, measured["core_ms_per_frame"]
    assert told(f"{scene}, {name.replace(', ', ' with ')}") == pytest.approx(values, rel=0.03)
