"""What docs/architecture.md says about the sources, read from the sources: the link graph is the architecture."""
import pathlib
import re
import subprocess
import sys

import pytest

from conftest import SOURCE, run

ROOMS = ("kernels", "apps", *(f"lib/{path.name}" for path in sorted((SOURCE / "lib").iterdir()) if path.is_dir()))
SUFFIXES = {".h", ".cpp", ".cu", ".cuh"}
OWN = ("kernels", "core", "scene", "groom", "solids", "state", "effects", "hairmesh", "pipeline", "cache", "study")

# By room, the beginnings of the paths of ours that it may include besides its own.
SCENE_STRUCTS = "scene/scene_desc.h"
PRESSURE = ("kernels/launch/pressure.h", "kernels/grid/pressure_problem.h", "effects/host_threads.h", "effects/instruction_set.h")
ALLOWED = {
    "kernels": (),
    "core": (),
    "scene": ("core/",),
    "groom": ("core/", SCENE_STRUCTS),
    "solids": ("core/", SCENE_STRUCTS, "kernels/solid/"),  # a level set as the kernels see it
    "state": ("core/", "kernels/backend/", "kernels/strand/strand_batch.h"),  # the layout that the kernels read
    "effects": ("core/", "scene/", "groom/", "solids/", "state/", "kernels/"),
    "hairmesh": ("core/", "scene/", "groom/", "solids/", "state/", "kernels/"),
    "pipeline": ("core/", "scene/", "groom/", "solids/", "state/", "kernels/", "effects/", "hairmesh/"),
    "cache": ("core/", "state/"),
    # The pressure's solver alone, which a study verifies, and the threads and instruction sets that it runs with.
    "study": ("core/", "scene/", "solids/", "state/", "pipeline/", "cache/", *PRESSURE),
    # `info` and `groom` show and convert assets; nothing of the physics.
    "apps": ("core/", "scene/", "state/", "groom/", "solids/", "pipeline/", "cache/", "study/"),
}

# `bench` measures the kernels themselves.
EXCEPTIONS = {"apps/ringlet/bench.cpp": ("effects/executor.h", "kernels/launch/launch.h")}

# Libraries that stay in few rooms.
CONFINED = {
    "openvdb/": {"solids"},
    "nanovdb/": {"solids"},
    "assimp/": {"solids"},
    "hdf5.h": {"cache", "groom"},
    "valijson/": {"scene"},
    "CLI/": {"apps"},
}

TOP_LEVEL = set(
    "apps lib kernels scenes schemas tests tools docs .ci .clang-format .clang-tidy .gitignore "
    "CHANGELOG.md CMakeLists.txt CMakePresets.json LICENSE README.md".split()
)


def files_of(*folders):
    for folder in folders:
        for path in sorted((SOURCE / folder).rglob("*")):
            if path.suffix in SUFFIXES:
                yield path


def room_of(path):
    parts = path.relative_to(SOURCE).parts
    return parts[1] if parts[0] == "lib" else parts[0]


def lines(path):
    """(number, line) without what follows //."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        yield number, line.split("//")[0]


def includes(path):
    for number, line in lines(path):
        match = re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line)
        if match:
            yield number, match[1]


def where(path, number):
    return f"{path.relative_to(SOURCE)}:{number}"


def forbidden_includes(folders):
    for path in files_of(*folders):
        room = room_of(path)
        for number, included in includes(path):
            confined = next((rooms for start, rooms in CONFINED.items() if included.startswith(start)), None)
            if confined is not None and room not in confined:
                yield f"{where(path, number)}: {room} includes {included}"
            if included.partition("/")[0] not in OWN or "/" not in included:
                continue
            allowed = (*ALLOWED[room], f"{room}/", *EXCEPTIONS.get(path.relative_to(SOURCE).as_posix(), ()))
            if not included.startswith(allowed):
                yield f"{where(path, number)}: {room} includes {included}"


def test_rooms_include_what_the_architecture_allows():
    assert {room.split("/")[-1] for room in ROOMS} <= set(ALLOWED)
    assert not list(forbidden_includes(ROOMS))


def test_the_include_check_sees_a_forbidden_include(tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "SOURCE", tmp_path)
    for room, included in (("lib/groom", "cache/cache.h"), ("kernels", "core/error.h"), ("lib/cache", "openvdb/a.h")):
        (tmp_path / room).mkdir(parents=True)
        (tmp_path / room / "bad.cpp").write_text(f'// a comment\n#include "{included}"\n')
        assert list(forbidden_includes([room])) == [f"{room}/bad.cpp:2: {room.split('/')[-1]} includes {included}"]


def test_effects_do_not_include_each_other():
    wrong = []
    for path in files_of("lib/effects"):
        effect = path.relative_to(SOURCE / "lib/effects").parts[0]
        for number, included in includes(path):
            other = included.split("/")
            if other[0] == "effects" and len(other) > 2 and (SOURCE / "lib/effects" / effect).is_dir() and other[1] != effect:
                wrong.append(f"{where(path, number)}: {effect} includes {included}")
    assert not wrong


def test_only_the_backend_knows_the_compiler():
    wrong = [
        where(path, number)
        for path in files_of("kernels", "lib", "apps")
        if "kernels/backend" not in path.as_posix()
        for number, line in lines(path)
        if re.search(r"__CUDACC__|__CUDA_ARCH__", line)
    ]
    assert not wrong


def test_library_code_neither_prints_nor_exits():
    talk = re.compile(r"std::(cout|cerr|clog)\b|\b(std::)?f?printf\s*\(|\bstd::(exit|abort|terminate|quick_exit)\b")
    wrong = [where(path, number) for path in files_of("lib", "kernels") for number, line in lines(path) if talk.search(line)]
    assert not wrong


def test_files_are_of_a_size_to_read():
    sizes = {where(path, 1): len(path.read_text().splitlines()) for path in files_of("apps", "lib", "kernels", "tests")}
    assert not {path: size for path, size in sizes.items() if size > 600}


def tracked_files():
    result = run("git", "-C", SOURCE, "ls-files", "-z")
    if result.returncode:
        pytest.skip("not a git work tree")
    return [name for name in result.stdout.split("\0") if name]


def test_top_level_holds_nothing_else():
    assert {name.split("/")[0] for name in tracked_files()} <= TOP_LEVEL


def test_no_path_of_a_machine_is_in_the_tree():
    wrong = []
    for name in tracked_files():
        path = SOURCE / name
        if path.suffix in SUFFIXES | {".py", ".txt", ".cmake", ".md", ".json", ""} and path.is_file():
            text = path.read_text(encoding="utf-8", errors="ignore")
            wrong += [f"{name}: {match[0]}" for match in re.finditer(r"(?<![\w.$/-])/(home|root|Users|mnt|work)/\w+", text)]
    assert not wrong


def test_clang_format():
    formatter = pathlib.Path(sys.executable).parent / "clang-format"
    result = run(formatter, "--dry-run", "-Werror", *files_of("apps", "lib", "kernels", "tests"))
    unformatted = sorted(set(re.findall(r"^(\S+?):\d+:\d+: error", result.stderr, re.MULTILINE)))
    assert result.returncode == 0, "\n".join(unformatted)


@pytest.mark.parametrize("script", ["install-packages", "build", "quickstart", "test", "bundle"])
def test_scripts_parse(script):
    assert (SOURCE / "tools" / script).stat().st_mode & 0o111
    assert subprocess.run(["bash", "-n", SOURCE / "tools" / script], check=False).returncode == 0
