"""Ctrl-C, threads, forks, and memory that is changed behind our back."""

import contextlib
import copy
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import amontons
import numpy as np
import pytest
import scipy.sparse as sp
from amontons import scenes
from amontons.io.models.waiting import interruptible
from waiting import LONGEST, processor_time, processor_time_of, until

ENOUGH = 1.0
"""Seconds of the processor from Ctrl-C to the end, three times what is promised."""


def simulation(scene="stack", *, dt=5e-3, tolerance=1e-6, threads=1, **parameters):
    model = scenes.make(scene, **parameters)
    return amontons.Simulation(model, dt=dt, tolerance=tolerance, threads=threads, on_failure="ignore")


@pytest.fixture
def ctrl_c():
    """Presses Ctrl-C after a time; its `pressed` is when, in the time of this process."""
    # A shell starts what runs in the background with the signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def press(after):
        def now():
            press.pressed = time.process_time()
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(after, now)
        timer.start()
        timers.append(timer)

    timers = []
    yield press
    for timer in timers:
        timer.join()
    signal.signal(signal.SIGINT, before)


def waited(press):
    return time.process_time() - press.pressed


# Breaks when Ctrl-C waits for the end of a long step, or leaves the state in the middle of one: the same step
# made afterwards must have the bits of one that was never interrupted.
@pytest.mark.alone
def test_ctrl_c_within_a_step(ctrl_c):
    options = dict(tolerance=1e-15)  # which no solve reaches
    sim, other = simulation("wall", **options), simulation("wall", **options)
    before = sim.state.positions.copy()
    ctrl_c(0.3)
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012
        while True:
            sim.step()
            other.step()
            before = sim.state.positions.copy()
    assert waited(ctrl_c) < ENOUGH
    while other.steps < sim.steps:
        other.step()
    if other.steps == sim.steps:
        np.testing.assert_array_equal(sim.state.positions, before)
        np.testing.assert_array_equal(sim.state.positions, other.state.positions)
    assert sim.step().advanced


# Breaks when a factorisation, which takes seconds here, is not left in the middle: one dense front of 3000
# rows is 5e9 multiplications.
@pytest.mark.parametrize("method", ["newton", "interior-point"])
@pytest.mark.alone
def test_ctrl_c_within_a_factorisation(ctrl_c, method):
    rng = np.random.default_rng(1)
    m = 3000
    G = rng.standard_normal((m, 8))
    A = G @ G.T
    A[np.diag_indices(m)] += 1
    problem = amontons.vi.Problem(A, rng.standard_normal(m), "friction", mu=0.5)
    ctrl_c(0.3)
    solution = problem.solve(method=method, tolerance=0, max_iterations=10**6)
    assert solution.status == "interrupted"
    assert waited(ctrl_c) < ENOUGH
    assert np.isfinite(solution.x).all()


# Breaks when a rollout of long steps goes on after Ctrl-C, also where the thread that asks has no world left.
@pytest.mark.alone
def test_ctrl_c_within_a_rollout(ctrl_c):
    quick = simulation("wall", tolerance=1e-15)
    slow = quick.copy()
    ctrl_c(0.4)
    with pytest.raises(KeyboardInterrupt):
        amontons.rollout(quick.model, [quick, slow], steps=2, repeat=10**6, threads=2)
    assert waited(ctrl_c) < ENOUGH
    assert quick.steps == 0


