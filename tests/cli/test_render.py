"""tools/render at small sizes: what is in the picture, not how it looks."""
import h5py
import numpy as np
import pytest
from PIL import Image

from conftest import run


def render(source, *arguments):
    return run(source / "tools/render", *arguments)


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def count_hair(image):
    """Pixels browner than the grey of ground and head can be."""
    return int((image[..., 0] - image[..., 2] > 30).sum())


def test_hair_head_and_background_are_in_the_picture(source, small_cache, tmp_path):
    out = tmp_path / "one.png"
    result = render(source, small_cache, "--frame", 2, "--size", "96x64", "--samples", 8, "-o", out)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == str(out)
    image = pixels(out)
    assert image.shape == (64, 96, 3)
    corner = image[:4, :4].reshape(-1, 3)
    assert (np.ptp(corner, axis=1) <= 8).all() and (corner.mean() > 140)  # light grey
    assert count_hair(image) > 300
    assert image.std() > 15


def test_contact_sheet_has_one_camera_for_all_frames(source, small_cache, tmp_path):
    out = tmp_path / "sheet.png"
    options = ["--size", "64x64", "--samples", 4, "--view", "front", "-o", out]
    result = render(source, small_cache / "ball.h5", "--frames", "1,2-3", *options)
    assert result.returncode == 0, result.stderr
    image = pixels(out)
    assert image.shape == (64, 3 * 64 + 2 * 4, 3)

    def middle(panel):
        hair = panel[..., 0] - panel[..., 2] > 30
        return float(np.nonzero(hair)[1].mean())

    middles = [middle(image[12:, 68 * number : 68 * number + 64]) for number in range(3)]
    assert middles[0] + 1 < middles[1] < middles[2] - 1  # the ball moves along +x, to the viewer's right


@pytest.mark.parametrize("view", ["side", "back", "-30,40"])
def test_views(source, small_cache, tmp_path, view):
    out = tmp_path / "view.png"
    arguments = [small_cache / "ball.0001.h5", f"--view={view}", "--size", "32x32", "--samples", 4, "-o", out]
    result = render(source, *arguments)
    assert result.returncode == 0, result.stderr
    assert count_hair(pixels(out)) > 50


def test_fewer_strands_are_wider(source, small_cache, tmp_path):
    out = tmp_path / "few.png"
    arguments = ["--max-strands", 30, "--size", "48x48", "--samples", 4, "-o", out]
    result = render(source, small_cache, *arguments)
    assert result.returncode == 0, result.stderr
    assert "30 strands" in result.stderr
    assert count_hair(pixels(out)) > 50


def test_failed_state_with_non_finite_strands(source, small_cache, tmp_path):
    failed = tmp_path / "ball.failed.h5"
    with h5py.File(small_cache / "ball.h5") as master, h5py.File(failed, "w") as file:
        file.attrs.update(master.attrs)
        file.attrs["content"] = "failed"
        master.copy("strands", file)
        position = master["strands/rest_position"][:]
        position[:24] = np.nan
        position[30] = 1e30
        file["position"] = position[None]
        file["frames"] = np.array([5], "i4")
        file.create_group("surfaces")
    out = tmp_path / "failed.png"
    result = render(source, failed, "--size", "48x48", "--samples", 4, "-o", out)
    assert result.returncode == 0, result.stderr
    assert "2 strands are not finite" in result.stderr
    assert count_hair(pixels(out)) > 50


@pytest.mark.parametrize(
    "arguments, code, expected",
    [
        (["{cache}", "--frame", "9"], 3, "no frame 9 (there are: 1-3)"),
        (["{cache}/nothing.h5"], 3, "no such file"),
        (["{empty}"], 3, "holds no caches"),
        (["{text}"], 3, "not readable as HDF5"),
        (["{cache}", "--size", "0x0"], 2, "--size"),
        (["{cache}", "--frame", "1", "--frames", "1,2"], 2, "exclude"),
        (["{cache}", "--frame", "1", "--size", "8x8", "-o", "{empty}/no/such/folder.png"], 5, "folder.png"),
    ],
)
def test_errors(source, small_cache, tmp_path, arguments, code, expected):
    empty = tmp_path / "empty"
    empty.mkdir()
    text = tmp_path / "text.h5"
    text.write_text("not HDF5")
    result = render(source, *(part.format(cache=small_cache, empty=empty, text=text) for part in arguments))
    assert result.returncode == code, result.stderr
    assert expected in result.stderr.splitlines()[-1]
