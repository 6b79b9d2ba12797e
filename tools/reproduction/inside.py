"""Which points are inside closed meshes, counted by crossings: nothing of the simulator's level sets or distances.

A ray along a direction crosses a closed surface as often inwards as outwards when it starts outside. Rays that pass an
edge or a vertex may count wrongly, so three directions vote.
"""
import numpy as np

DIRECTIONS = np.array([[0.0132, 0.9991, 0.0407], [0.9987, -0.0311, 0.0402], [-0.0239, 0.0458, 0.9987]])
PAIRS = 4_000_000  # of points and triangles looked at at once


def inside_solids(points, surfaces, depth=0.0):
    """[points] whether each is inside one of the closed `surfaces`, of (vertices, triangles), by more than `depth`."""
    found = np.zeros(len(points), bool)
    for vertices, triangles in surfaces:
        vertices = np.asarray(vertices, float)
        near = ((points > vertices.min(0)) & (points < vertices.max(0))).all(1)
        index = np.flatnonzero(near & ~found)
        index = index[inside_mesh(points[index], vertices, triangles)]
        if depth > 0:
            index = index[deeper_than(points[index], depth, vertices, triangles)]
        found[index] = True
    return found


def inside_mesh(points, vertices, triangles):
    """[points] whether a majority of rays says that the closed mesh winds round the point."""
    if not len(points):
        return np.zeros(0, bool)
    first, second = (winding(points, vertices, triangles, way) != 0 for way in DIRECTIONS[:2])
    split = np.flatnonzero(first != second)
    first[split] = winding(points[split], vertices, triangles, DIRECTIONS[2]) != 0
    return first


def winding(points, vertices, triangles, way):
    """[points] crossings of a ray along `way`, those that leave the solid less those that enter it."""
    way = way / np.linalg.norm(way)
    across = np.cross(way, [1.0, 0, 0] if abs(way[0]) < 0.5 else [0, 1.0, 0])
    across /= np.linalg.norm(across)
    frame = np.stack([across, np.cross(way, across), way])  # rows; the ray goes along the third
    corners, start = (vertices @ frame.T)[triangles], points @ frame.T
    count = np.zeros(len(points), int)
    for triangle, point in _candidates(corners[..., :2].min(1), corners[..., :2].max(1), start[:, :2]):
        sign, height = _crossing(corners[triangle], start[point, :2])
        np.add.at(count, point, np.where(height > start[point, 2], sign, 0))
    return count


def _crossing(corner, at):
    """(sign, height): +1 where the triangle's projection holds the point and faces along the ray, -1 against it, 0
    where it does not hold it; and the height at which it is met."""
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]

    def twice_area(p, q):
        return (p[:, 0] - at[:, 0]) * (q[:, 1] - at[:, 1]) - (p[:, 1] - at[:, 1]) * (q[:, 0] - at[:, 0])

    u, v, w = twice_area(b, c), twice_area(c, a), twice_area(a, b)
    front, back = (u >= 0) & (v >= 0) & (w >= 0), (u <= 0) & (v <= 0) & (w <= 0)
    total = u + v + w
    sign = np.where(total == 0, 0, front.astype(int) - back.astype(int))
    safe = np.where(total == 0, 1, total)
    return sign, (u * a[:, 2] + v * b[:, 2] + w * c[:, 2]) / safe


def _candidates(low, high, at):
    """Pairs (boxes, points), in parts, of those that share a cell of a grid; every box that holds a point is among its
    pairs. `low`, `high` [boxes, d], `at` [points, d]; d is 2 or 3."""
    floor, dimensions = low.min(0), low.shape[1]
    cells = int(np.clip(2 * len(low) ** (1 / dimensions), 8, 256))
    size = (high.max(0) - floor) / cells + 1e-30
    strides = cells ** np.arange(dimensions)

    def cell_of(points):
        return ((points - floor) / size).astype(int).clip(0, cells - 1)

    box, cell = _cells_of(cell_of(low), cell_of(high), strides)
    order = np.argsort(cell, kind="stable")
    box, begin = box[order], np.searchsorted(cell[order], np.arange(cells**dimensions + 1))
    where = cell_of(at) @ strides
    many = begin[where + 1] - begin[where]
    part = np.cumsum(many) // PAIRS
    for number in np.unique(part):
        chosen = np.flatnonzero((part == number) & (many > 0))
        point = np.repeat(chosen, many[chosen])
        yield box[begin[where[point]] + _count_up(many[chosen])], point


def _cells_of(first, last, strides):
    """(box, cell) for each cell that a box reaches, of its first and last cell along each axis."""
    span = last - first + 1
    many = span.prod(1)
    box = np.repeat(np.arange(len(first)), many)
    rest, cell = _count_up(many), np.zeros(len(box), int)
    for axis, stride in enumerate(strides):
        cell += stride * (first[box, axis] + rest % span[box, axis])
        rest //= span[box, axis]
    return box, cell


def _count_up(many):
    """0, 1, ... many[0] - 1, 0, 1, ... many[1] - 1, ..."""
    return np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many)


def deeper_than(points, depth, vertices, triangles):
    """[points] whether no triangle is nearer than `depth`."""
    corners = np.asarray(vertices, float)[triangles]
    clear = np.ones(len(points), bool)
    for triangle, point in _candidates(corners.min(1) - depth, corners.max(1) + depth, points):
        clear[point[_distance(points[point], corners[triangle]) <= depth]] = False
    return clear


def distance(points, vertices, triangles):
    """[points] to the nearest triangle; every one is looked at, so this is for few points."""
    corners = np.asarray(vertices, float)[triangles]
    return np.array([_distance(point, corners).min() for point in points])


def _distance(p, corners):
    """[n] from points [n, 3] (or one) to triangles [n, 3, 3]."""
    best = np.inf
    for k in range(3):  # the edges
        a, along = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        t = ((p - a) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-30)
        best = np.minimum(best, np.linalg.norm(p - a - np.clip(t, 0, 1)[..., None] * along, axis=-1))
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(e, f)
    size = (normal * normal).sum(-1)
    flat = size <= 1e-12 * (e * e).sum(-1) * (f * f).sum(-1)  # no plane: its edges are all there is
    size = np.where(flat, 1, size)
    s, t = (np.cross(p - a, f) * normal).sum(-1) / size, (np.cross(e, p - a) * normal).sum(-1) / size
    height = np.abs(((p - a) * normal).sum(-1)) / np.sqrt(size)
    return np.where(~flat & (s >= 0) & (t >= 0) & (s + t <= 1), np.minimum(best, height), best)
