"""Guides and interpolated strands through the program: what is stored, what is exact, what is refused."""
import json
import subprocess

import h5py
import numpy as np
import pytest

from scenes import run, setting
from tiny import PARTICLES, STRANDS, data_bytes, strands, write_scene

COUNT = 40


def guides(count=COUNT, **more):
    return setting("/groom/interpolate", {"count": count, **more})


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return write_scene(tmp_path_factory.mktemp("interpolation"))


@pytest.fixture(scope="module")
def both(program, scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("both") / "out"
    assert run(program, scene, out, *guides(), *setting("/cache/strands", "both")).returncode == 0
    with h5py.File(out / "tiny.h5") as cache:
        yield cache


def particles_of(cache, chosen):
    offsets = cache["strands/offsets"][:]
    return np.concatenate([np.arange(offsets[s], offsets[s + 1]) for s in chosen])


def test_all_strands_are_stored_and_the_guides_once_more_by_themselves(both):
    assert both["position"].shape[1] == STRANDS * PARTICLES
    chosen = both["interpolation/guides"][:]
    assert len(chosen) == COUNT and (np.diff(chosen) > 0).all()
    assert (np.diff(both["guides/offsets"][:]) == PARTICLES).all()
    at = particles_of(both, chosen)
    for now, of_guides in zip(both["position"], both["guides/position"]):
        np.testing.assert_array_equal(now[at], of_guides)


def test_weights_sum_to_1_and_a_guide_follows_itself(both):
    guide, weight = both["interpolation/guide"][:], both["interpolation/weight"][:]
    np.testing.assert_allclose(weight.sum(1), 1, atol=2e-7)
    assert ((guide >= 0) | (weight == 0)).all() and guide.shape == (STRANDS, 3)
    chosen = both["interpolation/guides"][:]
    np.testing.assert_array_equal(chosen[guide[chosen, 0]], chosen)
    assert (weight[chosen, 0] == 1).all()
    # Nearest first, by the roots.
    root = both["strands/rest_position"][:][both["strands/offsets"][:-1]]
    far = np.linalg.norm(root[:, None] - root[chosen][None], axis=-1)
    others = np.setdiff1d(np.arange(STRANDS), chosen)
    np.testing.assert_allclose(np.take_along_axis(far, guide, 1)[others], np.sort(far, 1)[others, :3], rtol=1e-6)


def test_the_cache_holds_the_strands_that_are_asked_for(program, scene, both, tmp_path):
    for stored in ("guides", "all"):
        assert run(program, scene, tmp_path / stored, *guides(), *setting("/cache/strands", stored)).returncode == 0
    with h5py.File(tmp_path / "guides/tiny.h5") as cache:
        np.testing.assert_array_equal(cache["position"][:], both["guides/position"][:])
        assert "interpolation" not in cache and "guides" not in cache
    with h5py.File(tmp_path / "all/tiny.h5") as cache:
        np.testing.assert_array_equal(cache["position"][:], both["position"][:])
        assert "interpolation" in cache and "guides" not in cache


def test_guides_move_as_if_they_were_alone(program, scene, both, tmp_path):
    """What follows a guide does nothing to it: a groom of the guides only gives them the same bits."""
    only = setting("/groom/interpolate", {"strands": both["interpolation/guides"][:].tolist()})
    assert run(program, scene, tmp_path / "out", *only, *setting("/cache/strands", "guides")).returncode == 0
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        np.testing.assert_array_equal(cache["position"][:], both["guides/position"][:])


def test_a_groom_of_guides_only_is_simulated_whole(program, scene, tmp_path):
    assert run(program, scene, tmp_path / "plain").returncode == 0
    assert run(program, scene, tmp_path / "all", *guides(STRANDS)).returncode == 0
    with h5py.File(tmp_path / "plain/tiny.h5") as plain, h5py.File(tmp_path / "all/tiny.h5") as followed:
        np.testing.assert_array_equal(followed["position"][:], plain["position"][:])
        np.testing.assert_array_equal(followed["figures/edge_strain_free"][:], plain["figures/edge_strain_free"][:])


def test_rigid_motion_is_followed_exactly(program, scene, tmp_path):
    """The first frame is the rest shape carried by the head, which is turned and moved in it."""
    turned = setting("/head/animation/keys", [{"frame": 1, "translate": [1, 2, 3], "rotate": [0.3, 0.5, -0.2, 0.7]}])
    for name, options in (("plain", []), ("guides", guides())):
        assert run(program, scene, tmp_path / name, *turned, *options, "--frames", "1-1").returncode == 0
    with h5py.File(tmp_path / "plain/tiny.h5") as plain, h5py.File(tmp_path / "guides/tiny.h5") as followed:
        np.testing.assert_allclose(followed["position"][0], plain["position"][0], rtol=0, atol=5e-7)


def test_roots_stay_on_the_head(program, scene, both, tmp_path):
    assert run(program, scene, tmp_path / "plain").returncode == 0
    with h5py.File(tmp_path / "plain/tiny.h5") as plain:
        root = plain["strands/offsets"][:-1]
        np.testing.assert_array_equal(both["position"][:, root], plain["position"][:, root])


def test_velocities_of_followers_are_those_of_their_positions(program, scene, tmp_path):
    slow = setting("/frames", {"first": 1, "last": 401, "fps": 4800}) + setting("/model/substeps", 1)
    fields = setting("/cache/fields", ["position", "velocity"]) + setting("/motion", {"speed": 0.005})
    options = [*guides(), *slow, *fields, "--frames", "399-401", "--precision", "double"]
    assert run(program, scene, tmp_path / "out", *options).returncode == 0
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        moved = (cache["position"][2].astype(float) - cache["position"][0]) * 4800 / 2
        velocity = cache["velocity"][1]
    size = np.linalg.norm(velocity, axis=1)
    assert np.median(size) > 0.1
    # Positions are stored to some 1e-8 m; the rest is the change of velocity from step to step.
    assert np.percentile(np.linalg.norm(moved - velocity, axis=1), 99) < 0.02 * np.percentile(size, 99)


def test_info_tells_of_guides(program, both):
    told = subprocess.run([program, "info", both.filename, "--json"], capture_output=True, text=True, check=True)
    assert json.loads(told.stdout)["interpolation"] == {"guides": COUNT, "neighbours": 3}


@pytest.mark.parametrize("options", [["--threads", "1"], ["--threads", "2"]])
def test_threads_and_resuming_change_no_byte(program, scene, both, tmp_path, options):
    chosen = [*guides(), *setting("/cache/strands", "both"), *options]
    assert run(program, scene, tmp_path / "out", *chosen, "--frames", "1-2").returncode == 0
    assert run(program, scene, tmp_path / "out", *chosen, "--resume").returncode == 0
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        np.testing.assert_array_equal(cache["position"][:], both["position"][:])
        np.testing.assert_array_equal(cache["guides/position"][:], both["guides/position"][:])


def test_only_guides_are_planned(program, scene):
    def plan(*options):
        command = [program, "plan", scene, "--json", *options]
        return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    without, guided = plan(), plan(*guides())
    assert guided["strands"] == COUNT and guided["particles"] == COUNT * PARTICLES
    assert "interpolation" in without["absent"] and "interpolation" not in guided["absent"]
    stage = next(stage for stage in guided["stages"] if stage["name"] == "interpolation")
    assert stage["bytes"] > 0 and stage["launches"] == 0


@pytest.mark.parametrize(
    "interpolate, expected",
    [
        ({"count": STRANDS + 1}, "/groom/interpolate/count: found 301, expected at most the groom's 300 strands"),
        ({"group": "fringe"}, '/groom/interpolate/group: found "fringe", expected a group of the groom'),
        ({"strands": [3, 300]}, "/groom/interpolate/strands/1: found 300, expected a strand of the groom, 0 to 299"),
        ({}, "#/groom/interpolate: found none of count, group, strands"),
    ],
)
def test_guides_that_do_not_exist_are_named(program, scene, tmp_path, interpolate, expected):
    result = run(program, scene, tmp_path / "out", *setting("/groom/interpolate", interpolate))
    assert result.returncode == 3 and expected in result.stderr
    assert not (tmp_path / "out").exists()


# ---- beside another groom that is groomed --------------------------------------------------------------

HAIR = {"name": "hair", "file": "groom.data", "attach": "nearest", "interpolate": {"count": COUNT}}
BEARD = {"name": "beard", "file": "groom.data", "attach": "nearest"}


@pytest.mark.parametrize("stored", ["all", "guides", "both"])
@pytest.mark.parametrize("order", [[HAIR, BEARD], [BEARD, HAIR]], ids=["hair first", "beard first"])
def test_a_groom_is_lengthened_beside_one_that_interpolates(program, scene, tmp_path, order, stored):
    grooms = setting("/groom", order) + setting("/cache/strands", stored)
    longer = setting("/effects/grooming", [{"frame": 3, "groom": "beard", "lengthen": {"by": 0.05}}])
    for name, options in (("plain", []), ("longer", longer)):
        result = run(program, scene, tmp_path / name, *grooms, *options)
        assert result.returncode == 0, result.stderr
    with h5py.File(tmp_path / "plain/tiny.h5") as plain, h5py.File(tmp_path / "longer/tiny.h5") as cache:
        beard = order.index(BEARD)
        before, after = plain["strands/offsets"][:], cache["strands/offsets"][:]
        assert len(before) == len(after)
        living = cache["living"][:]
        assert (living <= np.diff(after)).all() and (living[:2] == np.diff(before)).all()
        for strand, groom in enumerate(cache["strands/groom"][:]):
            room, had = after[strand + 1] - after[strand], before[strand + 1] - before[strand]
            assert (room > had) == (groom == beard)
            frames = slice(0, 2) if groom == beard else slice(None)  # hair never notices
            np.testing.assert_array_equal(
                cache["position"][frames, after[strand] : after[strand] + had],
                plain["position"][frames, before[strand] : before[strand + 1]],
            )
        if stored == "both":
            assert cache["guides/position"].shape[1] == cache["guides/offsets"][-1]
            assert np.isfinite(cache["guides/position"][:]).all()


def test_guides_that_are_all_pruned_are_an_error(program, tmp_path):
    """Strand 0 alone is a guide, and grows into the head."""
    hair = strands()
    hair[0] = 2 * hair[0, :1] - hair[0]
    scene = write_scene(tmp_path, groom=data_bytes(hair))
    chosen = setting("/groom/penetration", "prune") + setting("/groom/interpolate", {"strands": [0]})
    result = run(program, scene, tmp_path / "out", *chosen)
    assert result.returncode == 3 and "/groom/interpolate: every guide starts inside the head" in result.stderr


def test_nothing_moves_in_the_first_frame(program, scene, tmp_path):
    away = setting("/head/animation/keys", [{"frame": 1, "translate": [1, 0, 0]}, {"frame": 5, "translate": [1, 0, 1]}])
    fixed = setting("/head", None) + setting("/groom/attach", "fixed") + setting("/effects/solids", [])
    fixed += setting("/groom/animation/keys", [{"frame": 1, "translate": [1, 0, 0]}])
    fields = setting("/cache/fields", ["position", "velocity"])
    for name, options in (("head", away), ("fixed", fixed)):
        assert run(program, scene, tmp_path / name, *guides(), *options, *fields, "--frames", "1-2").returncode == 0
        with h5py.File(tmp_path / name / "tiny.h5") as cache:
            assert (cache["velocity"][0] == 0).all()
            assert np.isfinite(cache["velocity"][1]).all()


def test_at_a_kink_followers_have_the_velocity_that_guides_have(program, scene, tmp_path):
    """The head goes at 6 m/s and stops at frame 3: what its roots then have is the last substep's."""
    keys = [{"frame": 1}, {"frame": 3, "translate": [0.5, 0, 0]}]
    kink = setting("/head/animation", {"keys": keys, "interpolation": "linear"})
    fields = setting("/cache/fields", ["position", "velocity"])
    assert run(program, scene, tmp_path / "out", *guides(), *kink, *fields).returncode == 0
    with h5py.File(tmp_path / "out/tiny.h5") as cache:
        roots = cache["velocity"][2][cache["strands/offsets"][:-1]]
    np.testing.assert_allclose(roots, np.broadcast_to([6, 0, 0], roots.shape), atol=1e-4)


def test_a_cache_of_guides_makes_no_followers(program, scene):
    command = [program, "plan", scene, "--json", *guides(), *setting("/cache/strands", "guides")]
    planned = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert planned["strands"] == COUNT and "interpolation" in planned["absent"]


def test_figures_tell_how_followers_stretch(both):
    """Guides keep their lengths; of all strands the figures are those of the positions."""
    rest, offsets = both["strands/rest_position"][:].astype(float), both["strands/offsets"][:]
    inner = np.setdiff1d(np.arange(len(rest) - 1), offsets[1:-1] - 1)

    def lengths(points):
        return np.linalg.norm(np.diff(points, axis=0), axis=1)[inner]

    for frame, position in enumerate(both["position"][:].astype(float)):
        strain = np.abs(lengths(position) / lengths(rest) - 1)
        assert both["figures/edge_strain_all"][frame] == pytest.approx(strain.max(), abs=2e-5)
        assert both["figures/edge_strain_all_p99"][frame] == pytest.approx(np.percentile(strain, 99), rel=0.02, abs=2e-5)
    assert both["figures/edge_strain_all"][-1] > 10 * both["figures/edge_strain_free"][-1]


def test_guides_that_are_pruned_are_told_of(program, tmp_path):
    hair = strands()
    hair[0] = 2 * hair[0, :1] - hair[0]
    scene = write_scene(tmp_path, groom=data_bytes(hair))
    chosen = setting("/groom/penetration", "prune") + setting("/groom/interpolate", {"strands": [0, 9]})
    result = run(program, scene, tmp_path / "out", *chosen)
    assert result.returncode == 0 and "/groom/interpolate: 1 guides start inside the head and are pruned" in result.stderr
