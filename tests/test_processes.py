"""Processes: in every kind of child, memo gives the numbers of its parent, whatever the parent did before.

Each case is a program of its own with a time limit, so that a child that waits for ever fails the test.
"""

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys

import memo
import numpy as np
import pytest
from memo import _memo

LIMIT_S = 100

# What every program begins with: work that reaches the threads of tracker, planar figures and postures.
WORK = '''
import hashlib, multiprocessing, os, sys, threading, time
import numpy as np
import memo
from memo import _memo

def digest(found):
    """One number for all numbers of an answer."""
    total = hashlib.sha256()
    def add(part):
        if isinstance(part, dict):
            for key in sorted(part):
                add(key), add(part[key])
        elif isinstance(part, (list, tuple)):
            for one in part:
                add(one)
        elif isinstance(part, np.ndarray):
            total.update(part.tobytes())
        elif type(part).__module__ == "memo._memo":
            add(part.__getnewargs__())
        else:
            total.update(repr(part).encode())
    add(found)
    return total.hexdigest()

FRAMES = 12

def new_tracker():
    return _memo.Tracker(1.75, start_frames=5, adapt=False)

def drawn(index):
    scene = _memo.Scene(5, frames=FRAMES)
    return np.ascontiguousarray(scene.frame(index)[::2, ::2]), scene.time_s(index)

def update(tracker, index):
    tracker.update(*drawn(index))

def walks(tracker):
    tracker.finish()
    return [walk.columns for walk in tracker.take_finished()]

def tracked():
    tracker = new_tracker()
    for index in range(FRAMES):
        update(tracker, index)
    found = walks(tracker)
    assert len(found) == 1
    return found

def figure():
    motion = memo.walker_motion(60)
    shown = memo.pointlight(motion.positions, motion.times_s, motion.names, azimuth_deg=90.0)
    return _memo.planar(shown.positions_px[:, :6], motion.times_s, 0.5)

def postures(frames=4, progress=None):
    joints, _ = _memo.lee_chen_walker("SEQ1", frames)
    points = 800.0 * joints[..., :2] / joints[..., 2:] + (320.0, 240.0)
    camera = memo.Camera.level((640, 480), 45.0, 1.0, 4.0)
    times, weights = np.arange(frames) / 25, np.ones((frames, 14))
    return _memo.posture(times, points, weights, camera, height_m=1.75, max_groups=4, progress=progress)

def work(_=None):
    return digest([tracked(), figure(), postures()])

def say(found):
    """A line in one piece, whatever processes write at the same time."""
    os.write(1, f"{found}\\n".encode())

def waited(child):
    """The exit code of a forked child."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
'''


