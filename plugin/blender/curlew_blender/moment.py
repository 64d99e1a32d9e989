"""The moment that a still shows, in place of the variables of expressions. Needs no Blender."""

import re
from dataclasses import dataclass

_PARTS = re.compile(r"\{\{|\$\$|\$F([1-9]?)|\{[^}]*\}")
_NAMES = re.compile(r"\b(?:FF|F|T|fps)\b")


@dataclass(frozen=True)
class Moment:
    """A frame, and its time in seconds since the scene's first one."""

    frame: int
    time: float
    fps: float

    def at(self, text: str) -> str:
        """A word or a value of a scene, as of this moment. Without `frames`, a scene itself is of frame 1."""

        def number(found: "re.Match[str]") -> str:
            return f"({ {'T': self.time, 'fps': self.fps}.get(found[0], self.frame)!r})"

        def part(found: "re.Match[str]") -> str:
            if found[0] in ("{{", "$$"):
                return found[0]
            if found[0].startswith("{"):
                return _NAMES.sub(number, found[0])
            return f"{self.frame:0{found[1] or 0}d}"

        return _PARTS.sub(part, text)
