"""Totals JUnit reports: names what failed and what was skipped and why, ends with `N passed, N failed, N skipped`.

usage: test_summary.py RUNNER:EXIT_CODE:REPORT...   Exits 1 if a test failed, a runner did, or a report is missing.
"""
import collections
import re
import sys
import xml.etree.ElementTree as ElementTree

GOOGLETEST_SKIP = re.compile(r": Skipped\n(?P<reason>.*?)\n+(?:\[|\Z)", re.DOTALL)


def skip_reason(case):
    """GoogleTest prints why it skips; pytest says it in the report."""
    match = GOOGLETEST_SKIP.search(case.findtext("system-out") or "")
    reason = match["reason"] if match else case.find("skipped").get("message") or "no reason given"
    return " ".join(reason.split())


def read_report(runner, path):
    """Yields (test, "passed" or "failed" or "skipped", reason)."""
    for case in ElementTree.parse(path).iter("testcase"):
        name = f"{runner}: {case.get('name')}"
        skipped = case.find("skipped")
        if case.find("failure") is not None or case.find("error") is not None:
            yield name, "failed", ""
        elif skipped is None:
            yield name, "passed", ""
        elif skipped.get("message") == "Unable to find executable":  # ctest, of what was not built
            yield name, "failed", ""
        else:
            yield name, "skipped", skip_reason(case)


def main(reports):
    outcomes = collections.defaultdict(list)
    for report in reports:
        runner, code, path = report.split(":", 2)
        try:
            cases = list(read_report(runner, path))
        except (OSError, ElementTree.ParseError) as error:
            cases = [(f"{runner}: no report: {error}", "failed", "")]
        if code != "0" and not any(outcome == "failed" for _, outcome, _ in cases):
            cases.append((f"{runner}: exited with {code}", "failed", ""))
        for name, outcome, reason in cases:
            outcomes[outcome].append((name, reason))
    by_reason = collections.defaultdict(list)
    for name, reason in outcomes["skipped"]:
        by_reason[reason].append(name)
    for reason, names in by_reason.items():
        print(f"SKIPPED ({reason}):", *names, sep="\n  ")
    for name, _ in outcomes["failed"]:
        print(f"FAILED {name}")
    print(", ".join(f"{len(outcomes[outcome])} {outcome}" for outcome in ("passed", "failed", "skipped")))
    return 1 if outcomes["failed"] or not outcomes["passed"] else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
