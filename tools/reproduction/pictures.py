"""Pictures of runs and plots of their numbers, small enough for the repository."""
import io

import numpy as np
from PIL import Image, ImageDraw, ImageFont

LARGEST = 300_000  # bytes of a PNG
INK, PAPER = (70, 70, 75), (225, 226, 228)
GAP = 4  # pixels between pictures

VIEWS = {"front": (0, 5), "side": (90, 5), "back": (180, 10), "three-quarter": (38, 8), "top": (0, 80)}


# ---- Renders -----------------------------------------------------------------------------------------------------


def render(run, frame, camera=None, view="three-quarter", size=(320, 320), samples=16, colour="brown", strands=None,
           position=None, living=None):
    """A picture of a frame. `camera` of shared_camera() for pictures that are to be compared; `strands`: indices of
    those to draw; `position` and `living`, a mask of particles: drawn in place of the frame's."""
    import studio

    camera = camera or shared_camera([(run, frame)], view, size)
    position = run.position(frame) if position is None else position
    particles = run.living(frame) if living is None else living.copy()
    chosen = np.zeros(len(run.roots), bool)
    chosen[slice(None) if strands is None else strands] = True
    bad = np.add.reduceat((~np.isfinite(position).all(1) & particles).astype(int), run.roots) > 0
    left = np.add.reduceat(particles.astype(int), run.roots)
    particles &= np.repeat(chosen & ~bad & (left >= 2), run.counts)
    left = np.add.reduceat(particles.astype(int), run.roots)
    offsets = np.concatenate([[0], np.cumsum(left[left > 0])])
    width = np.maximum(run.cache.width.astype(float), studio.THINNEST * camera.pixel)
    pixels = studio.picture(
        position[particles], width[particles], offsets, run.surfaces(frame), camera, samples, colour
    )
    return Image.fromarray(pixels)


def strip(run, frames, camera, label, **options):
    """A row of pictures of a run, the frame and `label` written on each. Its last frame stands in for those that it did
    not reach."""
    reached = [min(frame, run.frames[-1]) for frame in frames]
    return [titled(render(run, frame, camera, **options), f"{label} {frame}") for frame in reached]


def shared_camera(runs_and_frames, view="three-quarter", size=(320, 320), surfaces=True, points=None):
    """A camera that sees the hair of all (run, frame) and what of the solids is near it; or `points`."""
    import studio

    if points is None:
        hair = np.concatenate([run.position(frame)[run.living(frame)] for run, frame in runs_and_frames])
        hair = hair[np.isfinite(hair).all(1)]
        reach = 0.2 * np.linalg.norm(hair.max(0) - hair.min(0))
        low, high = hair.min(0) - reach, hair.max(0) + reach
        points = [hair]
        for run, frame in runs_and_frames if surfaces else []:
            points += [v[((v > low) & (v < high)).all(1)] for v, _ in run.surfaces(frame)]
        points = np.concatenate(points)
    return studio.fit_camera(np.asarray(points, float), VIEWS.get(view, view), "y", size)


def titled(image, text):
    """The picture with a line of text in its upper left corner."""
    image = image.copy()
    font = ImageFont.load_default(size=max(11, image.height // 22))
    corner = (image.height // 40, image.height // 60)
    ImageDraw.Draw(image).text(corner, text, fill=INK, font=font, stroke_width=2, stroke_fill=PAPER)
    return image


def sheet(rows):
    """One picture of rows of pictures; the rows may be of different lengths."""
    widths = [sum(image.width + GAP for image in row) - GAP for row in rows]
    heights = [max(image.height for image in row) for row in rows]
    out = Image.new("RGB", (max(widths), sum(height + GAP for height in heights) - GAP), (255, 255, 255))
    top = 0
    for row, height in zip(rows, heights):
        left = 0
        for image in row:
            out.paste(image, (left, top))
            left += image.width + GAP
        top += height + GAP
    return out


def save(image, path):
    """Writes a PNG of LARGEST bytes at most: of fewer colours, then of fewer pixels, until it is."""
    image = image.convert("RGB")
    while True:
        for colours in (256, 128, 64):
            data = io.BytesIO()
            image.quantize(colours, dither=Image.Dither.NONE).save(data, "png", optimize=True)
            if len(data.getvalue()) <= LARGEST:
                path.write_bytes(data.getvalue())
                return
        image = image.resize((int(0.87 * image.width), int(0.87 * image.height)), Image.Resampling.LANCZOS)


# ---- Plots -------------------------------------------------------------------------------------------------------


def plot(path, draw, columns=1, width=6.4, height=3.6):
    """Calls draw(axes) (of one row; a list where columns > 1) and saves the figure."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, columns, figsize=(width, height), dpi=100, squeeze=False)
    draw(axes[0] if columns > 1 else axes[0][0])
    for each in axes[0]:
        each.grid(alpha=0.3)
        each.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    data = io.BytesIO()
    figure.savefig(data, format="png", metadata={"Software": None})
    pyplot.close(figure)
    save(Image.open(data), path)
