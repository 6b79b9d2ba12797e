"""Figure 9: a beard on a head that nods and turns, AMS beside mass springs."""
import numpy as np

from . import pictures

FRAMES = [1, 13, 27, 42, 53, 121]
STILL = 13  # the frame until which the head stands
MODELS = {"ams": "AMS", "mass_spring": "MS"}
SCHEMES = ["projected", "paper"]


def run(figures, model, scheme="projected"):
    return figures.run("beard", f"{model}_{scheme}", {"/model/type": model, "/model/scheme": scheme})


def shape(one):
    """Mean deviation from the rest shape that the head carries, over strand length."""
    mean = np.array([one.deviation(frame).mean() for frame in one.frames])
    moving = (np.array(one.frames) > STILL) & (np.array(one.frames) <= 65)
    return {
        "before_motion": mean[STILL - one.frames[0]],
        "while_moving_mean": mean[moving].mean(),
        "end": mean[-1],
        "end_tips": one.tip_deviation(one.frames[-1]).mean(),
        "end_largest": one.deviation(one.frames[-1]).max(),
    }


def make(figures):
    runs = {(model, scheme): run(figures, model, scheme) for scheme in SCHEMES for model in MODELS}
    shown = [(runs[model, "projected"], frame) for model in MODELS for frame in FRAMES]
    camera = pictures.shared_camera(shown, (38, 4), figures.size(230), surfaces=False)
    rows = [
        pictures.strip(runs[model, "projected"], FRAMES, camera, f"{label}, frame", **figures.look)
        for model, label in reversed(MODELS.items())
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))

    def draw(ax):
        for (model, scheme), one in runs.items():
            mean = [one.deviation(frame).mean() for frame in one.frames]
            ax.plot(one.times, mean, "-" if scheme == "projected" else ":", label=f"{MODELS[model]}, {scheme}")
        ax.set_xlabel("time [s]")
        ax.set_ylabel("mean deviation / length")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    figures.record(
        {
            f"{model}, {scheme}": {"shape": shape(one), "health": one.health(FRAMES[1:])}
            for (model, scheme), one in runs.items()
        }
    )
