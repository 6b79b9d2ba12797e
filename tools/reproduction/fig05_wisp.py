"""Figure 5: a wisp moved to and fro without integrity, its angular coupling falling to nothing, both schemes."""
import numpy as np

from . import pictures
from .common import read_scene

ANGULAR = [1e4, 1e3, 1e2, 1e1, 1, 0]
SCHEMES = ["paper", "projected"]
FPS = 30  # written; steps a second are a multiple
STEPS = [30, 60, 120, 240, 480, 960]  # a second, for the largest stable step
STRAIN = 0.1  # of an edge, which a stable run keeps under
SHOWN = 53  # the frame of the pictures: the end of the third swing


def settings(model, scheme, angular, steps=60):
    """The scene with FPS frames a second; its keys keep their times."""
    scene = read_scene("wisp")
    slower = scene["frames"]["fps"] / FPS

    def at(frame):
        return 1 + (frame - 1) / slower

    return {
        "/model/type": model, "/model/scheme": scheme, "/model/stiffness/angular": angular, "/limits/edge_strain": 10,
        "/frames/fps": FPS, "/frames/last": round(at(scene["frames"]["last"])), "/model/substeps": steps // FPS,
        "/groom/animation/keys": [key | {"frame": at(key["frame"])} for key in scene["groom"]["animation"]["keys"]],
    }


def run(figures, model, scheme, angular, steps=60):
    return figures.run("wisp", f"{model}_{scheme}_{angular:g}_{steps}", settings(model, scheme, angular, steps))


def measures(run):
    """Worst strain while it moves and at the end, speed and shape when it should hang still again."""
    strain = run.figure("edge_strain_free")
    speed = np.sqrt(np.mean([(run.speeds(frame) ** 2).mean() for frame in run.frames[-FPS:]]))
    away = run.deviation(run.frames[-1])
    return {
        "diverged_frame": run.diverged_frame,
        "edge_strain_max": np.nanmax(strain),
        "edge_strain_last_second": np.nanmax(strain[-FPS:]),
        "speed_rms_last_second": speed,
        "speed_max": run.worst("speed_max"),
        "deviation_mean_end": away.mean(),
        "tip_deviation_mean_end": away[run.tips].mean(),
    }


def largest_step(figures, model, scheme, angular):
    """The largest of the steps [s] at which, and at every smaller one, no edge strains more than STRAIN; None: none."""
    stable = None
    for steps in reversed(STEPS):
        one = run(figures, model, scheme, angular, steps)
        if one.code != 0 or one.worst("edge_strain_free") > STRAIN:
            break
        stable = 1 / steps
    return stable


def table(figures):
    rows = []
    for model, couplings in (("ams", ANGULAR), ("mass_spring", [0])):
        for scheme in SCHEMES:
            for angular in couplings:
                row = {"model": model, "scheme": scheme, "kappa_alpha": angular}
                row |= measures(run(figures, model, scheme, angular))
                rows.append(row | {"largest_stable_step_s": largest_step(figures, model, scheme, angular)})
    return rows


def sweep(figures):
    """The wisp in mid-swing: the schemes down, kappa_alpha falling from left to right."""
    runs = [[run(figures, "ams", scheme, angular) for angular in ANGULAR] for scheme in SCHEMES]
    camera = pictures.shared_camera([(one, SHOWN) for row in runs for one in row], (20, 5), figures.size(190, 330))
    rows = [
        [
            pictures.titled(pictures.render(one, SHOWN, camera, **figures.look), f"{scheme}\nkappa_alpha {angular:g}")
            for one, angular in zip(row, ANGULAR)
        ]
        for row, scheme in zip(runs, SCHEMES)
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))


def plots(figures):
    """Worst edge strain and root mean square speed against time."""

    def draw(axes):
        for scheme, style in zip(SCHEMES, ("-", ":")):
            for number, angular in enumerate((1e4, 1e3, 1e2, 0)):
                one = run(figures, "ams", scheme, angular)
                speed = [np.sqrt((one.speeds(frame) ** 2).mean()) for frame in one.frames]
                label = f"{scheme} {angular:g}"
                axes[0].plot(one.times, one.figure("edge_strain_free"), f"C{number}{style}", lw=0.9, label=label)
                axes[1].plot(one.times, np.maximum(speed, 1e-5), f"C{number}{style}", lw=0.9)
        for ax, label in zip(axes, ("largest edge strain", "RMS speed [m/s]")):
            ax.set_yscale("log")
            ax.set_xlabel("time [s]")
            ax.set_ylabel(label)
        axes[0].set_ylim(1e-5, 10)
        axes[0].legend(fontsize=7, title="scheme, kappa_alpha", title_fontsize=7, ncols=2, loc="lower right")

    pictures.plot(figures.path("_plot.png"), draw, columns=2, width=9.5, height=3.6)


def make(figures):
    sweep(figures)
    plots(figures)
    figures.record({"as_stated": figures.run("wisp").health([361]), "table": table(figures)})