# Breaks when Ctrl-C waits for the compiler of models, which looks at no signals and may take ten seconds.
@pytest.mark.alone
def test_ctrl_c_within_a_compilation(ctrl_c):
    ended = threading.Event()
    ctrl_c(0.2)
    with pytest.raises(KeyboardInterrupt):
        interruptible(ended.wait)
    ended.set()
    assert interruptible(lambda: 3) == 3
    with pytest.raises(ZeroDivisionError):
        interruptible(lambda: 1 // 0)


# Breaks when a run in Python or in the compiled module, a reader, or a study goes on after Ctrl-C.
@pytest.mark.parametrize("what", ["run", "run with callback", "load_model", "read_problem", "sweep"])
@pytest.mark.alone
def test_ctrl_c_ends_every_long_call(ctrl_c, what, tmp_path):
    sim = simulation("stack")
    rows = 20_000
    lines = "".join(f"{i} {i} 1\n" for i in range(1, rows + 1))
    (tmp_path / "a.mtx").write_text(
        f"%%MatrixMarket matrix coordinate real symmetric\n{rows} {rows} {rows}\n{lines}"
    )
    np.savez(tmp_path / "a.npz", b=np.ones(rows))
    bodies = "".join(f'<body pos="{i} 0 1"><freejoint/><geom size=".1"/></body>' for i in range(500))
    (tmp_path / "a.xml").write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")

    def again(call):
        # Python drops what is raised within a finalizer, which is rare: who presses then presses once more.
        last = time.monotonic() + 3
        for press in (lambda: ctrl_c(0.1), lambda: None):
            while time.monotonic() < last:
                with contextlib.suppress(amontons.FileError):
                    call()
            press()
            last += 3

    calls = {
        "run": lambda: sim.run(1e6),
        "run with callback": lambda: sim.run(1e6, after_step=lambda s, r: None),
        "load_model": lambda: again(lambda: amontons.load_model(tmp_path / "a.xml")),
        "read_problem": lambda: again(lambda: amontons.vi.read_problem(tmp_path / "a.mtx")),
        "sweep": lambda: amontons.sweep(
            "stack", {"boxes": [2], "duration": [1e6]}, executor=0, progress=False
        ),
    }
    ctrl_c(0.5)
    with pytest.raises(KeyboardInterrupt):
        calls[what]()
    assert waited(ctrl_c) < ENOUGH


# Breaks when a handler of the user is not called within a step, what it raises does not come out, or one
# that raises nothing ends the step.
def test_handlers_of_the_user():
    calls = []

    def quiet(number, frame):
        calls.append(number)
        if len(calls) == 2:
            raise RuntimeError("mine")

    sim = simulation("wall", tolerance=1e-15)
    before = signal.signal(signal.SIGALRM, quiet)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2, 0.2)
        with pytest.raises(RuntimeError, match="mine"):  # noqa: PT012
            while True:
                sim.step()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert len(calls) == 2


# Breaks when the command waits for the end of a step, or loses the recording.
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.alone
def test_signals_end_a_run(tmp_path, number):
    command = [sys.executable, "-m", "amontons", "run", "wall", "--duration", "1e5", "--tolerance", "1e-15"]
    process = subprocess.Popen(
        [*command, "--record", "a.h5", "--save", "end.h5"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert until(lambda: (tmp_path / "a.h5").exists())
    time.sleep(0.5)
    with processor_time() as spent:
        before = processor_time_of(process.pid)
        process.send_signal(number)
        _, error = process.communicate(timeout=LONGEST)
    assert spent.seconds - before < 5 * ENOUGH  # tables and files come after the step
    assert process.returncode == 1, error
    assert ("terminated at t" if number == signal.SIGTERM else "interrupted at t") in error
    assert "Traceback" not in error
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert not recording.complete
        assert amontons.Simulation.load(tmp_path / "end.h5").steps == recording.steps[-1]


# Breaks when two threads may step one simulation, or one reads what the step of another is writing.
def test_one_simulation_on_two_threads():
    sim = simulation("wall", tolerance=1e-12)
    seen = 0

    def refused(use):
        try:
            use()
        except amontons.InputError as error:
            return "in the middle of a step on another thread" in str(error)
        return False

    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(sim.step)
        while not future.done():
            # Once a reader is refused the other thread is in its step: this one cannot take it away.
            if refused(lambda: sim.forces.joint_reactions):
                others = (sim.step, sim.problem, sim.copy)
                seen += sum(refused(use) for use in others)
        assert future.result().advanced
    assert seen > 0
    assert sim.step().advanced


# Breaks when simulations that share nothing but their model may not be stepped side by side, or come out
# otherwise than one after the other.
def test_copies_on_two_threads():
    first = simulation("stack", boxes=3)
    copies = [first.copy() for _ in range(4)]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda s: s.run(0.1), copies))
    first.run(0.1)
    for other in copies:
        np.testing.assert_array_equal(first.state.positions, other.state.positions)


