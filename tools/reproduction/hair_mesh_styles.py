"""Hair mesh: what a frame's time goes into, and whether hair comes back from ten times the speed, for nine styles."""
import json
import subprocess

import numpy as np

from . import common, pictures

SCENE = "hair_mesh/walk"
HEAD = common.ROOT / "scenes" / "assets" / "head.obj"
STYLES, RESOLUTIONS = ("short", "shoulder", "long"), ("low", "medium", "high")
STAGES = {"forces": "forces", "solve": "conjugate gradients", "solids": "collisions", "minimisation": "minimisation"}
STRANDS = 600  # they take no part in the mesh's motion


def make(figures):
    numbers = {}
    for style in STYLES:
        for resolution in RESOLUTIONS:
            numbers[f"{style} {resolution}"] = measure(figures, style, resolution)
    draw_shares(figures, numbers)
    figures.record(numbers)


def measure(figures, style, resolution):
    name = f"{style}_{resolution}"
    work = common.WORK / "hair_mesh_styles"
    work.mkdir(parents=True, exist_ok=True)
    mesh, trace = work / f"{name}.json", work / f"{name}.trace.json"
    command = [common.PROGRAM, "-q", "groom", "hair-mesh", HEAD, "--mesh", "scalp", "--style", style]
    subprocess.run([*map(str, command), "--resolution", resolution, "-o", str(mesh)], check=True, stdout=subprocess.DEVNULL)
    hair = {"/groom/hair_mesh/file": str(mesh), "/groom/hair_mesh/strands": STRANDS}
    walk = figures.run(SCENE, name, hair, options=["--trace", str(trace)])
    fast = figures.run(SCENE, f"{name}_10_x", hair | {"/motion/speed": 10})
    last = walk.frames[-1]
    finished = fast.diverged_frame is None
    apart = np.linalg.norm(fast.position(last) - walk.position(last), axis=1) / walk.lengths.max() if finished else [np.nan]
    return {
        "vertices": sum(map(len, json.loads(mesh.read_text())["layers"])),
        "ms_per_frame": stage_milliseconds(trace, len(walk.frames) - 1),
        "iterations_mean": float(np.mean(walk.figure("mesh_iterations")[1:])),
        "iterations_most": walk.worst("mesh_iterations"),
        "10 x": {
            "diverged_frame": fast.diverged_frame,
            "apart_last_over_length": {"mean": np.mean(apart), "most": np.max(apart)},
            "volume_last_over_walk": fast.figure("mesh_volume")[-1] / walk.figure("mesh_volume")[-1],
        },
    }


def stage_milliseconds(trace, frames):
    """Mean time of a frame in each stage of the mesh [ms]."""
    events = json.loads(trace.read_text())["traceEvents"]
    total = dict.fromkeys(STAGES, 0.0)
    for event in events:
        if event.get("ph") == "X" and event["name"] in total:
            total[event["name"]] += event["dur"]
    return {stage: 1e-3 * spent / frames for stage, spent in total.items()}


def draw_shares(figures, numbers):
    def draw(ax):
        left = np.zeros(len(numbers))
        labels = [f"{name}, {one['vertices']:,}" for name, one in numbers.items()]
        for stage, label in STAGES.items():
            shares = np.array([100 * one["ms_per_frame"][stage] / sum(one["ms_per_frame"].values()) for one in numbers.values()])
            ax.barh(labels, shares, left=left, label=label)
            left += shares
        ax.invert_yaxis()
        ax.set(xlabel="share of a frame's time in the mesh [%]", xlim=(0, 100))
        ax.legend(fontsize=7, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))

    pictures.plot(figures.path(".png"), draw)
