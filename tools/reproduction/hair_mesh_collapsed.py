"""Hair mesh: all vertices start on their roots, and the mesh comes back to where it hangs without that."""
import numpy as np

from . import pictures

SCENE = "hair_mesh/collapsed"
VARIANTS = {"from rest": {"/model/hair_mesh/start": "rest"}, "collapsed": {}}
FRAMES = [1, 2, 3, 5, 9, 121]
VIEW = (150, 8)


def make(figures):
    runs = {name: figures.run(SCENE, name.replace(" ", "_"), each) for name, each in VARIANTS.items()}
    seen = [(run, frame) for run in runs.values() for frame in FRAMES]
    camera = pictures.shared_camera(seen, VIEW, figures.size(210))
    rows = [pictures.strip(run, FRAMES, camera, f"{name}, frame", **figures.look) for name, run in runs.items()]
    pictures.save(pictures.sheet(rows), figures.path(".png"))

    def apart(frame):
        """Of particles in the two runs [m]."""
        return np.linalg.norm(runs["collapsed"].position(frame) - runs["from rest"].position(frame), axis=1)

    distances = {frame: apart(frame) for frame in runs["collapsed"].frames}
    longest = runs["collapsed"].lengths.max()

    def draw(ax):
        ax.semilogy(runs["collapsed"].times, [distance.max() / longest for distance in distances.values()], label="farthest")
        ax.semilogy(runs["collapsed"].times, [distance.mean() / longest for distance in distances.values()], label="mean")
        ax.set(xlabel="time [s]", ylabel="distance from the other run / length")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    last = runs["collapsed"].frames[-1]
    volumes = {name: run.figure("mesh_volume")[-1] for name, run in runs.items()}
    figures.record(
        {
            "apart_last_over_length": {"mean": distances[last].mean() / longest, "most": distances[last].max() / longest},
            "volume_over_rest_last": volumes,
            "volume_apart": volumes["collapsed"] / volumes["from rest"] - 1,
            "diverged_frame": {name: run.diverged_frame for name, run in runs.items()},
            "speed_most": {name: run.worst("mesh_speed") for name, run in runs.items()},
        }
    )
