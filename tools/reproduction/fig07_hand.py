"""Figure 7: a hand sweeps through long hair: all strands simulated, and skinned to 2,048 and to 128 guides."""
import numpy as np

from . import pictures
from .inside import deeper_than

GUIDES = (None, 2048, 128)
FRAMES = [20, 32, 46, 58]
COUNTED = range(18, 61, 4)  # frames in which the hand is in the hair
HAND = 1  # solid; 0 is the head
DEPTHS = (1e-4, 1e-3, 5e-3)  # [m]
VIEW = (120, 12)
CLOSE = 46  # frame


def make(figures):
    runs = {count: figures.run("hand", name(count), settings(count, figures.quick)) for count in GUIDES}
    everything = runs[None]
    camera = pictures.shared_camera([(everything, frame) for frame in FRAMES], VIEW, figures.size(260))
    rows = [pictures.strip(run, FRAMES, camera, f"{name(count)}, frame", **figures.look) for count, run in runs.items()]
    pictures.save(pictures.sheet(rows), figures.path(".png"))
    pictures.save(close_up(figures, runs), figures.path("_close.png"))
    figures.record(
        {"health": everything.health(COUNTED)}
        | {name(count): penetration(run) | {"core_ms_per_frame": run.core_milliseconds} for count, run in runs.items()}
    )


def name(count):
    return f"{count:,} guides" if count else "all strands"


def settings(count, quick):
    return {"/groom/interpolate": {"count": count // 10 if quick else count}} if count else {}


def close_up(figures, runs):
    """The fingers in the hair, from the side of the palm; not the forearm."""
    hand = runs[None].surfaces(CLOSE)[HAND][0]
    fingers = hand[np.hypot(hand[:, 0], hand[:, 2]) < 0.24]  # from the axis that the hand goes round
    camera = pictures.shared_camera([], (165, 12), figures.size(330), points=fingers)
    row = [pictures.render(run, CLOSE, camera, **figures.look) for run in runs.values()]
    return pictures.sheet([[pictures.titled(image, name(count)) for image, count in zip(row, runs)]])


def penetration(run):
    """Particles inside the hand and inside the head, deeper than each of DEPTHS, the most of any counted frame, and the
    strands that they are of."""
    result = {}
    for solid, called in ((HAND, "hand"), (0, "head")):
        found = [deep(run, frame, solid) for frame in COUNTED]
        result[called] = {
            f"particles deeper than {1e3 * depth:g} mm": max(len(each[depth]) for each in found) for depth in DEPTHS
        }
        result[called]["strands"] = max(len(np.unique(run.strand[each[DEPTHS[0]]])) for each in found)
    return result


def deep(run, frame, solid):
    """{depth: indices of the particles that are deeper inside the solid}"""
    inside = np.flatnonzero(run.inside(frame, solid=solid))
    position, mesh = run.position(frame), run.surfaces(frame)[solid]
    result = {}
    for depth in DEPTHS:
        inside = inside[deeper_than(position[inside], depth, *mesh)]
        result[depth] = inside
    return result
