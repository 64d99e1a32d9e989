# SPDX-License-Identifier: Apache-2.0
"""The package: the library, the registry, errors."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import curlew
from conftest import FLOW

ENDLESS = "scatter count=1000\nadvect steps=1e9\n"


def test_the_registry_has_all_that_nodes_need():
    actions = {action["name"]: action for action in curlew.registry()["actions"]}
    noise = {option["name"]: option for option in actions["noise"]["options"]}
    assert noise["type"]["choices"][0] == "psrd" and noise["type"]["default"] == "psrd"
    assert noise["frequency"]["lower"] == 0 and noise["frequency"]["exclusive"] and noise["frequency"]["upper"] is None
    assert noise["octaves"]["upper"] == 32 and noise["octaves"]["type"] == "integer"
    f, g, _ = actions["dfvn"]["inputs"]
    assert f["kinds"] == ["field"] and (f["maximum"], f["use"]) == (1, "taken")
    assert g["minimum"] == 0 and actions["dfvn"]["outputs"][0]["kinds"] == ["flow"]
    noise_input, wall = actions["bound"]["inputs"]
    assert noise_input["kinds"] == ["noise"] and wall["kinds"] == ["shape", "levelSet"] and wall["use"] == "stays"
    assert actions["read"]["positional"] == {"what": "FILE …", "minimum": 1, "maximum": 1000}
    for action in actions.values():
        about = {"name", "group", "summary", "details", "short_name", "inputs", "outputs", "options", "positional", "examples"}
        assert about | {"evaluation", "in_frames", "setting", "varies"} == set(action)
        assert all(option["selects"] for option in action["options"] if option["type"] == "ages")


def test_what_is_read_and_written_is_known_to_programs_where_it_is_told_to_readers(tmp_path):
    """The registry lists inputs and outputs for each action whose help mentions them."""
    said = []
    with curlew.Session() as session:
        session.run("help format=markdown", on_message=said.append)
    rows = [line.split(" | ") for line in "".join(said).splitlines() if line.startswith("| `-")]
    actions = {action["name"]: action for action in curlew.registry()["actions"]}
    assert len(rows) == len(actions)
    for row in rows:
        action = actions[row[0].strip("|` -")]
        assert (row[2].strip() == "") <= (action["inputs"] == [] or action["name"] == "report"), row
        assert (row[2].strip() != "") <= (action["inputs"] != []), row
        assert (row[3].strip(" |") != "") <= (action["outputs"] != []), row


def test_a_library_that_is_not_there_is_an_error_that_names_it():
    environment = dict(os.environ, CURLEW_LIBRARY="/no/such/libcurlew.so")
    code = "import curlew\ntry: curlew.version()\nexcept curlew.Error as e: print(e)"
    done = subprocess.run([sys.executable, "-B", "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert "/no/such/libcurlew.so" in done.stdout
    # A different library.
    environment["CURLEW_LIBRARY"] = os.path.realpath(np.core._multiarray_umath.__file__)
    done = subprocess.run([sys.executable, "-B", "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert "cannot load" in done.stdout


def test_nothing_is_printed(capfd):
    with curlew.Session() as session:
        session.run(FLOW + "verbose\nhelp\nversion\nlist\nprint\nvelocity dim=16\ncheck samples=100\n")
        with pytest.raises(curlew.Error):
            session.run("nonsense")
    assert capfd.readouterr() == ("", "")


def test_errors_tell_the_line_and_the_action(session):
    with pytest.raises(curlew.Error, match="did you mean 'frequency'") as error:
        session.run("noise\n\nnoise freqency=2\n")
    assert (error.value.line, error.value.action) == (3, "noise")
    with pytest.raises(curlew.Error, match="flow") as error:
        session.run("# first\nnoise\nvelocity\n")
    assert (error.value.line, error.value.action) == (3, "velocity")
    with pytest.raises(curlew.Error) as error:
        session.points()
    assert (error.value.line, error.value.action) == (None, None)
    with pytest.raises(curlew.Error, match="character NUL"):
        session.run("noise\0")
    with pytest.raises(curlew.Error, match="my scene:1"):
        session.run("nonsense", name="my scene")


def test_a_closed_session_says_so():
    session = curlew.Session()
    session.close()
    session.close()
    with pytest.raises(curlew.Error, match="closed"):
        session.run("noise")


def test_progress_can_cancel_and_callbacks_may_fail(session):
    seen = []
    session.run(FLOW + "velocity dim=32\n", progress=lambda title, fraction: seen.append((title, fraction)))
    assert seen and all(0 <= fraction <= 1 for _, fraction in seen)
    with pytest.raises(curlew.Cancelled) as error:
        session.run(ENDLESS, progress=lambda title, fraction: title == "advect")
    assert error.value.action == "advect"
    with pytest.raises(ZeroDivisionError):
        session.run(ENDLESS, progress=lambda title, fraction: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        session.run("print\n" + ENDLESS, on_message=lambda text: 1 / 0)
    assert len(session.grids()) == 1


def interrupted(arguments):
    """Interrupts a process that runs an endless program. Returns its error output."""
    code = f"import curlew\nprint(flush=True)\ncurlew.Program('''{FLOW}{ENDLESS}''').run({arguments})"
    with subprocess.Popen([sys.executable, "-B", "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        running.stdout.readline()
        time.sleep(0.3)
        running.send_signal(signal.SIGINT)
        try:
            _, complaint = running.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            running.kill()
            raise
    return complaint.decode()


@pytest.mark.parametrize("arguments", ["", "progress=lambda title, fraction: False"])
def test_ctrl_c_ends_a_program(arguments):
    for _ in range(2):  # the signal may arrive anywhere
        complaint = interrupted(arguments)
        assert complaint.endswith("KeyboardInterrupt\n")
        assert "ignored" not in complaint


def test_ctrl_c_does_what_it_did_before():
    usual = signal.getsignal(signal.SIGINT)
    seen = []
    signal.signal(signal.SIGINT, lambda *_: seen.append(1))
    try:
        with curlew.Session() as session, pytest.raises(curlew.Cancelled):
            session.run(FLOW + ENDLESS, progress=lambda title, fraction: signal.raise_signal(signal.SIGINT))
        signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, usual)
    assert len(seen) == 2


def pressing(session):
    """Provides a field and returns it with a list: while it has an entry, the field's function presses Ctrl-C."""
    pressed = []

    def function(x):
        if pressed and threading.current_thread() is threading.main_thread():
            pressed.append("before")
            signal.raise_signal(signal.SIGINT)
            pressed.append("after")
        return x.sum(1), np.ones_like(x)

    session.provide_field("q", function)
    session.run("read q\nnoise\ndfvn keep=1")
    return session.field(1), pressed


