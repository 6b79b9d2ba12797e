"""Hair against hair: a lock falls across another one, with nothing between them, the grid, the contacts, and both."""
import numpy as np

from . import pictures
from .crossings import went_through

VARIANTS = {
    "off": {"/effects/hair_hair": None},
    "grid": {"/effects/hair_hair/contacts": None},
    "contacts": {"/effects/hair_hair/grid": None},
    "both": {},
}
FRAMES = [1, 3, 5, 10, 20, 49]
LYING, FALLING = 0, 1  # grooms
VIEW = (60, 15)
REST = 24  # frames at the end whose motion is told


def make(figures):
    runs = {name: figures.run("hair_hair/two_locks", name, settings) for name, settings in VARIANTS.items()}
    shown = [(run, frame) for run in runs.values() for frame in FRAMES]
    camera = pictures.shared_camera(shown, VIEW, figures.size(200, 290))
    rows = [pictures.strip(run, FRAMES, camera, f"{name}, frame", **figures.look) for name, run in runs.items()]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    passed = {name: went_through(run, LYING, FALLING) for name, run in runs.items()}

    def draw(ax):
        for name, run in runs.items():
            ax.plot(run.frames, [100 * value / pairs(run) for value in passed[name]["net"].values()], label=name)
        ax.set_xlabel("frame")
        ax.set_ylabel("pairs of strands on the wrong side [%]")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    figures.record({"pairs": pairs(runs["off"])} | {name: numbers(run, passed[name]) for name, run in runs.items()})


def pairs(run):
    """Of a strand of one lock and one of the other."""
    return int((run.groom == LYING).sum() * (run.groom == FALLING).sum())


def numbers(run, passed):
    last = run.frames[-1]
    falling = run.groom[run.strand] == FALLING
    speeds = np.array([run.speeds(frame)[falling] for frame in run.frames[-REST:]])
    frames = [frame for frame in FRAMES if frame > run.frames[0]]
    return {
        "pairs_through_at_end": passed["net"][last],
        "pairs_ever_through": passed["ever"][last],
        "pairs_through": {frame: passed["net"][frame] for frame in frames},
        "speed_at_end_median": np.median(speeds),
        "speed_at_end_p99": np.percentile(speeds, 99),
        "health": run.health(frames),
    }
