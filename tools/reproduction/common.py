"""What the figures share: running scenes with changed values, reading their caches, measuring.

Lengths are in the cache's units (metres in scenes/paper). Pictures and plots are in pictures.py, the count of particles
inside solids in inside.py.
"""
import copy
import hashlib
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
from functools import cached_property

import h5py
import numpy as np

from strand_cache import StrandCache

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes" / "paper"  # of scenes that are named without a folder
WORK = ROOT / "build" / "figures"
PROGRAM = pathlib.Path(os.environ.get("RINGLET_PROGRAM", ROOT / "build/release/bin/ringlet"))
DIVERGED = 4  # the program's exit code


class RunError(Exception):
    """A run that a figure needs has failed."""


# ---- Scenes ------------------------------------------------------------------------------------------------------


def scene_path(name):
    """`wig` is scenes/paper/wig.json, `hair_hair/two_locks` is scenes/hair_hair/two_locks.json."""
    return (ROOT / "scenes" if "/" in name else SCENES) / f"{name}.json"


def read_scene(name):
    """The scene as a dictionary."""
    return json.loads(scene_path(name).read_text())


def grooms_of(scene):
    """(pointer, groom) of each groom of a scene."""
    groom = scene["groom"]
    return [("/groom", groom)] if isinstance(groom, dict) else [(f"/groom/{k}", each) for k, each in enumerate(groom)]


def thinned(scene, share):
    """Overrides that leave `share` of the strands of each grown groom."""
    return {
        f"{pointer}/grow/strands": max(1, round(share * groom["grow"]["strands"]))
        for pointer, groom in grooms_of(scene)
        if groom.get("grow", {}).get("strands")
    }


# ---- Runs --------------------------------------------------------------------------------------------------------


def run_scene(scene, label, overrides=None, frames=None, work=WORK, options=()):
    """Runs a scene with `overrides` ({pointer: value}) into work/LABEL and returns the Run. Divergence is a result
    (Run.diverged_frame); any other failure raises RunError. `frames`: write only up to this one; `options`: of the
    program, as they stand on its command line."""
    path = scene_path(scene)
    settings = dict(overrides or {})
    if frames is not None:
        settings["/frames/last"] = frames
    out = pathlib.Path(work) / label
    stamp = _stamp(path, [settings, *options])
    record = out / "run.json"
    if not (record.exists() and json.loads(record.read_text())["stamp"] == stamp):
        command = [PROGRAM, "run", path, "-o", out, "--overwrite", "--progress", "none", *options]
        for pointer, value in settings.items():
            command += ["--set", f"{pointer}={json.dumps(value)}"]
        print(f"figures: {label}", file=sys.stderr, flush=True)
        before = _child_seconds()
        if not PROGRAM.exists():
            raise RunError(f"{PROGRAM}: not built (run tools/build release ringlet)")
        result = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
        if result.returncode not in (0, DIVERGED):
            raise RunError(f"{label}: exit code {result.returncode}: {result.stderr.strip()}")
        outcome = {"code": result.returncode, "stderr": result.stderr, "cpu_seconds": _child_seconds() - before}
        record.write_text(json.dumps({"stamp": stamp} | outcome))
    return Run(out)


