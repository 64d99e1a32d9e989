# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls that the thread of a render hands to the main thread.

A render from the user interface calls handlers in its own thread. Nearly every change of Blender's data there also adds
a notifier to a queue that the main thread reads without a lock, so that Blender crashes sooner or later, even with
Render > Lock Interface.
"""

import collections
import functools
import threading
import time
from typing import Any, Callable, Deque, Optional, TypeVar, cast

import bpy

_PERIOD = 0.1  # seconds between looks at the calls
_RENDERING = 0.005  # the same while Blender renders
_TRIES = 200
_LIMIT = 10.0  # seconds without a look after which a call fails
_CALLER = 0.5  # seconds between the caller's looks at that limit

_calls: Deque["_Call"] = collections.deque()
_looked = 0.0  # when step() was last called

Function = TypeVar("Function", bound=Callable[..., Any])


class _Call:
    """A call that waits for the main thread."""

    def __init__(self, function: Callable[[], Any]) -> None:
        self.function = function
        self.made = time.monotonic()
        self.tries = 0
        self.done = threading.Event()
        self.result: Any = None
        self.error: Optional[BaseException] = None

    def run(self) -> bool:
        """Returns False if Blender has refused a change and the call is to be made again. Blender does so while it calls
        the draw function of a panel, in whichever thread: "Writing to ID classes in this context is not allowed"."""
        self.tries += 1
        try:
            self.result = self.function()
        except BaseException as error:  # the caller must not wait forever
            if "in this context is not allowed" in str(error) and self.tries < _TRIES:
                return False
            self.error = error
        self.done.set()
        return True

    def wait(self) -> Any:
        """Returns the result, or raises the call's error. Raises RuntimeError if the main thread does not take calls."""
        while not self.done.wait(_CALLER):
            if time.monotonic() - max(_looked, self.made) > _LIMIT:
                try:
                    _calls.remove(self)
                except ValueError:
                    continue  # it runs
                raise RuntimeError(f"Curlew: the user interface has not answered the render for {_LIMIT:.0f} s")
        if self.error is not None:
            raise self.error
        return self.result


def in_main_thread(function: Function) -> Function:
    """Makes a function run in the main thread, from whichever thread it is called. The caller waits for it. It must be
    safe to run again after Blender has refused one of its changes."""

    @functools.wraps(function)
    def handed_over(*arguments: Any) -> Any:
        if threading.current_thread() is threading.main_thread():
            return function(*arguments)
        call = _Call(functools.partial(function, *arguments))
        _calls.append(call)
        return call.wait()

    return cast(Function, handed_over)


def step() -> float:
    """The timer: makes the calls that wait."""
    global _looked
    _looked = time.monotonic()
    while _calls:
        call = _calls.popleft()
        if not call.run():
            _calls.appendleft(call)
            break
    return _RENDERING if _calls or bpy.app.is_job_running("RENDER") else _PERIOD


def register() -> None:
    """Starts the timer. A render's thread cannot: Blender's list of timers has no lock either."""
    bpy.app.timers.register(step, first_interval=_PERIOD, persistent=True)


def unregister() -> None:
    """Stops the timer."""
    bpy.app.timers.unregister(step)
