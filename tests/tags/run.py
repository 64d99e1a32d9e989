# SPDX-License-Identifier: Apache-2.0
"""Checks that the first tag of every C++ test is its room, the folder in tests/: run.py TESTS."""

import re
import sys
from pathlib import Path

TEST = re.compile(r'TEST_CASE(?:_SIG)?\(\s*("(?:[^"\\]|\\.)*"(?:\s*"(?:[^"\\]|\\.)*")*),\s*"((?:\[[^"\]]*\])+)"')


def main(tests):
    wrong = []
    for path in sorted(Path(tests).glob("*/*Test.cpp")):
        text = path.read_text(encoding="utf-8")
        found = TEST.findall(text)
        if len(found) != text.count("TEST_CASE"):
            wrong.append(f"{path.name}: a test has no tags")
        room = f"[{path.parent.name}]"
        wrong += [f"{path.name}: {name} must begin with the tag {room}" for name, tags in found
                  if not tags.removeprefix("[.]").startswith(room)]
    return "\n".join(wrong) or 0


sys.exit(main(sys.argv[1]))
