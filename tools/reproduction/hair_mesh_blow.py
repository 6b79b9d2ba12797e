"""Hair mesh: a ball is struck into a hanging lock within one frame, with and without deformation minimisation."""
from . import pictures

SCENE = "hair_mesh/blow"
VARIANTS = {"minimised": {}, "not minimised": {"/model/hair_mesh/deformation_minimisation": False}}
BLOW = 49  # the frame in which the ball is in the lock
FRAMES = [BLOW - 1, BLOW, BLOW + 1, BLOW + 2, BLOW + 24]
VIEW = (0, 5)


def make(figures):
    runs = {name: figures.run(SCENE, name.replace(" ", "_"), each) for name, each in VARIANTS.items()}
    seen = [(run, frame) for run in runs.values() for frame in FRAMES]
    camera = pictures.shared_camera(seen, VIEW, figures.size(210, 300))
    rows = [pictures.strip(run, FRAMES, camera, f"{name}, frame", **figures.look) for name, run in runs.items()]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    # Against what the lock has with the ball in it when all is still.
    settled = runs["minimised"].figure("mesh_volume")[-1]
    volumes = {name: run.figure("mesh_volume") / settled for name, run in runs.items()}

    def draw(ax):
        for name, volume in volumes.items():
            ax.plot(runs[name].frames[BLOW - 5 : BLOW + 15], volume[BLOW - 5 : BLOW + 15], ".-", label=name)
        ax.axhspan(0.98, 1.02, alpha=0.15, label="within 2 %")
        ax.set(xlabel="frame", ylabel="volume / settled volume")
        ax.legend(fontsize=8)

    pictures.plot(figures.path("_plot.png"), draw)
    figures.record(
        {
            name: {
                "volume_over_settled": {f"frame {BLOW + k}": volume[BLOW - 1 + k] for k in range(5)},
                "depth_most": runs[name].worst("mesh_depth"),
                "corrected_most": runs[name].worst("mesh_corrected"),
            }
            for name, volume in volumes.items()
        }
    )
