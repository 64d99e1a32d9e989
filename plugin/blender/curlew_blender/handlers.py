# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers of Blender's events."""

from typing import Callable, Tuple

import bpy


def factory(*handlers: Tuple[str, Callable[..., None]]) -> Tuple[Callable[[], None], Callable[[], None]]:
    """Returns two functions: one adds these handlers to the lists with these names, the other removes them."""

    def add() -> None:
        for name, handler in handlers:
            getattr(bpy.app.handlers, name).append(handler)

    def remove() -> None:
        for name, handler in handlers:
            getattr(bpy.app.handlers, name).remove(handler)

    return add, remove
