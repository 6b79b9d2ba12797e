"""Figure 1, left: long hair in strong wind, 14,718 strands."""
import numpy as np

from . import pictures

FRAMES = [1, 8, 14, 24, 40, 60]


def make(figures):
    run = figures.run("wind")
    camera = pictures.shared_camera([(run, frame) for frame in FRAMES], (20, 8), figures.size(280))
    row = pictures.strip(run, FRAMES, camera, "frame", **figures.look)
    pictures.save(pictures.sheet([row[:3], row[3:]]), figures.path(".png"))

    wind = np.array(run.scene["effects"]["wind"]["keys"][-1]["velocity"])
    wind /= np.linalg.norm(wind)
    downwind = [(run.position(frame) - run.carried_rest(frame))[run.tips] @ wind for frame in run.frames]
    steady = np.array([np.median(tips) for tips in downwind])[run.times > 1]
    figures.record(
        run.health(FRAMES[1:])
        | {"tips_downwind_m": {"median": steady.mean(), "least": steady.min(), "most": steady.max()}}
        | {"tips_that_moved_downwind": np.mean(downwind[-1] > 0)}
    )
