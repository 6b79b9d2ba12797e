"""tools/make-head: the committed head is what the tool makes, and a sound mesh of human size."""
import collections
import pathlib
import subprocess
import sys

import pytest

np = pytest.importorskip("numpy")

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEAD = ROOT / "scenes" / "assets" / "head.obj"


def read_obj(path):
    vertices, triangles, objects = [], [], []
    name = None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[0] == "v":
            vertices.append([float(word) for word in words[1:]])
        elif words[0] == "o":
            name = words[1]
        elif words[0] == "f":
            triangles.append([int(word) - 1 for word in words[1:]])
            objects.append(name)
    return np.array(vertices), np.array(triangles), objects


@pytest.fixture(scope="module")
def head():
    return read_obj(HEAD)


def test_regenerating_gives_the_committed_file(tmp_path):
    made = tmp_path / "head.obj"
    subprocess.run([sys.executable, str(ROOT / "tools" / "make-head"), "-o", str(made)], check=True)
    assert made.read_bytes() == HEAD.read_bytes()


def test_size(head):
    vertices, triangles, objects = head
    assert HEAD.stat().st_size < 1_000_000
    assert 5_000 <= len(triangles) <= 20_000
    assert collections.Counter(objects).keys() == {"scalp", "face", "body"}
    assert collections.Counter(objects)["scalp"] > 2_000
    assert 0.31 < vertices[:, 1].max() < 0.33  # the crown over the base of the neck [m]


def test_surface_is_closed_and_manifold(head):
    vertices, triangles, _ = head
    directed = collections.Counter((int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3))
    assert set(directed.values()) == {1}
    assert all((b, a) in directed for a, b in directed)
    assert len(vertices) - len(directed) // 2 + len(triangles) == 2  # one sphere
    assert sorted(set(triangles.reshape(-1))) == list(range(len(vertices)))
    assert len(np.unique(vertices, axis=0)) == len(vertices)


def test_triangles_face_outwards_and_have_area(head):
    vertices, triangles, _ = head
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 > 0.005  # enclosed volume [m^3]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    assert (area / longest).min() > 0.05
    crown = triangles[vertices[triangles[:, 0], 1] > 0.31]
    normal = np.cross(vertices[crown[:, 1]] - vertices[crown[:, 0]], vertices[crown[:, 2]] - vertices[crown[:, 0]])
    assert (normal[:, 1] > 0).all()
