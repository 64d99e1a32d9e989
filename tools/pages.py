#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renews what is made by the command in README.md, docs/actions.md and docs/noises.md, between <!-- NAME:begin --> and <!-- NAME:end -->.

./dev docs and ./dev noises run it.
"""

import argparse
import difflib
import json
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NOISES = ROOT / "docs/noises.md"
# The noises in the table of ranges, with their dimensions.
RANGES = {"psrd": "2 3", "psrd lattice=perlin": "3", "psrd rotation=fast": "3", "value": "1 2 3", "perlin": "1 2 3",
          "perlin gradients=reference": "3", "gradient": "2 3", "simplex": "2 3 4 5 6 7",
          "simplex power=3": "2 3 4 5 6 7", "sine": "1 2 3"}


def replaced(page, name, text):
    """Returns the page with the text of the named part replaced."""
    begin, end = f"<!-- {name}:begin -->\n", f"<!-- {name}:end -->\n"
    if page.count(begin) != 1 or page.count(end) != 1 or page.index(begin) > page.index(end):
        raise ValueError(f"the page must contain '{begin.strip()}' and '{end.strip()}' once each, on separate lines")
    return page[:page.index(begin) + len(begin)] + f"\n{text}\n" + page[page.index(end):]


def renew(name, part, text, check):
    """Renews a part of a page; if `check`, only compares it. Returns whether the page is now up to date."""
    path = ROOT / name
    old = path.read_text()
    new = replaced(old, part, text)
    if new == old:
        print(f"docs: {name} is up to date", file=sys.stderr)
    elif check:
        difference = difflib.unified_diff(old.splitlines(), new.splitlines(), name, "generated", lineterm="")
        print("\n".join(list(difference)[:40]), file=sys.stderr)
        print(f"docs: {name} is out of date; run ./dev docs", file=sys.stderr)
    else:
        path.write_text(new)
        print(f"docs: {name} rewritten", file=sys.stderr)
    return new == old or not check


def generated(curlew, check):
    """Renews the table of actions and the README's example of the library. Returns whether both are now up to date."""
    actions = subprocess.run([curlew, "-help", "format=markdown"], check=True, capture_output=True, text=True).stdout
    _licence, example = (ROOT / "tests/app/ReadmeExample.cpp").read_text().split("\n", 1)
    pages = [("docs/actions.md", "actions", actions), ("README.md", "example", f"```cpp\n{example}```\n")]
    return all([renew(*page, check) for page in pages])


def range_row(curlew, noise, dim, folder):
    """Returns a row of the table of ranges, measured from a million values."""
    report = Path(folder) / "report.json"
    kind, *options = noise.split()
    subprocess.run([curlew, "-quiet", "-noise", f"type={kind}", f"dimensions={dim}", *options, "-check",
                    "box=-500,-500,-500,500,500,500", "samples=1e6", f"report={report}"], check=True)
    found = json.loads(report.read_text())
    figures = [found[f"field_{name}"] for name in ("min", "max", "rms", "rms_gradient")]
    return f"| {noise} | {dim} | " + " | ".join(f"{figure:.3f}" for figure in figures) + " |\n"


def noises(curlew):
    """Renews docs/noises.md. In each row with a picture, the last text in backticks contains the actions that make
    it."""
    page = NOISES.read_text()
    for name, actions in re.findall(r"^\| !\[([^]]+)\].*`([^`]+)` \|$", page, re.M):
        print(f"noises: {name}: {actions}", file=sys.stderr)
        if "-slice" not in actions:
            actions += " -slice"
        subprocess.run([curlew, "-quiet", *shlex.split(actions), "box=-2,-2,-2,2,2,2", "width=180", "-write", "legend=0",
                        ROOT / f"docs/noises/{name}.png"], check=True)
    table = "| noise | dim | min | max | rms | rms of the gradient |\n|---|---|---|---|---|---|\n"
    with tempfile.TemporaryDirectory() as folder:
        for noise, dims in RANGES.items():
            for dim in dims.split():
                table += range_row(curlew, noise, dim, folder)
    NOISES.write_text(replaced(page, "ranges", table))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("page", choices=["generated", "noises"])
    parser.add_argument("--check", action="store_true", help="only check whether the pages are up to date")
    parser.add_argument("--command", default=ROOT / "build/curlew", type=Path, help="the curlew to run")
    options = parser.parse_args()
    curlew = options.command.resolve()
    if options.page == "noises":
        noises(curlew)
    elif not generated(curlew, options.check):
        sys.exit(1)


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError, subprocess.CalledProcessError) as problem:
        sys.exit(f"docs: {problem}")
