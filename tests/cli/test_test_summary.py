"""The closing line of tools/test."""
import sys

import pytest

from conftest import SOURCE, run

CTEST = """<testsuite tests="4">
<testcase name="a" status="run"><system-out>[       OK ]</system-out></testcase>
<testcase name="b" status="fail"><failure message=""/></testcase>
<testcase name="c" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
<system-out>[ RUN      ] c
/somewhere/c_test.cpp:9: Skipped
no GPU here

[  SKIPPED ] c (0 ms)
</system-out></testcase>
<testcase name="d" status="disabled"><skipped message="Disabled"/></testcase>
<testcase name="g" status="notrun"><skipped message="Unable to find executable"/></testcase>
</testsuite>"""
PYTEST = """<testsuites><testsuite tests="2"><testcase name="e"/>
<testcase name="f"><skipped message="not built"/></testcase></testsuite></testsuites>"""


def summary(*reports):
    return run(sys.executable, SOURCE / "tools/test_summary.py", *reports)


@pytest.fixture
def reports(tmp_path):
    (tmp_path / "c.xml").write_text(CTEST)
    (tmp_path / "p.xml").write_text(PYTEST)
    return tmp_path


def test_totals_failures_and_reasons(reports):
    result = summary(f"ctest:8:{reports}/c.xml", f"pytest:0:{reports}/p.xml")
    assert result.returncode == 1
    assert result.stdout.splitlines()[-1] == "2 passed, 2 failed, 3 skipped"
    assert "FAILED ctest: b\nFAILED ctest: g\n" in result.stdout
    assert "SKIPPED (no GPU here):\n  ctest: c" in result.stdout
    assert "SKIPPED (not built):\n  pytest: f" in result.stdout


def test_all_passed(reports):
    result = summary(f"pytest:0:{reports}/p.xml")
    assert (result.returncode, result.stdout.splitlines()[-1]) == (0, "1 passed, 0 failed, 1 skipped")


def test_a_runner_that_died_is_a_failure(reports):
    result = summary(f"pytest:0:{reports}/p.xml", f"ctest:139:{reports}/missing.xml")
    assert (result.returncode, result.stdout.splitlines()[-1]) == (1, "1 passed, 1 failed, 1 skipped")
    result = summary(f"pytest:3:{reports}/p.xml")
    assert (result.returncode, result.stdout.splitlines()[-1]) == (1, "1 passed, 1 failed, 1 skipped")
