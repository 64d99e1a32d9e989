# SPDX-License-Identifier: Apache-2.0
"""Checks the tags of the C++ tests: run.py TESTS.

The first tag is the room, the folder in tests/. There are two others: [command] for tests that run the command in a process of its
own, and [simd] for those that tests/CMakeLists.txt runs again with each instruction set. [.] in front hides a test.
"""

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
        allowed = {f"[{path.parent.name}]{second}" for second in ("", "[command]", "[simd]")}
        wrong += [f"{path.name}: {name} has the tags {tags}; allowed are {', '.join(sorted(allowed))}" for name, tags in found
                  if tags.removeprefix("[.]") not in allowed]
        for test in re.split(r"^(?=TEST_CASE)", text, flags=re.M)[1:]:
            if re.search(r"\bmust(Run|Fail)\(", test.split("\n}\n")[0]) and "[command]" not in test.split("{")[0]:
                wrong.append(f"{path.name}: {test.splitlines()[0]} runs the command and must have the tag [command]")
    return "\n".join(wrong) or 0


sys.exit(main(sys.argv[1]))
