"""What h5py, numpy and a shell see of a cache that the program has written."""
import json
import os
import shutil
import signal
import struct
import subprocess
import time

import h5py
import numpy as np
import pytest

from conftest import run

STRANDS, PARTICLES, LAST = 40, 9, 5


def write_groom(path):
    """A USC-HairSalon file of slanted straight strands, 0.2 m long."""
    with open(path, "wb") as file:
        file.write(struct.pack("<i", STRANDS))
        for strand in range(STRANDS):
            along = np.linspace(0, 0.2, PARTICLES)
            points = np.stack([0.01 * strand + 0.6 * along, 0.8 * along, 0 * along], -1)
            file.write(struct.pack("<i", PARTICLES) + points.astype("<f4").tobytes())


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A scene `fall` of fixed strands under gravity, frames 1 to 5, every field stored."""
    directory = tmp_path_factory.mktemp("scene")
    write_groom(directory / "groom.data")
    (directory / "fall.json").write_text(json.dumps({
        "name": "fall",
        "frames": {"first": 1, "last": LAST, "fps": 24},
        "groom": {"file": "groom.data", "attach": "fixed"},
        "model": {"preload": False},  # otherwise nothing moves
        "effects": {"gravity": [0, -9.81, 0]},
        "cache": {"fields": ["position", "velocity"]},
    }))
    return directory / "fall.json"


@pytest.fixture(scope="module")
def cache(program, scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("out") / "fall"
    result = run(program, "run", scene, "-o", out)
    assert result.returncode == 0, result.stderr
    return out


def frame_bytes(directory):
    return {path.name: path.read_bytes() for path in sorted(directory.glob("fall.[0-9]*.h5"))}


def test_the_master_is_the_whole_run(cache):
    with h5py.File(cache / "fall.h5") as master:
        assert master.attrs["format"] == "ringlet-cache"
        assert list(master["frames"]) == list(range(1, LAST + 1))
        assert np.allclose(master["time"], np.arange(LAST) / 24, rtol=1e-12, atol=0)
        assert master["position"].shape == (LAST, STRANDS * PARTICLES, 3)
        assert master["velocity"].shape == master["position"].shape
        assert list(np.diff(master["strands/offsets"])) == [PARTICLES] * STRANDS
        resolved = json.loads(master["scene"][()])
        assert resolved["effects"]["gravity"] == [0, -9.81, 0] and resolved["model"]["substeps"] > 0
        position = master["position"][:]
    assert np.isfinite(position).all()
    for row in range(LAST):
        with h5py.File(cache / f"fall.{row + 1:04d}.h5") as frame:
            assert frame.attrs["frame"] == row + 1
            assert (frame["position"][:] == position[row]).all()


def test_the_five_lines_of_the_documentation_work(source, cache):
    text = (source / "schemas/cache.md").read_text()
    code = text.split("```python\n")[1].split("```")[0]
    code = code.replace("out/curly_wind/curly_wind.h5", str(cache / "fall.h5"))
    names = {}
    exec(code, names)  # noqa: S102  the repository's own text
    assert len(names["last"][names["begin"] : names["end"]]) == PARTICLES


def test_a_moved_cache_reads_and_a_missing_frame_is_not_a_number(cache, tmp_path):
    moved = tmp_path / "elsewhere"
    shutil.copytree(cache, moved)
    (moved / "fall.0003.h5").unlink()
    with h5py.File(cache / "fall.h5") as before, h5py.File(moved / "fall.h5") as after:
        for row in (0, 1, 3, 4):
            assert (before["position"][row] == after["position"][row]).all()
        assert np.isnan(after["position"][2]).all()


def test_nothing_but_the_caches_own_files_is_left(cache):
    frames = [f"fall.{frame:04d}.h5" for frame in range(1, LAST + 1)]
    assert sorted(os.listdir(cache)) == sorted(frames + ["fall.h5", "fall.state.h5", "fall.timings.jsonl"])
    timings = [json.loads(line) for line in (cache / "fall.timings.jsonl").read_text().splitlines()]
    assert [line["frame"] for line in timings] == list(range(1, LAST + 1))


def test_compare_says_same_and_not_the_same(program, scene, cache, tmp_path):
    again, other = tmp_path / "again", tmp_path / "other"
    assert run(program, "run", scene, "-o", again).returncode == 0
    assert run(program, "run", scene, "-o", other, "--set", "/effects/gravity=[0,-5.5,0]").returncode == 0
    assert frame_bytes(again) == frame_bytes(cache)
    assert run(program, "compare", cache, again, "--exact").returncode == 0
    result = run(program, "compare", cache, other, "--tolerance", "1e-9", "--json")
    assert result.returncode == 1
    report = json.loads(result.stdout)
    with h5py.File(cache / "fall.h5") as a, h5py.File(other / "fall.h5") as b:
        distance = np.linalg.norm(a["position"][:].astype("f8") - b["position"][:].astype("f8"), axis=-1)
    assert np.isclose(report["overall"]["max"], distance.max(), rtol=1e-9)
    assert np.isclose(report["overall"]["rms"], np.sqrt((distance**2).mean()), rtol=1e-9)
    assert report["overall"]["frame"] == 1 + distance.max(axis=1).argmax()
    assert {"where": "/effects/gravity/1", "a": "-9.81", "b": "-5.5"} in report["provenance"]
    assert run(program, "compare", cache, other, "--tolerance", distance.max() * 1.001).returncode == 0


def test_quantised_keeps_its_bound(program, scene, cache, tmp_path):
    out = tmp_path / "quantised"
    options = ["--set", '/cache/compression="quantised"', "--set", "/cache/error=1e-4"]
    assert run(program, "run", scene, "-o", out, *options).returncode == 0
    with h5py.File(cache / "fall.h5") as exact, h5py.File(out / "fall.h5") as rounded:
        distance = np.linalg.norm(exact["position"][:].astype("f8") - rounded["position"][:].astype("f8"), axis=-1)
        bound = rounded.attrs["error_bound"]
    assert 0 < distance.max() <= bound and np.isclose(bound, 1e-4)


def test_a_killed_run_resumes_to_the_same_bytes(program, scene, tmp_path):
    last = ["--set", "/frames/last=400"]
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert run(program, "run", scene, "-o", whole, *last).returncode == 0
    child = subprocess.Popen([program, "run", scene, "-o", cut, *last], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while child.poll() is None and not (cut / "fall.0020.h5").exists():
        time.sleep(0.001)
    child.send_signal(signal.SIGKILL)
    child.wait()
    for path in cut.glob("fall.*.h5"):
        h5py.File(path).close()
    result = run(program, "run", scene, "-o", cut, *last, "--resume")
    assert result.returncode == 0, result.stderr
    assert frame_bytes(cut) == frame_bytes(whole)
    with h5py.File(cut / "fall.h5") as master:
        assert list(master["frames"]) == list(range(1, 401))


def test_an_existing_cache_is_refused_and_overwritten_on_demand(program, scene, tmp_path):
    out = tmp_path / "out"
    assert run(program, "run", scene, "-o", out).returncode == 0
    before = frame_bytes(out)
    refused = run(program, "run", scene, "-o", out)
    assert refused.returncode == 2
    assert refused.stderr.startswith(f"error: {out / 'fall.h5'}: a cache is already there")
    assert frame_bytes(out) == before
    assert run(program, "run", scene, "-o", out, "--overwrite", "--set", "/frames/last=2").returncode == 0
    assert sorted(frame_bytes(out)) == ["fall.0001.h5", "fall.0002.h5"]


def test_a_full_disk_ends_with_5_and_leaves_whole_frames(program, scene, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    if run("mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", disk).returncode != 0:
        pytest.skip("tmpfs cannot be mounted here")
    try:
        result = run(program, "run", scene, "-o", disk / "out", "--set", "/frames/last=400")
        assert result.returncode == 5
        assert "No space left on device" in result.stderr
        names = os.listdir(disk / "out")
        assert not [name for name in names if name.endswith(".tmp")]
        for name in names:
            if name.endswith(".h5"):
                h5py.File(disk / "out" / name).close()
    finally:
        run("umount", disk)


def test_an_output_directory_that_cannot_be_made_ends_with_5(program, scene, tmp_path):
    (tmp_path / "file").write_text("in the way")
    result = run(program, "run", scene, "-o", tmp_path / "file" / "out")
    assert result.returncode == 5
    assert "is not a directory" in result.stderr


def test_info_counts_what_is_there(program, cache):
    report = json.loads(run(program, "info", cache, "--json", "--strand", 7).stdout)
    assert (report["strands"], report["particles"]) == (STRANDS, STRANDS * PARTICLES)
    assert report["frames"]["count"] == LAST and "missing" not in report["frames"]
    assert np.isclose(report["rest"]["strand"]["length"], 0.2, rtol=1e-5)
    assert len(report["last_frame"]["strand"]["points"]) == PARTICLES
    text = run(program, "info", cache)
    assert text.returncode == 0 and "strands" in text.stdout
    assert run(program, "info", cache, "--strand", STRANDS).returncode == 2
    assert run(program, "info", cache / "nothing.h5").returncode == 3
