"""Figure 10: a ride on a roller-coaster, permanent memory beside reversible, without softening, and mass springs."""
import numpy as np

from . import pictures
from .common import ROOT, Run, rigid_motion

ALL = 7500  # strands
FEW = 750  # of the comparisons
# Frame and what it shows.
MOMENTS = {1: "station", 72: "drop", 141: "loop", 205: "hill", 287: "corkscrew", 330: "brakes", 420: "after"}
VARIANTS = {
    "permanent": {},
    "reversible": {"/effects/non_hookean/memory": "reversible"},
    "Hookean": {"/effects/non_hookean": None},
    "MS": {"/model/type": "mass_spring", "/effects/non_hookean": None},
}
SCHEMES = ["projected", "paper"]
QUIET = 900  # the last frame of the comparisons: 23 s after the ride, since torn hair swings for long
TRANSITION, BREAK = 0.5, 1.0  # of the schema's curve
BEFORE, FLOATING = 56, 76  # frames: before the drop lifts the hair, and while it does
ARRIVED = 339  # the frame of the last key


class Ride(Run):
    """A run seen from the car: in the axes of the rest pose, where the head stands still."""

    def position(self, frame):
        position, rest = super().position(frame), self.cache.rest_position.astype(float)
        rotation, translation = rigid_motion(position[self.roots], rest[self.roots])
        return position @ rotation.T + translation

    def surfaces(self, frame):
        vertices, triangles = [], []
        for line in (ROOT / "scenes/assets/head.obj").read_text().splitlines():
            kind, *words = line.split()
            if kind == "v":
                vertices.append([float(word) for word in words])
            elif kind == "f":
                triangles.append([int(word) - 1 for word in words])
        return [(np.array(vertices), np.array(triangles))]


def ride(figures, variant, scheme, strands=FEW):
    overrides = VARIANTS[variant] | {"/model/scheme": scheme}
    if not figures.quick:
        overrides["/groom/grow/strands"] = strands
    label = f"{variant.lower()}_{scheme}" + ("_all" if strands == ALL else "")
    return Ride(figures.run("roller_coaster", label, overrides, None if strands == ALL else QUIET).directory)


def residual(one):
    """What is left of the style: deviation over strand length in the drop, on arrival and in the last frame, how still
    the hair is, and the share of particles that went beyond the transition and the break of the curve during the ride."""

    def mean(frame):
        return one.deviation(min(frame, one.frames[-1])).mean()

    farthest = np.max([one.deviation(frame) for frame in one.frames], axis=0)
    away = one.deviation(one.frames[-1])
    return {
        "diverged_frame": one.diverged_frame,
        "before_the_drop_mean": mean(BEFORE),
        "in_the_drop_mean": mean(FLOATING),
        "arrival_mean": mean(ARRIVED),
        "end_mean": away.mean(),
        "end_tips_mean": away[one.tips].mean(),
        "end_largest": away.max(),
        "end_speed_max": one.figure("speed_max")[-1],
        "beyond_transition": np.mean(farthest > TRANSITION),
        "beyond_break": np.mean(farthest > BREAK),
        "edge_strain_free": one.worst("edge_strain_free"),
        "edge_strain_moved": one.worst("edge_strain_moved"),
    }


def track(one):
    """The way of the keys, from standing to standing."""
    keys = one.scene["motion"]["keys"]
    at = np.array([key["translate"] for key in keys])
    return {
        "length_m": np.linalg.norm(np.diff(at, axis=0), axis=1).sum(),
        "height_m": np.ptp(at[:, 1]),
        "seconds": (keys[-1]["frame"] - keys[0]["frame"]) / one.scene["frames"]["fps"],
        "felt_g_largest": felt(one).max(),
        "felt_g_largest_10_times_as_fast": felt(one, 10).max(),
    }


def felt(one, speed=1):
    """[frames] what the rider feels, in g: from the keys, a frame apart; or of a ride so many times as fast."""
    frames, keys = np.array(one.frames), one.scene["motion"]["keys"]
    when = [key["frame"] for key in keys]
    at = np.stack([np.interp(frames, when, [key["translate"][k] for key in keys]) for k in range(3)], axis=1)
    fps = one.scene["frames"]["fps"]
    acceleration = np.gradient(np.gradient(at, 1 / fps, axis=0), 1 / fps, axis=0)
    return np.linalg.norm(speed**2 * acceleration + [0, 9.81, 0], axis=1) / 9.81


def pictured(figures, runs):
    """The moments of the ride from left to right, the variants down."""
    rest = next(iter(runs.values()))
    camera = pictures.shared_camera([(rest, 1), (rest, 205), (rest, 420)], (38, 6), figures.size(190), surfaces=False)
    rows = [
        [
            pictures.titled(pictures.render(one, frame, camera, **figures.look), f"{variant}\n{moment}")
            for frame, moment in MOMENTS.items()
        ]
        for variant, one in runs.items()
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))


def plots(figures, runs):
    """Mean deviation against time, and what the rider feels."""

    def draw(axes):
        for variant, one in runs.items():
            axes[0].plot(one.times, [one.deviation(frame).mean() for frame in one.frames], lw=1, label=variant)
        axes[0].set_ylabel("mean deviation / length")
        axes[0].legend(fontsize=8)
        axes[1].plot(one.times, felt(one), "k", lw=1)
        axes[1].set_ylabel("felt acceleration [g]")
        for ax in axes:
            ax.set_xlabel("time [s]")
            ax.set_xlim(0, 22)

    pictures.plot(figures.path("_plot.png"), draw, columns=2, width=9.5, height=3.6)


def make(figures):
    runs = {scheme: {variant: ride(figures, variant, scheme) for variant in VARIANTS} for scheme in SCHEMES}
    full = ride(figures, "permanent", "projected", ALL)
    pictured(figures, {"permanent, all": full, **runs["projected"]})
    plots(figures, runs["projected"])
    figures.record(
        {
            "full": full.health([1, 72, 141, 205, 287, 330, 420]) | residual(full),
            "track": track(full),
            "strands_compared": FEW,
            "compared": {
                f"{variant}, {scheme}": residual(one) for scheme in SCHEMES for variant, one in runs[scheme].items()
            },
        }
    )
