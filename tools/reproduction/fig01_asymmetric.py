"""Figure 1, middle: one side long, one side short, the head shaking; AMS beside mass-spring, in both schemes."""
import numpy as np

from . import pictures

FRAMES = [1, 9, 17, 25, 72]
MODELS = {"ams": "AMS", "mass_spring": "MS"}
SCHEMES = ("projected", "paper")


def make(figures):
    runs = {
        (model, scheme): figures.run("asymmetric", f"{model}_{scheme}", {"/model/type": model, "/model/scheme": scheme})
        for model in MODELS
        for scheme in SCHEMES
    }
    first = runs["ams", "projected"]
    camera = pictures.shared_camera([(first, frame) for frame in FRAMES], (-28, 6), figures.size(250))
    rows = [
        pictures.strip(runs[model, "projected"], FRAMES, camera, name, **figures.look) for model, name in MODELS.items()
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))

    curves = {key: deviations(run) for key, run in runs.items()}
    pictures.plot(figures.path("_deviation.png"), lambda axes: draw(axes, first.times, curves), columns=2, width=8)
    summaries = {" ".join(key): summary(runs[key], curves[key]) for key in runs}
    figures.record({"health": first.health(FRAMES[1:]), "runs": summaries})


def deviations(run):
    """[frames, 2] mean deviation from the carried rest shape over the strand's length: long side, short side."""
    groom = np.repeat(run.groom, run.counts)
    free = np.ones(len(groom), bool)
    free[run.roots] = False
    each = [run.deviation(frame) for frame in run.frames]
    return np.array([[deviation[free & (groom == side)].mean() for side in (0, 1)] for deviation in each])


def summary(run, curve):
    still = run.times[: len(curve)] > 2.25  # the head stands still from 1.33 s on
    long, short = curve[still].mean(0) if still.any() else (np.nan, np.nan)
    return {
        "short_side_shaking_mean": curve[:, 1].mean(),
        "short_side_after": short,
        "long_side_after": long,
        "diverged_frame": run.diverged_frame,
        "edge_strain": max(run.worst("edge_strain_free"), run.worst("edge_strain_moved")),
        "speed_max": run.worst("speed_max"),
    }


def draw(axes, times, curves):
    for side, (each, title) in enumerate(zip(axes, ("long side", "short side"))):
        for (model, scheme), curve in curves.items():
            style = "-" if scheme == "projected" else "--"
            colour = "tab:blue" if model == "ams" else "tab:red"
            percent, label = 100 * curve[:, side], f"{MODELS[model]}, {scheme}"
            each.plot(times[: len(curve)], percent, style, color=colour, label=label)
        each.set(title=title, xlabel="time [s]", ylabel="mean deviation [% of strand]", ylim=(0, None))
    axes[1].legend(fontsize=8)