def _child_seconds():
    """Processor time of the programs that were run so far, on all cores."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def named_files(path):
    """The files that a scene names and that are there."""

    def texts(value):
        if isinstance(value, str):
            yield value
        elif isinstance(value, (dict, list)):
            for each in value.values() if isinstance(value, dict) else value:
                yield from texts(each)

    names = {path.parent / text for text in texts(json.loads(path.read_text()))}
    return sorted(name for name in names if name.is_file())


def _stamp(path, settings):
    """Changes with the program, the settings, and the contents of the scene and of the files that it names."""
    files = [path, *named_files(path)]
    state = [PROGRAM.stat().st_size, PROGRAM.stat().st_mtime_ns]
    state += [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]
    return hashlib.sha256(json.dumps([state, settings], sort_keys=True).encode()).hexdigest()


class Run:
    """A finished or diverged run: its exit code, and what its cache holds."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        record = json.loads((self.directory / "run.json").read_text())
        self.code, self.log, self.cpu_seconds = record["code"], record["stderr"], record.get("cpu_seconds", np.nan)

    @property
    def diverged_frame(self):
        """The frame in which the run diverged, or None."""
        found = re.search(r"error: frame (-?\d+): the simulation diverged", self.log)
        return int(found[1]) if found else None

    @cached_property
    def cache(self):
        return StrandCache(self.directory / f"{self.scene_name}.h5")

    @cached_property
    def scene_name(self):
        masters = [path.name.removesuffix(".h5") for path in self.directory.glob("*.h5") if path.name.count(".") == 1]
        if len(masters) != 1:
            raise RunError(f"{self.directory}: {len(masters)} masters, expected 1")
        return masters[0]

    @cached_property
    def scene(self):
        """The scene as run, every default filled in."""
        with h5py.File(self.cache.header) as file:
            return json.loads(file["scene"][()])

    @cached_property
    def frames(self):
        return self.cache.frames()

    @property
    def times(self):
        """Seconds after the first frame."""
        return (np.array(self.frames) - self.scene["frames"]["first"]) / self.scene["frames"]["fps"]

    @property
    def counts(self):
        """Particles of each strand."""
        return np.diff(self.cache.offsets)

    @property
    def roots(self):
        return self.cache.offsets[:-1]

    @property
    def tips(self):
        return self.cache.offsets[1:] - 1

    @cached_property
    def strand(self):
        """[particles] index of each particle's strand."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def groom(self):
        """[strands] index of each strand's groom."""
        with h5py.File(self.cache.header) as file:
            return file["strands/groom"][:]

    @cached_property
    def rest_lengths(self):
        """[particles] rest length of the segment before each particle; 0 at roots."""
        return _segments(self.cache.rest_position, self.roots)

    @cached_property
    def lengths(self):
        """[strands] rest length of each strand's polyline."""
        return np.add.reduceat(self.rest_lengths, self.roots)

    def field(self, name, frame):
        """A field of a frame: position, velocity, elongation."""
        with h5py.File(self.directory / f"{self.scene_name}.{frame:04d}.h5") as file:
            return file[name][:].astype(float)

    def position(self, frame):
        return self.field("position", frame)

    def living(self, frame):
        """[particles] whether a particle is still on its strand: trimming cuts strands off at their tips."""
        with h5py.File(self.directory / f"{self.scene_name}.{frame:04d}.h5") as file:
            living = file["living"][:] if "living" in file else self.counts
        index = np.arange(len(self.cache.rest_position)) - np.repeat(self.roots, self.counts)
        return index < np.repeat(living, self.counts)

    def surfaces(self, frame):
        """[(vertices, triangles)] where cache.fields has `solids`."""
        return self.cache.frame(frame).surfaces

    def figure(self, name):
        """[frames] one of the solver's own figures (schemas/cache.md), NaN where a frame has none."""
        values = []
        for frame in self.frames:
            with h5py.File(self.directory / f"{self.scene_name}.{frame:04d}.h5") as file:
                values.append(float(file["figures"].attrs.get(name, np.nan)))
        return np.array(values)

    def worst(self, name):
        """Largest value of a solver's figure over all frames; 0 where no frame has it."""
        values = self.figure(name)
        return float(np.nanmax(values)) if np.isfinite(values).any() else 0.0

    @cached_property
    def milliseconds(self):
        """[steps] wall time of each stepped frame [ms]."""
        lines = (self.directory / f"{self.scene_name}.timings.jsonl").read_text().splitlines()
        seconds = {entry["frame"]: entry["seconds"] for entry in map(json.loads, lines)}
        return np.array([1e3 * seconds[frame] for frame in sorted(seconds) if frame > self.scene["frames"]["first"]])

    @property
    def core_milliseconds(self):
        """Processor time of a stepped frame, summed over cores, with its share of starting and writing."""
        return 1e3 * self.cpu_seconds / max(1, len(self.frames) - 1)

    # ---- Measures ----------------------------------------------------------------------------------------------------

    def carried_rest(self, frame, position=None):
        """The rest shape carried by the roots: rotated and moved as they are. With fewer than three roots that are not
        in a line only moved. The head must be rigid."""
        position = self.position(frame) if position is None else position
        rest = self.cache.rest_position.astype(float)
        rotation, translation = rigid_motion(rest[self.roots], position[self.roots])
        return rest @ rotation.T + translation

    def deviation(self, frame):
        """[particles] distance from the carried rest shape over the strand's rest length."""
        position = self.position(frame)
        away = np.linalg.norm(position - self.carried_rest(frame, position), axis=1)
        return away / np.repeat(self.lengths, self.counts)

    def tip_deviation(self, frame):
        """[strands]"""
        return self.deviation(frame)[self.tips]

    def edge_strain(self, frame):
        """[particles] (length / rest length - 1) of the segment before each particle; 0 at roots, on what is cut off,
        and in a scene with grooming for each strand's last segment, which a cut may have made shorter."""
        length, whole = _segments(self.position(frame), self.roots), self.living(frame)
        if self.scene["effects"].get("grooming"):
            whole &= np.append(whole[1:], False)
            whole[self.tips] = False
        return np.where(whole & (self.rest_lengths > 0), length / np.maximum(self.rest_lengths, 1e-30) - 1, 0)

    def speeds(self, frame):
        """[particles] Needs `velocity` in cache.fields."""
        return np.linalg.norm(self.field("velocity", frame), axis=1)

    def inside(self, frame, depth=0.0, solid=None):
        """[particles] whether a particle, roots excepted, is more than `depth` inside a solid (or inside number `solid`)
        as counted by crossings and not by the simulator's level sets. Needs `solids` in cache.fields."""
        from .inside import inside_solids

        surfaces = self.surfaces(frame)
        found = inside_solids(self.position(frame), surfaces if solid is None else surfaces[solid : solid + 1], depth)
        found[self.roots] = False
        found &= self.living(frame)
        return found

    def health(self, frames=None, depth=1e-4):
        """The numbers that every scene is held to, over all frames; particles inside are counted in `frames`."""
        frames = self.frames[1:] if frames is None else frames
        inside = {frame: int(self.inside(frame, depth).sum()) for frame in frames}
        worst = max(inside, key=inside.get)
        return {
            "strands": len(self.roots),
            "particles": len(self.cache.rest_position),
            "frames": len(self.frames),
            "substeps": self.scene["model"]["substeps"],
            "ms_per_frame_median": round(float(np.median(self.milliseconds)), 1),
            "core_ms_per_frame": round(self.core_milliseconds, 1),
            "edge_strain_free": self.worst("edge_strain_free"),
            "edge_strain_moved": self.worst("edge_strain_moved"),
            "edge_strain_moved_p999": self.worst("edge_strain_moved_p999"),
            "push_out_max_m": self.worst("push_out_max"),
            "speed_max": self.worst("speed_max"),
            "inside_depth_m": depth,
            "inside_worst": inside[worst],
            "inside_worst_frame": worst,
        }


