"""The picture that tools/render makes: strands as curves, surfaces as meshes, a studio's light, a fitted camera.

All lengths are in the cache's units. Rendering is Mitsuba 3's, whose scalar variant is about as fast on these scenes
as its LLVM variant and needs no LLVM.
"""
import dataclasses
import pathlib
import tempfile

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

FIELD_OF_VIEW = 28.0  # degrees, of the picture's smaller side
MARGIN = 1.06  # of the camera's distance
THINNEST = 0.6  # pixels; thinner strands are widened to it, for they would only be noise
PIECES = 2  # curve pieces per strand segment
BACKGROUND = np.array([0.82, 0.83, 0.84])  # sRGB
SHADES = (0.7, 1.0, 1.4)  # melanin of the strands, relative: hair is not of one colour
SKIN = [0.36, 0.31, 0.28]

# (right, up, front) of a figure, by up axis: it looks along +z where y is up, and along -y where z is up.
AXES = {
    "x": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "z": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
}
MELANIN = {  # eumelanin, pheomelanin
    "black": (2.2, 0.2),
    "brown": (1.0, 0.3),
    "auburn": (0.35, 0.9),
    "blond": (0.11, 0.12),
    "white": (0.01, 0.01),
}


# ---- Strands and surfaces ----------------------------------------------------------------------------------------


def subdivide(position, width, offsets, pieces):
    """Catmull-Rom through the particles: the control points of a cubic B-spline do not lie on it, and coarse curls
    would shrink. Returns [n, 4] (position, width) and the finer strands' offsets. Strands have 2 particles or more."""
    points = np.column_stack([position, width]).astype(float)
    counts = np.diff(offsets)
    strand = np.repeat(np.arange(len(counts)), counts)
    index = np.arange(len(points)) - offsets[strand]
    last = index == counts[strand] - 1
    here = np.flatnonzero(~last)  # the particle before each segment
    there = here + 1
    before = np.where((index[here] == 0)[:, None], 2 * points[here] - points[there], points[here - 1])
    beyond = points[np.minimum(there + 1, len(points) - 1)]
    after = np.where(last[there][:, None], 2 * points[there] - points[here], beyond)
    fine_offsets = np.concatenate([[0], np.cumsum((counts - 1) * pieces + 1)])
    fine = np.empty((fine_offsets[-1], 4))
    first = fine_offsets[strand[here]] + index[here] * pieces
    for piece in range(pieces):
        t = piece / pieces
        weights = [
            (-0.5 * t + 1.0) * t * t - 0.5 * t,
            (1.5 * t - 2.5) * t * t + 1.0,
            (-1.5 * t + 2.0) * t * t + 0.5 * t,
            (0.5 * t - 0.5) * t * t,
        ]
        fine[first + piece] = sum(w * p for w, p in zip(weights, (before, points[here], points[there], after)))
    fine[fine_offsets[1:] - 1] = points[offsets[1:] - 1]
    fine[:, 3] = np.clip(fine[:, 3], width.min(), width.max())  # the spline overshoots where widths change fast
    return fine, fine_offsets


def write_curves(path, points, offsets, strands):
    """Mitsuba's text format: `x y z radius` a control point, an empty line after a curve. Each end is continued by one
    control point, so that the curve reaches it.

    Mitsuba 3.9 crashes when a ray meets the very end of a shape's last curve (the curve parameter rounds up to the next
    segment): a hair's breadth of a curve, hidden in the first root, takes that place."""
    with open(path, "w", encoding="ascii") as file:
        for strand in strands:
            curve = points[offsets[strand] : offsets[strand + 1]]
            curve = np.vstack([2 * curve[0] - curve[1], curve, 2 * curve[-1] - curve[-2]])
            curve[[0, -1], 3] = curve[[1, -2], 3]
            curve[:, 3] *= 0.5
            file.write(("%.7g %.7g %.7g %.4g\n" * len(curve)) % tuple(curve.ravel()) + "\n")
        root, width = points[offsets[strands[0]], :3], points[offsets[strands[0]], 3]
        hidden = [(*(root + 1e-3 * k * width), 1e-6 * width) for k in range(4)]
        file.write(("%.9g %.9g %.9g %.4g\n" * 4) % tuple(np.ravel(hidden)))


def write_mesh(path, vertices, triangles):
    """Binary PLY; Mitsuba makes the normals."""
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"] = 3
    faces["index"] = triangles
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + np.ascontiguousarray(vertices, "<f4").tobytes() + faces.tobytes())


# ---- Camera ------------------------------------------------------------------------------------------------------


@dataclasses.dataclass
class Camera:
    origin: np.ndarray
    target: np.ndarray
    up: np.ndarray
    right: np.ndarray
    size: tuple  # width, height [pixels]
    pixel: float  # length that a pixel spans at the target
    extent: float  # the farthest that what it sees lies from the target

    @property
    def distance(self):
        return float(np.linalg.norm(self.target - self.origin))


