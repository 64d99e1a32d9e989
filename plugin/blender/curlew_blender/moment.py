"""The moment that a still shows, in place of the variables of expressions. Needs no Blender."""

import re
from dataclasses import dataclass

_PARTS = re.compile(r"\{\{|\$\$|\$F([1-9]?)|\{[^}]*\}")
_NAMES = re.compile(r"\b(?:FF|F|T|fps)\b")


@dataclass(frozen=True)
class Moment:
    """A frame, and its time in seconds since the first one. That of a scene without `frames` is the default."""

    frame: int = 1
    time: float = 0.0
    fps: float = 24.0

    def at(self, text: str) -> str:
        """A word or a value of a scene, as of this moment."""

        def number(found: "re.Match[str]") -> str:
            return f"({ {'T': self.time, 'fps': self.fps}.get(found[0], self.frame)!r})"

        def part(found: "re.Match[str]") -> str:
            if found[0] in ("{{", "$$"):
                return found[0]
            if found[0].startswith("{"):
                return _NAMES.sub(number, found[0])
            return f"{self.frame:0{found[1] or 0}d}"

        return _PARTS.sub(part, text)
