"""The largest stable step against stiffness: AMS beside mass springs, both schemes, lengths free, a shaken strand."""
import math

import numpy as np

from . import pictures

STIFFNESS = [10.0**power for power in range(3, 13)]
MODELS = {"ams": "AMS", "mass_spring": "MS"}
SCHEMES = ["paper", "projected"]
STEPS = np.geomspace(1 / 1920, 1 / 3, 26)  # [s] tried
SECONDS = 6
SHAKE = [(0.0, 0.0), (0.25, 0.05), (0.5, -0.05), (0.75, 0.0)]  # seconds, height of the root [m]
LIMITS = {"edge_strain": 1000, "speed": 100}  # soft springs sag far; what is unstable does not come to rest, or flies
REST = 0.05  # [m/s] root mean square speed of the last second; the shake moves roots at some 0.4


def run(figures, model, scheme, stiffness, step):
    """About 24 frames a second, of as many steps as that takes; fewer where a step is longer."""
    substeps = max(1, math.ceil(1 / (24 * step) - 1e-9))
    fps = 1 / (substeps * step)
    overrides = {f"/model/stiffness/{coupling}": stiffness for coupling in ("edge", "bend", "twist")}
    overrides |= {"/model/type": model, "/model/scheme": scheme, "/model/substeps": substeps, "/model/drag": 2}
    overrides |= {"/model/stiffness/angular": 100, "/frames/fps": fps, "/frames/last": 1 + math.ceil(SECONDS * fps)}
    keys = [{"frame": 1 + time * fps, "translate": [0, height, 0]} for time, height in SHAKE]
    overrides |= {"/groom/animation": {"keys": keys}, "/limits": LIMITS}
    label = f"{model}_{scheme}_{stiffness:.0e}_{step:.3e}"
    return figures.run("single_strand", label, overrides, options=["--precision", "double", "--backend", "cpu"])


def is_stable(figures, *what):
    """Whether the strand stays within the limits and comes to rest."""
    one = run(figures, *what)
    if one.code != 0:
        return False
    late = [frame for frame, time in zip(one.frames, one.times) if time > SECONDS - 1]
    return bool(np.sqrt(np.mean([one.speeds(frame) ** 2 for frame in late])) < REST)


def largest_step(figures, *what):
    """The last step of STEPS before the first unstable one, by bisection; 0 where the shortest is unstable."""
    stable, unstable = -1, len(STEPS)
    while unstable - stable > 1:
        middle = (stable + unstable) // 2
        if is_stable(figures, *what, STEPS[middle]):
            stable = middle
        else:
            unstable = middle
    return float(STEPS[stable]) if stable >= 0 else 0.0


def make(figures):
    rows = [
        {"model": model, "scheme": scheme, "kappa_L": stiffness, "largest_stable_step": largest_step(figures, model, scheme, stiffness)}
        for model in MODELS
        for scheme in SCHEMES
        for stiffness in STIFFNESS
    ]

    def draw(ax):
        for model, colour in zip(MODELS, ("C0", "C3")):
            for scheme, style in zip(SCHEMES, ("o:", "s-")):
                mine = [row for row in rows if row["model"] == model and row["scheme"] == scheme]
                steps = [max(row["largest_stable_step"], 0.7 * STEPS[0]) for row in mine]
                ax.plot([row["kappa_L"] for row in mine], steps, colour + style, ms=4, label=f"{MODELS[model]}, {scheme}")
        for steps in (24, 60, 192):
            ax.axhline(1 / steps, color="0.7", lw=0.8)
            ax.text(1.1e3, 1 / steps * 1.04, f"1/{steps} s", fontsize=7, color="0.4")
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_xlabel("stiffness of springs [1/s²]")
        ax.set_ylabel("largest stable step [s]")
        ax.legend(fontsize=8)

    pictures.plot(figures.path(".png"), draw)
    figures.record({"steps": STEPS, "seconds": SECONDS, "limits": LIMITS, "rest": REST, "table": rows})
