"""Figure 6: a curly wig in wind, 1,024 strands beside all 10,422, and at rest without wind."""
import numpy as np

from . import pictures
from .common import grooms_of, read_scene

FRAMES = [1, 10, 20, 40, 70]
FEW = 1024


def few_strands():
    """Overrides that leave FEW strands, shared by the wig's grooms as all of them are."""
    grooms = grooms_of(read_scene("wig"))
    counts = np.array([groom["grow"]["strands"] for _, groom in grooms])
    parts = np.round(FEW * counts / counts.sum()).astype(int)
    parts[-1] = FEW - parts[:-1].sum()
    return {f"{pointer}/grow/strands": int(part) for (pointer, _), part in zip(grooms, parts)}


def make(figures):
    full = figures.run("wig")
    few = figures.run("wig", "wig_1024", few_strands())
    still = figures.run("wig", "wig_still", {"/effects/wind": None})
    camera = pictures.shared_camera([(full, frame) for frame in FRAMES], (20, 8), figures.size(250))
    rows = [
        pictures.strip(run, FRAMES, camera, f"{len(run.roots):,}, frame", **figures.look) for run in (few, full)
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    figures.record(
        {
            "full": full.health(FRAMES[1:]),
            "few": few.health(FRAMES[1:]),
            "ms_ratio": float(np.median(full.milliseconds) / np.median(few.milliseconds)),
            "particle_ratio": len(full.cache.rest_position) / len(few.cache.rest_position),
            "still_tip_sag_m": sag(still),
        }
    )


def sag(run):
    """How far the tips sink in a run in which nothing moves."""
    frame = run.frames[-1]
    down = (run.cache.rest_position - run.position(frame))[run.tips, 1]
    return {"median": np.median(down), "largest": down.max(), "after_s": run.times[-1]}
