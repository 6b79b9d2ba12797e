"""Figure 7: a hand sweeps through long hair: all strands simulated, and skinned to 2,048 and to 128 guides."""
import numpy as np

from . import pictures

GUIDES = (None, 2048, 128)
FRAMES = [20, 32, 46, 58]
COUNTED = range(18, 61, 3)  # frames in which the hand is in the hair
HAND = 1  # solid; 0 is the head
DEPTHS = (1e-4, 1e-3, 5e-3)  # [m]
VIEW = (120, 12)


def make(figures):
    runs = {count: figures.run("hand", name(count), settings(count, figures.quick)) for count in GUIDES}
    everything = runs[None]
    camera = pictures.shared_camera([(everything, frame) for frame in FRAMES], VIEW, figures.size(260))
    rows = [pictures.strip(run, FRAMES, camera, f"{name(count)}, frame", **figures.look) for count, run in runs.items()]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    pictures.save(close_up(figures, runs), figures.path("_close.png"))
    figures.record(
        {"health": everything.health(COUNTED)}
        | {name(count): penetration(run) | {"ms_per_frame_median": np.median(run.milliseconds)} for count, run in runs.items()}
    )


def name(count):
    return f"{count:,} guides" if count else "all strands"


def settings(count, quick):
    return {"/groom/interpolate": {"count": count // 10 if quick else count}} if count else {}


def close_up(figures, runs):
    """The fingers in the hair, seen from the side they push."""
    hand = runs[None].surfaces(40)[HAND][0]
    camera = pictures.shared_camera([], (60, 12), figures.size(330), points=hand)
    return pictures.sheet(
        [[pictures.titled(pictures.render(run, 40, camera, **figures.look), name(count)) for count, run in runs.items()]]
    )


def penetration(run):
    """Particles inside the hand and inside the head, deeper than DEPTHS: the most of any counted frame and the mean over
    them; and strands with a particle in the hand."""
    result = {}
    for solid, called in ((HAND, "hand"), (0, "head")):
        inside = {frame: run.inside(frame, DEPTHS[0], solid) for frame in COUNTED}
        result[called] = {
            "particles_most": max(int(each.sum()) for each in inside.values()),
            "particles_mean": float(np.mean([each.sum() for each in inside.values()])),
            "strands_most": max(int(np.logical_or.reduceat(each, run.roots).sum()) for each in inside.values()),
            "deeper": {
                f"{1e3 * depth:g} mm": max(int(run.inside(frame, depth, solid).sum()) for frame in COUNTED)
                for depth in DEPTHS[1:]
            },
        }
    return result