def run(tmp_path, body, **environment):
    """The program's output; the program and its children are ended after the limit."""
    program = tmp_path / "program.py"
    program.write_text(WORK + '\nif __name__ == "__main__":\n' + body)
    environment = {**os.environ, "RAYON_NUM_THREADS": "2", "PYTHONWARNINGS": "ignore", **environment}
    with subprocess.Popen(
        [sys.executable, str(program)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as child:
        try:
            out, err = child.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            pytest.fail(f"no end within {LIMIT_S} s")
        finally:
            child.kill()
    assert child.returncode == 0, err
    return out.split()


methods = pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")


@methods
def test_a_multiprocessing_pool_gives_the_parents_numbers(tmp_path, method):
    body = f"""
    mine = work()
    with multiprocessing.get_context({method!r}).Pool(2) as pool:
        print(mine, *pool.map(work, range(2)))
"""
    assert len(set(run(tmp_path, body))) == 1


@methods
def test_an_executor_of_processes_gives_the_parents_numbers(tmp_path, method):
    body = f"""
    from concurrent.futures import ProcessPoolExecutor
    mine = work()
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context({method!r})) as pool:
        print(mine, *pool.map(work, range(2)))
"""
    assert len(set(run(tmp_path, body))) == 1


def test_loky_gives_the_parents_numbers(tmp_path):
    body = """
    from joblib import Parallel, delayed
    mine = work()
    print(mine, *Parallel(n_jobs=2, backend="loky")(delayed(work)(seed) for seed in range(2)))
"""
    assert len(set(run(tmp_path, body))) == 1


@forks
def test_a_fork_of_a_fork_gives_the_parents_numbers(tmp_path):
    body = """
    say(work())
    if not (child := os.fork()):
        say(work())
        if not (grandchild := os.fork()):
            say(work())
            os._exit(0)
        os._exit(waited(grandchild))
    code = waited(child)
    say(work())
    sys.exit(code)
"""
    found = run(tmp_path, body)
    assert len(found) == 4
    assert len(set(found)) == 1


@forks
def test_a_child_is_not_held_up_by_what_other_threads_of_its_parent_compute(tmp_path):
    body = """
    found = [work()]
    ended = threading.Event()
    def busy():
        while not ended.is_set():
            work()
    thread = threading.Thread(target=busy)
    thread.start()
    for _ in range(3):
        time.sleep(0.05)
        read, write = os.pipe()
        if not (child := os.fork()):
            os.write(write, work().encode())
            os._exit(0)
        os.close(write)
        found.append(os.read(read, 100).decode())
        assert waited(child) == 0
    ended.set()
    thread.join()
    print(*found)
"""
    found = run(tmp_path, body)
    assert len(found) == 4
    assert len(set(found)) == 1


@forks
def test_a_tracker_goes_on_in_a_child_that_was_forked_between_two_frames(tmp_path):
    body = """
    tracker, child = new_tracker(), None
    for index in range(FRAMES):
        if index == 9:
            assert tracker.people()
            child = os.fork()
        update(tracker, index)
    say(digest(walks(tracker)))
    if child == 0:
        os._exit(0)
    say(digest(tracked()))
    sys.exit(waited(child))
"""
    found = run(tmp_path, body)
    assert len(found) == 3
    assert len(set(found)) == 1


@forks
def test_a_tracker_at_work_while_its_process_is_forked_is_refused_in_the_child(tmp_path):
    body = """
    codes, rounds = set(), 0
    while 4 not in codes and rounds < 30:  # whether a fork meets it at work is chance
        rounds += 1
        tracker = new_tracker()
        thread = threading.Thread(target=lambda: [update(tracker, index) for index in range(FRAMES)])
        thread.start()
        while thread.is_alive():
            if not (child := os.fork()):
                refused = 0
                for ask in [tracker.people, tracker.seek_report, tracker.take_finished, tracker.finish]:
                    try:
                        ask()
                    except RuntimeError as error:
                        assert "forked" in str(error), error
                        refused += 1
                os._exit(refused)
            codes.add(waited(child))
    print(codes <= {0, 4} and 4 in codes, len(walks(tracker)))
"""
    assert run(tmp_path, body) == ["True", "1"]


@forks
def test_a_call_whose_callback_forks_ends_in_the_child_with_an_error(tmp_path):
    body = """
    children = []
    def fork(done, total):
        if not children:
            children.append(os.fork())
    try:
        found = digest(postures(80, fork))
    except RuntimeError as error:
        assert children == [0] and "forked" in str(error), error
        os._exit(7)
    assert found == digest(postures(80))
    print(waited(children[0]))
"""
    assert run(tmp_path, body) == ["7"]


@pytest.mark.parametrize("threads", [1, 2])
def test_many_threads_of_python_share_the_threads_of_a_process(tmp_path, threads):
    body = """
    from concurrent.futures import ThreadPoolExecutor
    with ThreadPoolExecutor(6) as crew:
        print(work(), *crew.map(work, range(6)))
"""
    found = run(tmp_path, body, RAYON_NUM_THREADS=str(threads))
    assert len(found) == 7
    assert len(set(found)) == 1


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this system has no timers that signal")
def test_a_tracker_goes_on_after_an_interrupt_with_the_frame_that_it_interrupted(tmp_path):
    body = """
    import signal
    class Interrupted(Exception):
        pass
    def interrupt(*_):
        if armed:
            raise Interrupted
    armed = False
    expected = digest(tracked())
    tracker, interrupted = new_tracker(), 0
    signal.signal(signal.SIGALRM, interrupt)
    for index in range(FRAMES):
        frame = drawn(index)
        while tracker.seek_report().frames == index:
            armed = True
            try:
                try:
                    signal.setitimer(signal.ITIMER_REAL, 0.001)
                    tracker.update(*frame)
                finally:
                    armed = False
            except Interrupted:  # once at most: the timer does not repeat
                armed, interrupted = False, interrupted + 1
            signal.setitimer(signal.ITIMER_REAL, 0)
    print(interrupted > 0, digest(walks(tracker)) == expected)
"""
    assert run(tmp_path, body) == ["True", "True"]


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
@pytest.mark.parametrize("threads", [1, 3])
def test_the_threads_are_as_many_as_asked_for(tmp_path, threads):
    body = """
    before = len(os.listdir("/proc/self/task"))
    found = work()
    time.sleep(0.2)
    names = [open(f"/proc/self/task/{task}/comm").read().strip() for task in os.listdir("/proc/self/task")]
    print(found, len(names) - before, sum(name.startswith("memo-") for name in names))
"""
    found, more, named = run(tmp_path, body, RAYON_NUM_THREADS=str(threads))
    assert (more, named) == (str(threads), str(threads))
    assert found == run(tmp_path, "    print(work())", RAYON_NUM_THREADS="2")[0]


@pytest.mark.parametrize("way", ["watched", "interruptible", "pooled", "at once"])
def test_a_bug_in_the_core_is_an_ordinary_exception(capfd, way):
    with pytest.raises(RuntimeError, match="a planted fault") as caught:
        _memo._panic("a planted fault", way)
    assert caught.type is memo.InternalError
    assert caught.type.__name__ == "InternalError"
    assert "wait.rs" in capfd.readouterr().err
    copy = pickle.loads(pickle.dumps(caught.value))
    assert (type(copy), str(copy)) == (memo.InternalError, "a planted fault")
    motion = memo.walker_motion(30)
    points = np.ascontiguousarray(motion.positions[:, :4, :2]) * 100.0
    assert memo.planar(points, motion.times_s).windows  # the threads still work
