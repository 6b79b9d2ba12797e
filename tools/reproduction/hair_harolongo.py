"""Hair against hair: a dense real groom on a head that shakes: off, the grid, the grid with contacts; its volume."""
import sys

import numpy as np

from . import pictures
from .common import read_scene, scene_path
from .density import over_target, volume

SCENE = "real/harolongo"
VARIANTS = {"off": None, "grid": {"grid": {}}, "grid and contacts": {"grid": {}, "contacts": {}}}
FRAMES = [1, 8, 15, 22]
VIEW = (25, 6)
DEPTH = 0.01  # [cm] that a particle may be inside the head
VOXEL = 0.3  # [cm], edge of the cubes that the volume is counted by


def make(figures):
    if not (scene_path(SCENE).parent / read_scene(SCENE)["groom"]["file"]).exists():
        print(f"{figures.name}: left out, its groom is not here (scenes/real/README.md)", file=sys.stderr)
        return
    frames = 15 if figures.quick else None
    runs = {
        name: figures.run(SCENE, name.replace(" ", "_"), {"/effects/hair_hair": block}, frames)
        for name, block in VARIANTS.items()
    }
    shown = [frame for frame in FRAMES if frame <= runs["off"].frames[-1]]
    seen = [(run, frame) for run in runs.values() for frame in shown]
    camera = pictures.shared_camera(seen, VIEW, figures.size(260))
    rows = [pictures.strip(run, shown, camera, f"{name}, frame", **figures.look) for name, run in runs.items()]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    volumes = {name: np.array([volume(run, frame, VOXEL) for frame in run.frames]) for name, run in runs.items()}

    def draw(ax):
        for name, run in runs.items():
            ax.plot(run.times, volumes[name], label=name)
        ax.set_xlabel("time [s]")
        ax.set_ylabel("volume [cm³]")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    figures.record({"voxel_cm": VOXEL} | {name: numbers(run, volumes, name, shown) for name, run in runs.items()})


def numbers(run, volumes, name, shown):
    over_off = volumes[name] / volumes["off"] - 1
    return {
        "volume_first_cm3": volumes[name][0],
        "volume_least_cm3": volumes[name].min(),
        "volume_mean_cm3": volumes[name].mean(),
        "volume_last_cm3": volumes[name][-1],
        "volume_over_off": {"mean": over_off.mean(), "least": over_off.min(), "most": over_off.max()},
        "over_target": over_target(run, run.frames[7::7]),  # by frame: the largest, share of the hair over 1.5
        "health": run.health(shown[1:], DEPTH) | {"inside_depth_m": DEPTH / 100},
    }
