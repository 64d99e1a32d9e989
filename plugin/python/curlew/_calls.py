# SPDX-License-Identifier: Apache-2.0
"""Calls of the library that call Python functions: exceptions of these, Ctrl-C, and the end of the interpreter."""

import atexit
import os
import signal
import threading
import time
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, List, Optional

from . import _library as lib

Cancel = Optional[Callable[[], Any]]


class Failures:
    """The last exception of each field's function in a session, kept until none of the session's calls is left."""

    def __init__(self) -> None:
        self.calls = 0  #: number of calls that may raise them
        self.found: Dict[str, BaseException] = {}  #: by the field's name

    def behind(self, error: lib.Error) -> Optional[BaseException]:
        """Returns the exception that the library reports as this error; None if the error has another cause."""
        said = str(error)
        causes = (f for name, f in list(self.found.items()) if f"the function of the field '{name}' has failed" in said)
        return next(causes, None)


def call(failures: Failures, name: str, *arguments: Any, cancel: Cancel = None) -> None:
    """Like _library.call(), for a function that may call the functions of a session's fields.

    Raises the exception of a field's function itself. `cancel` asks the call to end.
    """
    with _entered(failures, cancel):
        try:
            lib.call(name, *arguments)
            return
        except lib.Error as error:
            failure = failures.behind(error)
            if failure is None:
                raise
    raise failure


# --- Ctrl-C -----------------------------------------------------------------------------------------------------------


def _may_guard(handler: Any) -> bool:
    return callable(handler) and threading.current_thread() is threading.main_thread()


@contextmanager
def ctrl_c_cancels(cancel: Callable[[], Any], seen: List[Any]) -> Iterator[None]:
    """While active, Ctrl-C calls `cancel`. Its usual effect follows afterwards.

    An exception raised directly would be lost if a callback has just been entered, since nothing can catch it there.
    """
    usual: Any = signal.getsignal(signal.SIGINT)
    if not _may_guard(usual):
        yield
        return

    def pressed(*what: Any) -> None:
        seen.append(what)
        cancel()

    signal.signal(signal.SIGINT, pressed)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if seen:
            usual(*seen[0])


#: What Ctrl-C has raised during an evaluation by the main thread; None outside of evaluations.
_postponed: Optional[List[BaseException]] = None


@contextmanager
def ctrl_c_waits() -> Iterator[None]:
    """While active, an exception that Ctrl-C raises is kept, and functions of fields fail. It is raised afterwards."""
    global _postponed
    usual: Any = signal.getsignal(signal.SIGINT)
    if not _may_guard(usual) or _postponed is not None:
        yield
        return
    raised: List[BaseException] = []

    def pressed(*what: Any) -> None:
        try:
            usual(*what)
        except BaseException as failure:  # pylint: disable=broad-except
            raised.append(failure)

    signal.signal(signal.SIGINT, pressed)
    try:
        _postponed = raised
        yield
    finally:
        _postponed = None
        signal.signal(signal.SIGINT, usual)
        if raised:
            raise raised[0]


def refused() -> bool:
    """Returns whether the function of a field must not be called on this thread any more, but fail."""
    return _stopping or (bool(_postponed) and threading.current_thread() is threading.main_thread())


# --- the end of the interpreter ---------------------------------------------------------------------------------------

_PATIENCE = 10.0  # seconds that the end of the interpreter waits for calls, in case that a callback never returns

_changed = threading.Condition()
_running: Dict[object, Cancel] = {}
_stopping = False
_ender: Optional[int] = None  # the thread that ends the interpreter


def _too_late() -> bool:
    return _ender is not None and _ender != threading.get_ident()


@contextmanager
def _entered(failures: Failures, cancel: Cancel) -> Iterator[None]:
    """Marks a call. Raises SystemExit, which ends the thread silently, if another thread ends the interpreter."""
    key = object()
    with _changed:
        if _too_late():
            raise SystemExit
        _running[key] = cancel
        failures.calls += 1
    try:
        yield
    finally:
        with _changed:
            _running.pop(key, None)  # a child process has forgotten it
            failures.calls -= 1
            if failures.calls == 0:
                failures.found.clear()
            _changed.notify_all()
        if _too_late():
            raise SystemExit


@atexit.register
def _end() -> None:
    """Ends the calls of daemon threads.

    Python would end such a thread when a callback next needs Python's lock. The library's code cannot be left in this
    way: the process would abort.
    """
    global _stopping, _ender
    limit = time.monotonic() + _PATIENCE
    with _changed:
        _stopping, _ender = True, threading.get_ident()
        try:
            while _running and time.monotonic() < limit:
                for cancel in filter(None, _running.values()):
                    cancel()
                _changed.wait(0.05)  # then cancels again what had not begun
        finally:
            _stopping = False


def _forget() -> None:
    """Forgets the calls of threads that a child process does not have."""
    global _changed
    _changed = threading.Condition()
    _running.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
