"""What README.md shows exists and runs."""
import json
import re

import pytest

from conftest import SOURCE, run

README = (SOURCE / "README.md").read_text(encoding="utf-8")


def test_links_and_tools_exist():
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    tools = re.findall(r"\btools/[a-z-]+", README)
    assert not [path for path in links + tools if not (SOURCE / path).exists()]


def readme_scene():
    """The first indented block that is a JSON object."""
    block = re.search(r"^    \{\n.*?^    \}\n", README, re.MULTILINE | re.DOTALL)[0]
    return json.loads(block)


def test_the_scene_follows_the_schema(program, tmp_path):
    scene = readme_scene()
    scene["head"] = {"mesh": "head.obj"}
    scene["groom"] = {"grow": {"strands": 5}}
    (tmp_path / "head.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 -1\nf 1 2 3\n")
    (tmp_path / "shake.json").write_text(json.dumps(scene))
    result = run(program, "validate", tmp_path / "shake.json")
    assert result.returncode == 0, result.stderr


@pytest.fixture(scope="module")
def quickstart_cache(program, tmp_path_factory):
    directory = tmp_path_factory.mktemp("quickstart")
    sets = ["--set", "/frames/last=2", "--set", "/frames/preroll=0"]
    result = run(program, "run", SOURCE / "scenes/quickstart.json", "-o", directory, "--overwrite", *sets)
    assert result.returncode == 0, result.stderr
    return directory


def test_the_h5py_example_runs(quickstart_cache, capsys):
    example = re.search(r"```python\n(.*?)```", README, re.DOTALL)[1]
    exec(example.replace("out/quickstart", str(quickstart_cache)), {})  # noqa: S102
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["1", "2"]
    assert len(example.splitlines()) <= 5


def test_the_default_scene_renders(quickstart_cache, tmp_path):
    out = tmp_path / "two.png"
    arguments = ["--frames", "1,2", "--size", "48x48", "--samples", 2, "--max-strands", 500, "-o", out]
    result = run(SOURCE / "tools/render", quickstart_cache, *arguments)
    assert result.returncode == 0, result.stderr
    assert out.stat().st_size > 1000