def _segments(position, roots):
    length = np.zeros(len(position))
    length[1:] = np.linalg.norm(np.diff(position.astype(float), axis=0), axis=1)
    length[roots] = 0
    return length


def rigid_motion(before, after):
    """(rotation, translation) that carries `before` [n, 3] to `after` best in the least-squares sense (Kabsch)."""
    middle, now = before.mean(0), after.mean(0)
    u, spread, vt = np.linalg.svd((after - now).T @ (before - middle))
    if spread[1] < 1e-12 * max(spread[0], 1e-30) or spread[0] == 0:  # in a line or a point: no rotation to be seen
        rotation = np.eye(3)
    else:
        rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation, now - rotation @ middle


# ---- One figure --------------------------------------------------------------------------------------------------


class Figures:
    """What a figure's make() gets: runs, and where its pictures and numbers go."""

    def __init__(self, name, output, quick):
        self.name, self.output, self.quick = name, pathlib.Path(output), quick
        self.output.mkdir(parents=True, exist_ok=True)

    @property
    def look(self):
        """Options of pictures.render(): how fine."""
        return {"samples": 4 if self.quick else 24}

    def size(self, width, height=None):
        """Pixels of one picture, with --quick a third."""
        return tuple(side // 3 if self.quick else side for side in (width, height or width))

    def run(self, scene, label=None, overrides=None, frames=None, options=()):
        """run_scene; with --quick a tenth of the strands that the scene grows, unless `overrides` say how many."""
        overrides = dict(overrides or {})
        if self.quick:
            overrides = thinned(read_scene(scene), 0.1) | overrides
        folder = WORK / ("quick-runs" if self.quick else "runs")
        return run_scene(scene, f"{self.name}/{label or scene}", overrides, frames, folder, options)

    def path(self, suffix):
        """docs/figures/NAME + suffix, for instance '.png' or '_strain.png'."""
        return self.output / f"{self.name}{suffix}"

    def record(self, numbers):
        """Writes NAME.json: what was measured, and on what machine."""
        text = json.dumps({"machine": machine()} | _plain(copy.deepcopy(numbers)), indent=2)
        self.path(".json").write_text(text + "\n")


def machine():
    """The processor by its own name, and how many cores of it there are."""
    info = pathlib.Path("/proc/cpuinfo").read_text() if pathlib.Path("/proc/cpuinfo").exists() else ""
    name = re.search(r"model name\s*: (.+)", info)
    return f"{name[1] if name else 'unknown processor'}, {os.cpu_count()} cores"


def _plain(value):
    """Numbers for JSON: four significant digits, no numpy types; what is not finite as text."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(each) for each in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.4g}") if np.isfinite(value) else str(value)
    return value
