"""Hair mesh: a mannequin walks and turns, at its speed and ten times as fast, with and without minimisation."""
import numpy as np

from . import pictures

SCENE = "hair_mesh/walk"
MINIMISE = "/model/hair_mesh/deformation_minimisation"
VARIANTS = {
    "walk": {},
    "10 x": {"/motion/speed": 10},
    "10 x, not minimised": {"/motion/speed": 10, MINIMISE: False},
}
FRAMES = [1, 5, 9, 13, 23, 145]  # of the fast ones, whose head stands from frame 11 on; the walk is seen when it is as far
VIEW = (150, 8)


def make(figures):
    runs = {name: figures.run(SCENE, name.replace(",", "").replace(" ", "_"), each) for name, each in VARIANTS.items()}
    rows = [
        [
            pictures.titled(
                pictures.render(run, frame, pictures.shared_camera([(run, frame)], VIEW, figures.size(210)), **figures.look),
                f"{name}, frame {frame}",
            )
            for frame in (FRAMES if run is not runs["walk"] else [1, 33, 49, 65, 89, 145])
        ]
        for name, run in runs.items()
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))

    def draw(ax):
        for name, run in runs.items():
            ax.plot(run.times, run.figure("mesh_volume"), label=name)
        ax.set(xlabel="time [s]", ylabel="volume / rest volume")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    figures.record({name: numbers(run, runs["walk"]) for name, run in runs.items()})


def back(volume):
    """The first frame from which on the volume is within 2 % of the last frame's."""
    away = np.abs(volume / volume[-1] - 1) > 0.02
    return int(np.flatnonzero(away)[-1]) + 2 if away.any() else 1


def numbers(run, walk):
    """`apart`: of particles from those of the walk when both stand still, over the longest strand."""
    last = run.frames[-1]
    apart = np.linalg.norm(run.position(last) - walk.position(last), axis=1) / walk.lengths.max()
    volume = run.figure("mesh_volume")
    return {
        "diverged_frame": run.diverged_frame,
        "volume_over_rest": {"least": volume.min(), "most": volume.max(), "last": volume[-1]},
        "volume_back_within_2_percent_frame": back(volume),
        "apart_from_walk_last": {"mean": apart.mean(), "most": apart.max()},
        "mesh_strain_most": run.worst("mesh_strain"),
        "speed_most": run.worst("mesh_speed"),
        "iterations_mean": float(np.mean(run.figure("mesh_iterations")[1:])),
        "iterations_most": run.worst("mesh_iterations"),
        "residual_most": run.worst("mesh_residual"),
        "ms_per_frame_median": float(np.median(run.milliseconds)),
    }
