"""Tables of grown hair for figures 13 and 14: one parameter across, the step length down."""
import numpy as np

from . import pictures

STEPS = (0.003, 0.006, 0.009)  # [m]


def table(figures, parameter, name, values):
    """Renders the table and returns each cell's measures. `parameter`: key of the scene's grow block."""
    runs = [[cell(figures, parameter, value, step) for value in values] for step in STEPS]
    every = [(run, 1) for row in runs for run in row]
    camera = pictures.shared_camera(every, (38, 6), figures.size(230))
    rows = [
        [
            pictures.titled(
                pictures.render(run, 1, camera, **figures.look), f"{name} {value:g}, step {1e3 * step:g} mm"
            )
            for run, value in zip(row, values)
        ]
        for row, step in zip(runs, STEPS)
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    return [
        {parameter: value, "step": step} | shape(run)
        for row, step in zip(runs, STEPS)
        for run, value in zip(row, values)
    ]


def cell(figures, parameter, value, step):
    """Frame 1 alone: what is grown, before it moves."""
    label = f"{parameter}_{value:g}_step_{1e3 * step:g}"
    return figures.run("growth", label, {f"/groom/grow/{parameter}": value, "/groom/grow/step": step}, frames=1)


def shape(run):
    """Mean length, end to end distance over length (1 is straight), and how far the tips are below their roots."""
    rest = run.cache.rest_position.astype(float)
    across = rest[run.tips] - rest[run.roots]
    return {
        "length_m": run.lengths.mean(),
        "straightness": (np.linalg.norm(across, axis=1) / run.lengths).mean(),
        "drop_over_length": (-across[:, 1] / run.lengths).mean(),
    }
