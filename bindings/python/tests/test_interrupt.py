import os
import signal
import threading
import time

import pytest


def test_ctrl_c_ends_the_work(scene):
    # A job that was started in the background hears no Ctrl-C, nor does Python in it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    begin = time.monotonic()
    timer.start()
    # Without Ctrl-C it would take ten minutes.
    with pytest.raises(KeyboardInterrupt):
        scene.measure(seconds=600, target_rel_error=1e-9, guide="off")
    assert 0.9 < time.monotonic() - begin < 60
    # The next call works as ever.
    assert scene.predict(forecast=False).members


def test_an_error_in_progress_ends_the_work_and_is_raised(scene):
    def progress(share, label):
        raise RuntimeError(label)

    with pytest.raises(RuntimeError, match="measuring|learning|preparing|reading|starting"):
        scene.measure(seconds=600, target_rel_error=1e-9, guide="off", progress=progress)


def test_other_threads_of_python_go_on_meanwhile(scene):
    done = threading.Event()
    counted = 0

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.01)

    thread = threading.Thread(target=count)
    thread.start()
    scene.measure(seconds=2, target_rel_error=1e-9, guide="off")
    done.set()
    thread.join()
    # A thread that had to wait for the lock would count to one or two.
    assert counted > 20
