"""`ringlet study`: what accuracy costs."""
import csv
import json
import re
import shlex
import signal
import subprocess
import time
import xml.dom.minidom

import numpy as np
import pytest

from conftest import run
from tiny import LENGTH, STRANDS, PARTICLES, data_bytes, strands, write_scene
from tiny_mesh import write_mesh_scene

QUICK = ("--frames", "1-3", "--repeats", "1")
FEW = data_bytes(strands(24))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A smooth problem: soft strands that sag on a moving head, nothing in their way."""

    def change(scene):
        scene["effects"] = {"gravity": [0, -9.81, 0]}
        scene["model"] = {"substeps": 8, "stiffness": {"edge": 2000, "bend": 1000, "twist": 500}}

    return write_scene(tmp_path_factory.mktemp("scene"), change, FEW)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The tiny scene with every effect there is."""

    def change(scene):
        scene["effects"]["wind"] = {"velocity": [2, 0, 0]}
        scene["effects"]["hair_hair"] = {"grid": {"resolution": 16}, "contacts": {"radius": 0.002}}
        scene["effects"]["non_hookean"] = {}
        scene["model"]["substeps"] = 2

    return write_scene(tmp_path_factory.mktemp("whole"), change, FEW)


def study(program, scene, out, *options, code=0):
    """Runs a study; its JSON, and the rows of its CSV."""
    result = run(program, "study", scene, "-o", out, "--json", *options)
    assert result.returncode == code, result.stderr
    with open(out / "study.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    told = json.loads(result.stdout)
    assert told == json.loads((out / "study.json").read_text())
    return told, rows


def files(directory):
    return {path.relative_to(directory): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


# ---- what comes out


@pytest.fixture(scope="module")
def substeps(program, scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("substeps") / "study"
    return out, *study(program, scene, out, *QUICK, "--vary", "/model/substeps=4,8,16", "--vary", "precision=float,double")


def test_one_setting_at_a_time_is_a_row_each_and_a_run_twice_named_is_one(substeps):
    out, told, rows = substeps
    columns = (out / "study.csv").read_text().splitlines()[0].split(",")
    assert len(columns) == len(set(columns)) and columns.count("precision") == columns.count("backend") == 1
    assert [row["label"] for row in told["rows"]] == ["as given", "substeps=4", "substeps=16", "precision=double"]
    assert [(row["/model/substeps"], row["precision"]) for row in rows] == [
        ("8", "float"), ("4", "float"), ("16", "float"), ("8", "double"),
    ]  # fmt: skip
    assert all(row["status"] == "ok" and float(row["ms_per_frame"]) > 0 for row in rows)
    assert all(row[f"{name}_{kind}"] for row in rows for name in ("error", "velocity", "length") for kind in ("rms", "p99"))
    assert all(float(row["ms_strands"]) <= float(row["ms_per_frame"]) for row in rows)


def test_errors_fall_with_the_order_of_the_step_and_the_reference_is_far_enough(substeps):
    _, told, rows = substeps
    (order,) = told["answers"]["orders"]
    assert order["axis"] == "/model/substeps" and order["values"] == [4, 8, 16]
    assert order["orders"] == pytest.approx([1, 1], abs=0.15)
    reference = told["reference"]
    assert reference["converged"] and reference["levels"][-1]["order"] == pytest.approx(1, abs=0.1)
    smallest = min(float(row["error_rms"]) for row in rows)
    assert reference["levels"][-1]["change"]["rms"] <= 0.1 * smallest
    # Float's own error is apart from the step's.
    assert 0 < reference["float_error"]["errors"]["error"]["rms"] < 0.1 * smallest


def test_what_is_not_there_is_not_measured(substeps):
    out, _, rows = substeps
    assert all(row["volume_rms"] == "" and row["penetration_rms"] == "" for row in rows)
    page = (out / "report.md").read_text()
    assert "Volume is not measured: the scene has neither a grid nor a hair mesh." in page
    assert "Penetration is not measured: the scene has no solids." in page


def test_the_report_answers(substeps):
    out, told, _ = substeps
    page = (out / "report.md").read_text()
    for title in ("What does the next digit cost?", "Which settings waste time?", "Which setting is the knee?"):
        assert f"## {title}\n" in page
    assert "![Error against time](plot.svg)" in page
    if told["answers"]["digit_cost"]:
        assert re.search(r"a tenth of the error takes [\d.]+ times as long", page)


def test_the_plot_is_a_picture_with_every_run(substeps):
    out, _, _ = substeps
    picture = xml.dom.minidom.parse(str(out / "plot.svg"))
    words = [node.firstChild.data for node in picture.getElementsByTagName("text")]
    assert any("error of positions" in word for word in words) and "time of a frame [ms]" in words
    assert any(word.startswith("substeps=4") for word in words)
    assert len([c for c in picture.getElementsByTagName("circle") if c.getAttribute("r") == "5.5"]) == 4


def test_errors_are_what_compare_tells(program, scene, substeps, tmp_path):
    """The reference kept beside the study, against a run of a row's settings, by `ringlet compare`."""
    out, told, rows = substeps
    assert run(program, "run", scene, "-o", tmp_path / "run", "--frames", "1-3", "--set", "/model/substeps=4").returncode == 0
    reference = out / "reference" / str(told["reference"]["substeps"])
    result = json.loads(run(program, "compare", reference, tmp_path / "run", "--json").stdout)
    # compare counts the unstepped frame as well: two of three frames have an error.
    expected = result["overall"]["rms"] * (3 / 2) ** 0.5
    assert float(rows[1]["error_rms"]) == pytest.approx(expected, rel=1e-4)


def test_stiff_strands_whose_lengths_are_held_converge_in_the_metric_of_the_step(program, tmp_path):
    """Whose reference always has it, and whose strands are otherwise those of any scene."""

    def change(scene):
        del scene["effects"]["solids"]
        scene["model"] = {"substeps": 16}

    scene = write_scene(tmp_path, change, FEW)
    told, _ = study(program, scene, tmp_path / "study", *QUICK, "--vary", "/effects/inextensible/metric=step")
    assert told["reference"]["set"] == ['/effects/inextensible/metric="step"', "/effects/inextensible/tolerance=1e-05"]
    orders = [level["order_of_median_strand"] for level in told["reference"]["levels"]]
    assert len(orders) >= 4 and orders[:2] == [None, None]
    assert orders[2:] == pytest.approx([1] * len(orders[2:]), abs=0.1)
    # Single precision reaches the reference's tolerance: its error is that of its rounding.
    assert 0 < told["reference"]["float_error"]["errors"]["error"]["rms"] < 1e-5 * LENGTH


def test_no_error_is_told_below_the_references_own(program, scene, tmp_path):
    """A reference no finer than the scene: an error that happens to be small meets no target."""
    options = ("--vary", "/model/substeps=4,8", "--reference-cap", "8", "--target", "1e-7")
    told, rows = study(program, scene, tmp_path / "study", *QUICK, *options, code=1)
    assert min(float(row["error_rms"]) for row in rows) < 1e-7 < told["reference"]["levels"][-1]["change"]["rms"]
    assert told["answers"]["picked"] is None


# ---- the grid's pressure

GRID = '/effects/hair_hair={"grid":{"resolution":8}}'
SHORT = ("--frames", "1-2", "--repeats", "1", "--reference-cap", "4", "--vary", "threads=1")


def test_of_a_scene_with_a_grid_the_pressures_order_is_measured(program, scene, tmp_path):
    """On ever finer grids, once; of a scene without one there is nothing of it."""
    out = tmp_path / "study"
    result = run(program, "study", scene, "-o", out, *SHORT, "--set", GRID)
    assert result.returncode == 0, result.stderr
    assert len(re.findall(r"^pressure: \d+ cells across, error", result.stdout, re.MULTILINE)) == 4
    told = json.loads((out / "study.json").read_text())["pressure"]
    levels = told["levels"]
    assert told["expected_order"] == 2 and [level["cells_across"] for level in levels] == [8, 16, 32, 64]
    assert all(level["residual"] <= told["residual"] <= 1e-10 and level["iterations"] > 0 for level in levels)
    for kind in ("rms", "largest"):
        errors = [level[kind] for level in levels]
        orders = [level[f"order_{kind}"] for level in levels]
        assert orders[0] is None and orders[1:] == pytest.approx(np.log2(np.divide(errors[:-1], errors[1:])), rel=1e-9)
        assert orders[1:] == pytest.approx([2, 2, 2], abs=0.1)
    page = (out / "report.md").read_text()
    assert "## The grid's pressure\n" in page and "Theory gives **order 2**" in page
    for level in levels[1:]:
        row = f"| {level['cells_across']} | {level['cells']} | {level['rms']:.2e} | {level['order_rms']:.2f} "
        assert f"{row}| {level['largest']:.2e} | {level['order_largest']:.2f} | {level['iterations']} |\n" in page

    # What is there is kept, what is not is done.
    again = run(program, "study", scene, "-o", out, "--resume", *SHORT, "--set", GRID)
    assert again.returncode == 0 and "pressure:" not in again.stdout
    cut = json.loads((out / "study.json").read_text())
    assert cut["pressure"] == told
    cut["pressure"]["levels"] = levels[:3]
    (out / "study.json").write_text(json.dumps(cut))
    again = run(program, "study", scene, "-o", out, "--resume", *SHORT, "--set", GRID)
    assert re.findall(r"^pressure: (\d+) cells", again.stdout, re.MULTILINE) == ["64"]
    assert json.loads((out / "study.json").read_text())["pressure"] == told

    # A level that was not solved so far is marked.
    assert "stopped at a residual" not in (out / "report.md").read_text()
    told["levels"][3]["residual"] = 1e-9
    (out / "study.json").write_text(json.dumps({**cut, "pressure": told}))
    assert run(program, "study", scene, "-o", out, "--resume", *SHORT, "--set", GRID).returncode == 0
    assert "**With 64 cells across the solver stopped at a residual of 1.0e-09**" in (out / "report.md").read_text()


def test_without_a_grid_there_is_no_pressure(substeps):
    out, told, _ = substeps
    assert told["pressure"] is None and "pressure" not in (out / "report.md").read_text()


# ---- what can be varied

AXES = {
    "/effects/hair_hair/grid/resolution": "8,16",
    "/effects/hair_hair/grid/residual": "1e-2,1e-4",
    "/effects/solids/0/voxel": "0.004,0.01",
    "/effects/inextensible/max_iterations": "2,8",
    "/groom/particles": "5,9",
    "/groom/interpolate": '{"count":8},null',
    "/effects/wind": "null",
    "/effects/solids": "null",
    "/effects/hair_hair": 'null,{"grid":{}}',
    "/effects/non_hookean": "null",
    "threads": "1,2",
    "instruction-set": "generic",
    "backend": "cpu",
}


def test_every_setting_is_varied_by_its_pointer(program, whole, tmp_path):
    vary = [part for name, values in AXES.items() for part in ("--vary", f"{name}={values}")]
    told, rows = study(program, whole, tmp_path / "study", "--frames", "1-2", "--repeats", "1", "--reference-cap", "4", *vary)
    by_label = {row["label"]: row for row in told["rows"]}
    assert {row["status"] for row in told["rows"]} == {"ok"}
    assert {label for label in by_label if label.startswith("particles=")} == {"particles=5", "particles=9"}
    assert {"wind=null", "solids=null", "hair_hair=null", "threads=1", "instruction-set=generic", "backend=cpu"} <= set(by_label)
    assert by_label["particles=5"]["particles"] == 24 * 5 and by_label["particles=5"]["resampled"]
    guides = by_label['interpolate={"count":8}']
    assert guides["strands"] == 8 and guides["errors"]["strands"] == 24
    assert by_label["threads=1"]["errors"] == by_label["as given"]["errors"]
    assert "wind" not in by_label["wind=null"]["stages_ms"] and "wind" in by_label["as given"]["stages_ms"]
    for label in by_label:
        assert all(by_label[label]["errors"][name] for name in ("error", "volume", "penetration")), label
    assert by_label["wind=null"]["errors"]["error"]["rms"] > 4 * by_label["as given"]["errors"]["error"]["rms"]


def test_of_all_strands_only_those_that_are_the_same_are_compared(program, tmp_path):
    def grown(scene):
        scene["groom"] = {"grow": {"scalp": {"direction": [0, 1, 0]}, "strands": 20, "particles": 5}}

    told, _ = study(program, write_scene(tmp_path, grown), tmp_path / "study", *QUICK, "--reference-cap", "8",
                    "--vary", "/groom/grow/strands=10")  # fmt: skip
    counts = [row["errors"]["strands"] for row in told["rows"]]
    assert counts[0] == 20 and counts[1] < 20


def test_models_are_compared_without_what_they_do_not_take(program, tmp_path):
    scene = write_mesh_scene(tmp_path, lambda scene: scene["effects"].pop("solids"))
    told, rows = study(program, scene, tmp_path / "study", *QUICK, "--reference-cap", "8",
                       "--vary", "/model/type=ams,mass_spring,hair_mesh")  # fmt: skip
    assert [row["label"] for row in told["rows"]] == ["as given", "type=ams", "type=mass_spring"]
    assert all(row["status"] == "ok" and float(row["error_rms"]) > 0 for row in rows)
    assert rows[0]["volume_rms"] != "" and rows[1]["volume_rms"] == ""
    assert told["rows"][1]["left_out"] == ["/model/hair_mesh"]


def test_resampling_alone_is_a_small_error(program, tmp_path):
    """A rest shape that nothing pulls at stays: what is left is the interpolation's."""

    def still(scene):
        scene["head"].pop("animation")
        scene["effects"] = {}

    told, _ = study(program, write_scene(tmp_path, still, FEW), tmp_path / "study", *QUICK, "--reference-cap", "8",
                    "--vary", "/groom/particles=5,17")  # fmt: skip
    assert all(row["errors"]["error"]["rms"] < 1e-6 for row in told["rows"])  # straight strands


# ---- choices


def test_the_cheapest_within_a_target_is_printed_as_arguments_that_run_takes(program, scene, tmp_path):
    options = (*QUICK, "--product", "--vary", "/model/substeps=2,8", "--vary", "precision=float,double")
    told, rows = study(program, scene, tmp_path / "study", *options, "--target", "1")
    assert len(rows) == 4
    cheapest = min(told["rows"], key=lambda row: row["ms_per_frame"])
    assert told["answers"]["picked"] == cheapest["label"]
    arguments = [word for line in told["answers"]["picked_arguments"] for word in shlex.split(line)]
    assert run(program, "plan", scene, *arguments).returncode == 0

    result = run(program, "study", scene, "-o", tmp_path / "study", "--resume", *options, "--budget", "1s")
    assert result.returncode == 0, result.stderr
    best = min(told["rows"], key=lambda row: row["errors"]["error"]["rms"])
    assert f"within 1000 ms a frame: {best['label']}" in result.stdout
    assert "--set /model/substeps=8\n" in result.stdout

    told, _ = study(program, scene, tmp_path / "study", "--resume", *options, "--target", "1e-12", code=1)
    assert told["answers"]["picked"] is None


def test_a_run_that_diverges_is_a_row(program, scene, tmp_path):
    told, rows = study(program, scene, tmp_path / "study", *QUICK, "--vary", "/limits/speed=1000,1e-3")
    assert [row["status"] for row in rows] == ["ok", "diverged"]
    assert rows[1]["ms_per_frame"] == "" and rows[1]["error_rms"] == ""
    assert "diverged in stage" in told["rows"][1]["message"]
    assert "diverged" in (tmp_path / "study" / "report.md").read_text()


def test_a_combination_that_is_refused_is_a_row(program, scene, tmp_path):
    stiff = ("--vary", "/model/stiffness/edge=2000,1e10")
    out = tmp_path / "study"
    told, rows = study(program, scene, out, *QUICK, "--product", *stiff, "--vary", "precision=float,double")
    assert [row["status"] for row in rows] == ["ok", "ok", "refused", "ok"]
    assert rows[2]["ms_per_frame"] == "" and "single precision" in told["rows"][2]["message"]
    assert "refused" in (out / "report.md").read_text()
    again, _ = study(program, scene, out, "--resume", *QUICK, "--product", *stiff, "--vary", "precision=float,double")
    assert again["rows"] == told["rows"]
    # A value that no run takes is a mistake.
    result = run(program, "study", scene, "-o", tmp_path / "other", *QUICK, *stiff)
    assert result.returncode == 3 and "1e+10" in result.stderr
    assert not (tmp_path / "other").exists()


def test_without_a_reference_there_is_no_study(program, scene, tmp_path):
    options = (*QUICK, "--set", "/limits/speed=1e-3", "--vary", "threads=1")
    for cap, message in (("1000", "reference: it diverges whatever its substeps"), ("4", "reference: there is nothing to measure against: frame 2")):
        result = run(program, "study", scene, "-o", tmp_path / cap, *options, "--reference-cap", cap)
        assert result.returncode == 4 and message in result.stderr
        assert result.stderr.count("wider limits") == 1


def test_that_a_run_leaves_more_than_its_tolerance_is_told_once(program, scene, tmp_path):
    result = run(program, "study", scene, "-o", tmp_path / "study", "--frames", "1-2", "--repeats", "3", "--reference-cap", "4",
                 "--set", '/model/substeps={"tolerance":1e-9,"max":2}', "--vary", "threads=1")  # fmt: skip
    assert result.returncode == 0 and result.stderr.count("above the tolerance") == 1, result.stderr


# ---- going on


def test_a_study_that_is_cut_goes_on_with_the_rows_it_has(program, scene, tmp_path):
    out = tmp_path / "study"
    options = ("--repeats", "3", "--frames", "1-3", "--vary", "/model/substeps=2,4,16,32,64")
    process = subprocess.Popen([program, "study", scene, "-o", out, *options], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        if line.startswith("run 2/"):
            process.send_signal(signal.SIGINT)
            break
    process.stdout.read()
    assert process.wait(60) == 128 + signal.SIGINT
    cut = json.loads((out / "study.json").read_text())
    lines = (out / "study.csv").read_text().splitlines()
    assert not cut["complete"] and 2 <= len(cut["rows"]) < 6
    assert "every run is the quickest of its accuracy" not in (out / "report.md").read_text()
    assert "`--resume` goes on" in (out / "report.md").read_text()

    told, rows = study(program, scene, out, "--resume", *options)
    assert told["complete"] and len(rows) == 6
    assert [row["ms_per_frame"] for row in told["rows"]][: len(cut["rows"])] == [row["ms_per_frame"] for row in cut["rows"]]
    assert told["reference"]["levels"] == cut["reference"]["levels"]
    assert (out / "study.csv").read_text().splitlines()[: len(cut["rows"]) + 1] == lines

    # A study of another scene is not gone on with, and nothing of this one is lost.
    kept = files(out)
    result = run(program, "study", scene, "-o", out, "--resume", *options, "--set", "/effects/gravity=[0,-5,0]")
    assert result.returncode == 2 and "cannot be gone on with: scene_hash is" in result.stderr
    assert files(out) == kept


def test_a_study_is_not_written_over_unasked(program, scene, tmp_path):
    options = (*QUICK, "--reference-cap", "8", "--vary", "/model/substeps=2")
    study(program, scene, tmp_path / "study", *options)
    result = run(program, "study", scene, "-o", tmp_path / "study", *options)
    assert result.returncode == 2 and "--resume goes on with it" in result.stderr

    # What is replaced is the study's own, and only once its settings are seen to be possible.
    note = tmp_path / "study/reference/note.txt"
    note.write_text("mine")
    kept = files(tmp_path / "study")
    refused = run(program, "study", scene, "-o", tmp_path / "study", "--overwrite", *options, "--vary", "/groom/particles=1")
    assert refused.returncode == 3 and files(tmp_path / "study") == kept
    told, _ = study(program, scene, tmp_path / "study", "--overwrite", *options[:4], "--reference-cap", "4", "--vary", "/model/substeps=1")
    assert note.read_text() == "mine"
    assert {path.name for path in note.parent.iterdir()} == {"note.txt", str(told["reference"]["substeps"])}

    (tmp_path / "study/study.json").write_text('{"mine": 1}')
    result = run(program, "study", scene, "-o", tmp_path / "study", "--overwrite", *options)
    assert result.returncode == 3 and "is no study" in result.stderr
    assert (tmp_path / "study/study.json").read_text() == '{"mine": 1}'


# ---- bad input, told before anything runs

BAD = [
    ("/model/substep=1", 3, "#/model/substep: found an unknown key"),
    ("/model/substeps=1,0", 3, "#/model/substeps: found 0, expected"),
    ("/model/type=ams,rods", 3, '#/model/type: found "rods"'),
    ("/groom/interpolate={\"count\":100000}", 3, "/groom/interpolate"),
    ("/groom/particles=1", 3, "#/groom/particles: found 1, expected an integer from 2"),
    ("precision=half", 2, "found `half`, expected float or double"),
    ("speed=1", 2, "neither a JSON pointer nor a setting"),
    ("/model/substeps", 2, "expected POINTER=V1,V2"),
    ("/frames/fps=24,48", 2, "would be of different times"),
]


@pytest.mark.parametrize("vary, code, message", BAD, ids=[vary for vary, _, _ in BAD])
def test_bad_values_are_told_before_anything_runs(program, scene, tmp_path, vary, code, message):
    result = run(program, "study", scene, "-o", tmp_path / "study", *QUICK, "--vary", vary)
    assert result.returncode == code and message in result.stderr
    assert not (tmp_path / "study").exists() and result.stdout == ""


@pytest.mark.parametrize(
    "option, message",
    [
        ("--budget=40km", "--budget: found `40km`"),
        ("--target=0", "--target: found `0`"),
        ("--frames=3-1", "--frames"),
        ("--reference=/model/x=1", "#/model/x: found an unknown key"),
        ("--reference=/frames/fps=48", "--reference /frames/fps=48: frames of the same number would be of different times"),
        ('--reference=/frames={"last":9}', "of different times, which are not compared (--set changes the times of all runs"),
        ("--frames=1-1", "no frame of these is stepped"),
    ],
)
def test_bad_options_are_told(program, scene, tmp_path, option, message):
    result = run(program, "study", scene, "-o", tmp_path / "study", option)
    assert result.returncode in (2, 3) and message in result.stderr
    assert not (tmp_path / "study").exists()