# Breaks when a copy, by any of the ways of Python, shares the state or what a step leaves.
@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, amontons.Simulation.copy])
def test_copies_share_nothing_that_changes(way):
    sim = simulation("arm_on_cart" if "arm_on_cart" in scenes.names() else "pendulum")
    sim.step()
    q = sim.q
    other = way(sim)
    other.before_step.append(lambda s: None)
    for _ in range(5):
        other.step()
    other.state.forces[:] = 3
    assert sim.steps == 1
    assert not sim.before_step
    assert not sim.state.forces.any()
    np.testing.assert_array_equal(sim.q, q)
    for name in ("positions", "controls", "joint_forces", "forces"):
        assert not np.shares_memory(getattr(sim.state, name), getattr(other.state, name))


# Breaks when arrays of a matrix that change after a problem was made of it lead out of its memory: indices
# far off and counted backwards, in every method, in products and in files.
def test_matrix_changed_behind_our_back(tmp_path):
    m = 60
    A = sp.csr_array(
        sp.diags_array([np.full(m - 1, -1.0), np.full(m, 4.0), np.full(m - 1, -1.0)], offsets=[-1, 0, 1])
    )
    for given in (A.copy(), A.tocsc(), A.toarray()):
        problem = amontons.vi.Problem(given, -np.ones(m), "friction", mu=0.3)
        expected = problem.solve(method="newton").x
        if sp.issparse(given):
            given.indices[:] = 2**30
            given.indptr[:] = np.arange(m + 1)[::-1] * 2**20
        for method in amontons.vi.methods():
            if method not in ("cg", "minres"):  # which refuse inequalities
                assert np.isfinite(problem.solve(method=method, max_iterations=50).x).all()
        np.testing.assert_array_equal(problem.solve(method="newton").x, expected)
        for name in ("a.npz", "a.mtx", "a.hdf5"):
            problem.write(tmp_path / name)
        values = given.data if sp.issparse(given) else given
        values[...] = np.nan  # numbers are the caller's: a solve says what comes of them
        assert problem.solve(method="apgd", max_iterations=20).status != "converged"


def _rolled(sim, queue):
    queue.put(amontons.rollout(sim.model, [sim, sim], steps=2, threads=2).q[:, -1])


# Breaks when a process that is forked or spawned while pools of threads are there waits for them, crashes at
# its end, or computes other bits.
@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_processes(method):
    sim = simulation("spheres_in_box", threads=2, tolerance=1e-3)
    sim.step()
    expected = amontons.rollout(sim.model, [sim, sim], steps=2, threads=2).q[:, -1]
    context = multiprocessing.get_context(method)
    queue = context.Queue()
    process = context.Process(target=_rolled, args=(sim, queue))
    process.start()
    np.testing.assert_array_equal(queue.get(timeout=LONGEST), expected)
    process.join(LONGEST)
    assert process.exitcode == 0
    _rolled(sim, queue)  # and we go on
    np.testing.assert_array_equal(queue.get(timeout=LONGEST), expected)


# Breaks when a fork while other threads step leaves the child with a lock that nobody holds.
def test_fork_while_others_step():
    sims = [simulation("spheres_in_box", threads=2, tolerance=1e-3) for _ in range(2)]
    stop = threading.Event()

    def busy(sim):
        while not stop.is_set():
            sim.step()

    with ThreadPoolExecutor(2) as pool:
        futures = [pool.submit(busy, sim) for sim in sims]
        try:
            for _ in range(5):
                time.sleep(0.02)
                child = os.fork()
                if child == 0:
                    code = 1
                    try:
                        code = 0 if simulation("stack", threads=2, boxes=2).step().advanced else 2
                    finally:
                        os._exit(code)
                assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        finally:
            stop.set()
        for future in futures:
            future.result()


# Breaks when a stage of a step that threads share, for many contacts or for many bodies, takes another part's
# data, or adds in an order that follows from their number.
@pytest.mark.parametrize(("scene", "size"), [("wall", {}), ("spheres_in_box", {"count": 2500})])
def test_steps_by_threads_have_the_same_bits(scene, size):
    def bits(threads):
        sim = simulation(scene, threads=threads, tolerance=1e-3, **size)
        for _ in range(3):
            sim.step()
        return [np.asarray(a).tobytes() for a in (sim.q, sim.qd, sim.forces.impulses)]

    alone = bits(1)
    assert bits(2) == alone
    assert bits(4) == alone
