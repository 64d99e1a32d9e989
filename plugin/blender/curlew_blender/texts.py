# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of nodes that may contain expressions: {0.5*T}, $F4, #### and %04d. The library evaluates them; here is what the
add-on must know before."""

import glob
import os
import re
from typing import List, Union

from . import library

# An escape, the frame (as $F4, #### or %04d), or something else that only the library can evaluate.
_PART = re.compile(r"(?P<escape>\{\{|\$[$#%])|(?P<frame>\$F(?P<dollar>[1-9]?)|#{2,}|%0?(?P<percent>[1-9]?)d)|(?P<other>\{[^}]*\}?|\$)")


def plain(text: str) -> str:
    """Escapes a text, so that it contains no expressions."""
    escaped: str = library.curlew().escaped(text)
    return escaped


def varies(text: str) -> bool:
    """Returns whether a text contains an expression, which may have another value in another frame."""
    return any(found.lastgroup != "escape" for found in _groups(text) if not isinstance(found, str))


def files(text: str, frame: int) -> List[str]:
    """Returns the paths that a text may name in a frame. In an absolute path, an expression in braces stands for any characters
    of the names of existing files."""
    path, pattern, exact = "", "", True
    for part in _groups(text):
        if isinstance(part, str):
            now = part
        elif part["escape"]:
            now = part[0][-1]
        elif part["frame"]:
            width = len(part[0]) if part[0].startswith("#") else int(part["dollar"] or part["percent"] or 0)
            now = f"{frame:0{width}d}"
        else:
            pattern, exact = pattern + "*", False
            continue
        path, pattern = path + now, pattern + glob.escape(now)
    return [path] if exact else sorted(glob.glob(pattern)) if os.path.isabs(pattern) else []


def _groups(text: str) -> List[Union[str, "re.Match[str]"]]:
    """Returns the parts of a text: strings, and matches of what is special."""
    parts: List[Union[str, "re.Match[str]"]] = []
    end = 0
    for found in _PART.finditer(text):
        parts += [text[end:found.start()], found]
        end = found.end()
    return parts + [text[end:]]