def fit_camera(points, view, up_axis, size):
    """The nearest camera that sees all `points` from `view`: azimuth (0: the figure's front, 90: its left side, which
    is on the viewer's right) and elevation, in degrees."""
    right_axis, up, front = (np.array(axis, float) for axis in AXES[up_axis])
    azimuth, elevation = np.radians(view)
    backward = np.cos(elevation) * (np.sin(azimuth) * right_axis + np.cos(azimuth) * front) + np.sin(elevation) * up
    right = np.cos(azimuth) * right_axis - np.sin(azimuth) * front
    frame = np.column_stack([right, np.cross(backward, right), backward])

    width, height = size
    tangent = np.tan(np.radians(FIELD_OF_VIEW / 2)) * np.array([width, height]) / min(size)
    target = (points.min(0) + points.max(0)) / 2
    for _ in range(4):  # centring in the picture depends on the distance, which depends on the centring
        local = (points - target) @ frame
        distance = MARGIN * float((np.abs(local[:, :2]) / tangent + local[:, 2:]).max())
        on_screen = local[:, :2] * (distance / (distance - local[:, 2:]))
        target = target + frame[:, :2] @ ((on_screen.min(0) + on_screen.max(0)) / 2)
    pixel = 2 * distance * float(tangent[1]) / height
    extent = float(np.linalg.norm(points - target, axis=1).max())
    return Camera(target + distance * backward, target, frame[:, 1], right, size, pixel, extent)


# ---- Scene -------------------------------------------------------------------------------------------------------


def to_list(vector):
    return [float(x) for x in vector]


def softbox(camera, direction, distance, half_size, radiance):
    """A square light at `direction` = (right, up, towards the camera) from the target."""
    axes = np.column_stack([camera.right, camera.up, (camera.origin - camera.target) / camera.distance])
    offset = axes @ np.array(direction, float)
    origin = camera.target + distance * offset / np.linalg.norm(offset)
    placed = mi.ScalarTransform4f().look_at(to_list(origin), to_list(camera.target), to_list(camera.up))
    return {
        "type": "rectangle",
        "to_world": placed @ mi.ScalarTransform4f().scale(float(half_size)),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }


def lights(camera):
    """A warm key, a cool rim from behind, and light from all sides."""
    extent = camera.extent
    return {
        "surrounding": {"type": "constant", "radiance": {"type": "rgb", "value": [0.30, 0.31, 0.33]}},
        "key": softbox(camera, (-0.8, 0.9, 1.0), 4 * extent, 1.6 * extent, [9.5, 9.0, 8.4]),
        "rim": softbox(camera, (0.9, 0.8, -0.9), 4 * extent, 1.4 * extent, [6.0, 6.3, 6.6]),
    }


def hair_bsdf(melanin, shade):
    eumelanin, pheomelanin = melanin
    return {
        "type": "hair",
        "eumelanin": eumelanin * shade,
        "pheomelanin": pheomelanin * shade,
        "longitudinal_roughness": 0.28,
        "azimuthal_roughness": 0.35,
        "scale_tilt": 2.5,
    }


def sensor(camera, samples):
    width, height = camera.size
    return {
        "type": "perspective",
        "fov": FIELD_OF_VIEW,
        "fov_axis": "smaller",
        "near_clip": camera.distance * 1e-3,
        "far_clip": camera.distance * 1e3,
        "to_world": mi.ScalarTransform4f().look_at(to_list(camera.origin), to_list(camera.target), to_list(camera.up)),
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgba",
            "rfilter": {"type": "gaussian"},
        },
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


def picture(position, width, offsets, surfaces, camera, samples, colour):
    """Renders one time. position [particles, 3], width [particles], offsets [strands + 1], surfaces a list of
    (vertices, triangles). Returns sRGB bytes [height, width, 3]."""
    fine, fine_offsets = subdivide(position, width, offsets, PIECES)
    shade_of_strand = np.random.default_rng(1).integers(0, len(SHADES), len(offsets) - 1)
    scene = {"type": "scene", "integrator": {"type": "path", "max_depth": 5, "rr_depth": 4, "hide_emitters": True}}
    scene["sensor"] = sensor(camera, samples)
    scene |= lights(camera)
    with tempfile.TemporaryDirectory(prefix="ringlet-render-") as folder:
        for shade, factor in enumerate(SHADES):
            strands = np.flatnonzero(shade_of_strand == shade)
            if len(strands):
                path = pathlib.Path(folder, f"strands{shade}.txt")
                write_curves(path, fine, fine_offsets, strands)
                bsdf = hair_bsdf(MELANIN[colour], factor)
                scene[f"strands{shade}"] = {"type": "bsplinecurve", "filename": str(path), "bsdf": bsdf}
        skin = {"type": "twosided", "skin": {"type": "diffuse", "reflectance": {"type": "rgb", "value": SKIN}}}
        for number, (vertices, triangles) in enumerate(surfaces):
            path = pathlib.Path(folder, f"surface{number}.ply")
            write_mesh(path, vertices, triangles)
            scene[f"surface{number}"] = {"type": "ply", "filename": str(path), "bsdf": skin}
        image = np.array(mi.render(mi.load_dict(scene)))
    return develop(image)


def develop(image):
    """Linear light with alpha to sRGB bytes over the background, which brightens towards the middle."""
    height, width = image.shape[:2]
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    ground = BACKGROUND * (1 - 0.12 * np.clip(x * x + y * y, 0, 2))[..., None]
    alpha = np.clip(image[..., 3:], 0, 1)
    linear = np.nan_to_num(np.clip(image[..., :3], 0, 1e3))
    light = np.where(alpha > 0, linear / np.maximum(alpha, 1e-6), 0)
    light = 1 - np.exp(-1.4 * light)  # a soft shoulder: highlights do not clip
    coded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
    return np.round(255 * np.clip(alpha * coded + (1 - alpha) * ground, 0, 1)).astype(np.uint8)