@pytest.mark.parametrize("count", [1, 100000])
def test_ctrl_c_ends_an_evaluation(session, count):
    field, pressed = pressing(session)
    positions = np.ones((count, 3))
    for evaluate in (field.value, session.flow().velocity):
        pressed[:] = [True]
        with pytest.raises(KeyboardInterrupt):
            evaluate(positions)
        # No exception is raised in the function, since it would be lost just outside of it. It is not called again.
        assert pressed == [True, "before", "after"]
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    pressed.clear()
    assert (field.value(positions) == 3).all()


def test_ctrl_c_without_an_exception_does_not_end_an_evaluation(session):
    usual, seen = signal.getsignal(signal.SIGINT), []
    field, pressed = pressing(session)
    signal.signal(signal.SIGINT, lambda *_: seen.append(1))
    try:
        pressed.append(True)
        assert field.value(np.ones((1, 3))) == 3
    finally:
        signal.signal(signal.SIGINT, usual)
    assert seen == [1]


def test_ctrl_c_in_an_evaluation_ends_the_program_around_it(session):
    field, pressed = pressing(session)

    def on_frame(frame, same):
        pressed.append(True)
        field.value(np.ones((1, 3)))
        pressed.clear()

    with pytest.raises(KeyboardInterrupt):
        session.run("frames 1-1000000\nnoise\nslice width=4", on_frame=on_frame)


DAEMON = """
import threading
import curlew
import numpy as np

begun = threading.Event()

def begin(*_):
    begun.set()

def function(x):
    if threading.current_thread() is not threading.main_thread():
        begun.set()
    return x.sum(1), np.ones_like(x)

session = curlew.Session()
session.provide_field("q", function)
session.run("read q")
field = session.field()

def work():
    while True:
        try:
            {work}
        except Exception:
            pass  # begins again

threading.Thread(target=work, daemon=True).start()
begun.wait()
raise SystemExit(3)
"""


@pytest.mark.parametrize(
    "work",
    [
        f"session.run({FLOW + ENDLESS!r}, progress=begin)",
        "session.run('frames 1-1000000\\nnoise\\nslice width=4', on_frame=begin)",
        "session.run('frames 1-1000000\\nnoise\\nslice width=4', on_message=print, on_frame=begin)",
        f"session.run({'read q' + chr(10) + FLOW.split(chr(10), 1)[1] + ENDLESS!r})",
        "field.value(np.zeros((10**6, 3)))",
    ],
)
def test_daemon_threads_do_not_abort_the_end_of_the_process(work):
    done = subprocess.run([sys.executable, "-B", "-c", DAEMON.replace("{work}", work)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (3, "")


def test_another_thread_can_cancel(session):
    started = threading.Event()
    session.run(FLOW)

    def cancel():
        started.wait()
        session.cancel()

    canceller = threading.Thread(target=cancel)
    canceller.start()
    with pytest.raises(curlew.Cancelled):
        session.run(ENDLESS, progress=lambda title, fraction: started.set())
    canceller.join()


def test_sessions_in_threads_do_not_disturb_each_other():
    results, errors = {}, []

    def work(number):
        try:
            with curlew.Session() as session:
                with pytest.raises(curlew.Error, match=f"-foo{number}'"):
                    session.run(f"foo{number}")
                session.run(FLOW + "scatter count=500\nadvect steps=5\n")
                results[number] = session.points().positions
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    for number in range(1, 4):
        assert np.array_equal(results[0], results[number])


def test_a_program_is_checked_when_it_is_made():
    with pytest.raises(curlew.Error) as error:
        curlew.Program("noise\nnoise seed=x")
    assert error.value.line == 2
    program = curlew.Program(FLOW)
    assert program.flow().velocity([[0.1, 0.2, 0.3]]).shape == (1, 3)


def test_a_session_that_runs_cannot_be_closed():
    session = curlew.Session()
    refused = []

    def close(*_):
        with pytest.raises(curlew.Error, match="running") as error:
            session.close()
        refused.append(error.value)

    def close_beside(*_):
        other = threading.Thread(target=close)
        other.start()
        other.join()

    session.run("noise\nframes 1-2\nslice width=4\n", on_frame=close)
    session.run("noise\nframes 1-2\nslice width=4\n", on_frame=close_beside)
    assert len(refused) == 4
    session.run("slice width=4\n")  # the session is still usable
    assert session.image().pixels.shape[:2] == (4, 4)
    session.close()
    session.close()
