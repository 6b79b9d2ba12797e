"""Hair against hair: a hand closes on a bundle of 1,200 strands: how dense it gets, with the grid and without."""
import numpy as np

from . import pictures
from .density import over_target

SCENE = "hair_hair/squeezed_bundle"
GRID = "/effects/hair_hair/grid"
VARIANTS = {
    "off": {"/effects/hair_hair": None},
    "once a frame": {f"{GRID}/cadence": "frame", f"{GRID}/passes": 1},
    "each substep": {f"{GRID}/passes": 1},
    "each substep, 4 passes": {},
}
SHOWN = {"off": "off", "each substep, 4 passes": "grid"}  # and what they are called in the pictures
FRAMES = [1, 13, 25, 73]
BOUND = 1.5  # times its target, that no cell may hold more than
HELD = 49  # the hand has been closed for a second
VIEW = (25, 12)
CUT = -0.1  # height of the section [m]: the middle of the hand


def make(figures):
    runs = {name: figures.run(SCENE, name.replace(",", "").replace(" ", "_"), each) for name, each in VARIANTS.items()}
    shown = [(runs[name], frame) for name in SHOWN for frame in FRAMES]
    camera = pictures.shared_camera(shown, VIEW, figures.size(220, 300))
    rows = [
        pictures.strip(runs[name], FRAMES, camera, f"{label}, frame", **figures.look) for name, label in SHOWN.items()
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    pictures.plot(figures.path("_section.png"), lambda axes: sections(axes, runs), columns=3, width=8, height=3.2)
    density = {name: over_target(run, run.frames) for name, run in runs.items()}

    def draw(ax):
        for name, by_frame in density.items():
            ax.plot(list(by_frame), [largest for largest, _ in by_frame.values()], label=name)
        ax.axhline(BOUND, color="0.4", linestyle=":")
        ax.set_ylim(0.9, None)
        ax.set_xlabel("frame")
        ax.set_ylabel("largest density / target")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    figures.record({"bound": BOUND} | {name: numbers(run, density[name]) for name, run in runs.items()})


def sections(axes, runs):
    """Bundle and hand cut at CUT, seen from above: at rest, and in the last frame without the grid and with it."""
    cuts = [("at rest", runs["off"], FRAMES[0])]
    cuts += [(f"{label}, frame {FRAMES[-1]}", runs[name], FRAMES[-1]) for name, label in SHOWN.items()]
    for ax, (title, run, frame) in zip(axes, cuts):
        for vertices, _ in run.surfaces(frame):
            near = 1e3 * vertices[abs(vertices[:, 1] - CUT) < 2e-3]
            ax.plot(near[:, 0], near[:, 2], ".", color="0.75", markersize=2)
        hair = 1e3 * crossed(run, frame)
        ax.plot(hair[:, 0], hair[:, 2], ".", color="saddlebrown", markersize=1.5)
        ax.set_aspect("equal")
        ax.set(xlim=(-34, 34), ylim=(-34, 34), title=title, xlabel="[mm]")


def crossed(run, frame):
    """[n, 3] where segments come down through CUT."""
    position = run.position(frame)
    after = np.setdiff1d(np.arange(len(position)), run.roots)
    a, b = position[after - 1], position[after]
    through = (a[:, 1] > CUT) & (b[:, 1] <= CUT)
    a, b = a[through], b[through]
    return a + ((CUT - a[:, 1]) / (b[:, 1] - a[:, 1]))[:, None] * (b - a)


def numbers(run, density):
    held = {frame: each for frame, each in density.items() if frame >= HELD}
    return {
        "largest_over_target": {frame: density[frame][0] for frame in FRAMES},
        "largest_over_target_held": max(largest for largest, _ in held.values()),
        "share_of_hair_over_bound_held": max(share for _, share in held.values()),
        "flicker_p99_m": flicker(run),
        "grid_iterations_a_frame_worst": run.worst("grid_iterations"),
        "grid_residual_worst": run.worst("grid_residual"),
        "health": run.health(FRAMES[1:]),
    }


def flicker(run):
    """99th percentile of the particles' second differences from frame to frame while the hand is held."""
    position = np.array([run.position(frame) for frame in run.frames if frame >= HELD])
    return np.percentile(np.linalg.norm(np.diff(position, 2, axis=0), axis=2), 99)
