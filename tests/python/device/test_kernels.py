"""The kernels by OpenCL on the processor, against NumPy to the last bit and against the compiled passes."""

import sys
import types
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import cache

import amontons
import numpy as np
import pytest
from amontons.device import backend, cuda, found
from amontons.device.backend import Memory
from amontons.device.found import source_on
from amontons.device.methods import CHUNK, DeviceMethod
from device_problems import (
    DEVICE,
    NAMES,
    compare_to_cpu,
    open_groups,
    pocl,
    problems,
    stepped,
    told,
)
from numpy_iterate import NumpyIterate

LAWS = ("associated", "coulomb")
GROUPS = (1, 7, 64, 256)


@pytest.fixture(scope="module")
def opened():
    """Backends by work-group size."""
    return {group: open_groups(group) for group in GROUPS}


NUMPY = amontons._core.IterateSource("numpy", NumpyIterate.of_core, True, 0)


@cache
def expected(name, law):
    """The methods of C++ over the passes of NumPy."""
    return told(NUMPY, problems()[name], law)


def on(backend, name, law):
    return told(source_on(backend, "tested", 0), problems()[name], law)


# Breaks when a kernel computes something else, or sums in another order, than NumPy does; when the loop on a
# device is not that of spg.cpp or apgd.cpp, bit by bit; when a bit depends on the size of a work group or on
# the number of iterations between two reads, or when runs differ from time to time.
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", NAMES)
def test_bits_are_those_of_numpy(opened, name, law):
    for group in GROUPS:
        np.testing.assert_array_equal(
            on(opened[group], name, law), expected(name, law), err_msg=f"work groups of {group}"
        )


def method_on(backend, name):
    return DeviceMethod(problems()[name]._core, amontons._core.Law.coulomb, backend, Memory(backend))


# Breaks when the problem of a drum has no body whose list is cut into parts, so that no test reaches them.
def test_a_large_body_is_reached(opened):
    assert method_on(opened[64], "drum")._large == 1


# Breaks when the comparison above would not see a barrier that is missing: at work groups of one item nothing
# is wrong, at larger ones something is.
def test_a_missing_barrier_is_found():
    if DEVICE != "opencl":
        pytest.skip("the items of a small group move in step on a GPU")
    text = backend.source()
    planted = text.replace("u; half_tile /= 2u) {\n    BARRIER;\n", "u; half_tile /= 2u) {\n")
    assert planted != text

    def is_right(group):
        try:
            return np.array_equal(
                on(open_groups(group, planted), "pile", "coulomb"), expected("pile", "coulomb")
            )
        except amontons.InputError:  # sums so wrong that A looks indefinite
            return False

    assert [group for group in (1, 64) if is_right(group)] == [1]


# Breaks when a method on the device is not that of the CPU: residual, iterations, x.
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("method", ["p-spg-fb", "apgd"])
@pytest.mark.parametrize("name", NAMES)
def test_device_is_the_cpu(name, method, law):
    pocl()
    compare_to_cpu(name, method, law, lambda problem, options: problem.solve(device=DEVICE, **options))


# Breaks when more is launched or read than docs/device.md says: five launches an iteration, two more beside
# large bodies, and a read after 25 iterations.
def test_round_trips(opened):
    for name, extra in (("pile", 0), ("drum", 2)):
        for method, trials in (
            ("p-spg-fb", {"alpha": 1, "memory": 1, "gamma": 1e-4}),
            ("apgd", {"theta": 1, "l": 1e9}),
        ):
            made = method_on(opened[64], name)
            rows = problems()[name].rows
            made.start(method, np.zeros(rows), {"scale": 1, "relaxation": 1, "sigma_max": 0.9, **trials})
            made.launches = made.reads = 0
            assert len(made.advance(1000)) == CHUNK
            assert (made.launches, made.reads) == (1 + CHUNK * (5 + extra), 1)


# Breaks when the kernels are no CUDA C++, or mean something else there, or read what nobody wrote.
@pytest.mark.parametrize("name", NAMES)
def test_cuda_dialect(host, name):
    np.testing.assert_array_equal(on(host, name, "coulomb"), expected(name, "coulomb"))


class FakeArray(np.ndarray):
    """What the backend uses of an array of CuPy."""

    def set(self, values):
        self[...] = values

    def get(self):
        return np.array(self)


STREAMS = []
"""the streams that are entered, the current one last"""


class FakeStream:
    """A stream: a context; one that is captured keeps launches in place of running them."""

    def __init__(self, non_blocking):
        self.captured = None

    def __enter__(self):
        STREAMS.append(self)
        return self

    def __exit__(self, *_):
        STREAMS.pop()

    def begin_capture(self):
        self.captured = []

    def end_capture(self):
        return types.SimpleNamespace(launch=lambda stream, held=self.captured: [run() for run in held])


class CardError(RuntimeError):
    pass


def fake_cupy(host):
    """A CuPy with one device, whose kernels the processor runs, launch by launch."""

    def kernel(name):
        def launch(grid, block, arguments):
            def run():
                host.launch(name, grid[0], *arguments)

            captured = STREAMS[-1].captured
            run() if captured is None else captured.append(run)

        launch.num_regs = 1
        return launch

    runtime = types.SimpleNamespace(
        CUDARuntimeError=CardError,
        getDeviceProperties=lambda index: {"name": b"fake", "totalGlobalMem": 1 << 40},
        driverGetVersion=lambda: 12040,
    )
    module = types.SimpleNamespace(get_function=kernel)
    return types.SimpleNamespace(
        cuda=types.SimpleNamespace(
            runtime=runtime, Device=lambda index: nullcontext(), Stream=FakeStream,
            alloc_pinned_memory=lambda nbytes: bytearray(b"\xff" * nbytes),
            memory=types.SimpleNamespace(OutOfMemoryError=MemoryError),
            driver=types.SimpleNamespace(CUDADriverError=CardError),
        ),
        RawModule=lambda code, options: module,
        empty=lambda nbytes, dtype: np.full(nbytes, 255, dtype).view(FakeArray),
    )  # fmt: skip


# Breaks when the graph of CUDA misses a launch, runs one while it is captured, or is replayed with other
# arguments; no card is needed.
@pytest.mark.parametrize("name", ["pile", "drum"])
def test_graphs_of_cuda(host, monkeypatch, name):
    monkeypatch.setitem(sys.modules, "cupy", fake_cupy(host))
    captured = []
    program = cuda.Cuda.program
    monkeypatch.setattr(
        cuda.Cuda, "program", lambda self, held: captured.append(len(held)) or program(self, held)
    )
    np.testing.assert_array_equal(on(cuda.Cuda(0), name, "coulomb"), expected(name, "coulomb"))
    assert set(captured) == {CHUNK * (7 if name == "drum" else 5)}


# Breaks when a host that pins no more memory ends a solve.
def test_a_host_that_pins_nothing(host, monkeypatch):
    def refuses(nbytes):
        raise CardError("cudaErrorMemoryAllocation")

    cupy = fake_cupy(host)
    monkeypatch.setattr(cupy.cuda, "alloc_pinned_memory", refuses)
    monkeypatch.setitem(sys.modules, "cupy", cupy)
    np.testing.assert_array_equal(on(cuda.Cuda(0), "rows", "coulomb"), expected("rows", "coulomb"))


# Breaks when buffers are made anew although the last problem left some that are long enough, or when two
# iterates at a time share theirs.
def test_memory_is_kept(opened):
    class Counting:
        def __init__(self, held):
            self.held, self.count = held, 0

        def __getattr__(self, name):
            return getattr(self.held, name)

        def allocate(self, nbytes):
            self.count += 1
            return self.held.allocate(nbytes)

    counting = Counting(opened[64])
    problem = problems()["pile"]
    source = source_on(counting, "opencl:0", 0)
    options = amontons.problem.options.core_options(
        "apgd", law="coulomb", tolerance=0, max_iterations=20, deadline=None, history=False, threads=None,
        method_options={},
    )  # fmt: skip
    options.iterates = source

    def run(callback=None):
        return np.array(amontons._core.solve(problem._core, "apgd", options, None, callback).x)

    bits, made = [run()], counting.count
    bits += [run(), run()]
    assert counting.count == made > 10
    np.testing.assert_array_equal(bits[0], bits[2])

    def again(record):  # a solve within a solve
        if record.iteration == 5:
            run()

    nested = run(again)
    assert counting.count == 2 * made
    np.testing.assert_array_equal(nested, bits[0])


# Breaks when steps of a simulation on a device differ from those on the CPU, or when small ones go there.
def test_simulation(opened):
    scene = amontons.scenes.make("spheres_in_box", count=60)
    options = dict(method="apgd", tolerance=1e-6, max_iterations=200, on_failure="ignore")
    cpu = amontons.Simulation(scene, **options)
    device = amontons.Simulation(scene, device=DEVICE, device_contacts=1, **options)
    small = amontons.Simulation(scene, device=DEVICE, device_contacts=10_000, **options)
    for _ in range(40):
        for sim in (cpu, device, small):
            sim.step()
    assert len(cpu.contacts) > 60
    np.testing.assert_array_equal(small.state.positions, cpu.state.positions)
    np.testing.assert_allclose(device.state.positions, cpu.state.positions, atol=1e-6)
    copied = device.copy()
    device.step()
    copied.step()
    np.testing.assert_array_equal(device.state.positions, copied.state.positions)


# Breaks when "auto" leaves a simulation with a device on the CPU, or a solve does not say where it was.
def test_auto_takes_the_device():
    pocl()
    problem = stepped("wall", 2, columns=6, rows=4)
    solution = problem.solve(law="coulomb", device=DEVICE, tolerance=1e-4)
    assert solution.converged
    assert solution.device == pocl().name
    assert "on the device" in solution.reason
    assert f"on {pocl().name}" in repr(solution)
    cpu = problem.solve(law="coulomb", tolerance=1e-4)
    assert cpu.device == "cpu"
    sim = amontons.Simulation(
        amontons.scenes.make("spheres_in_box", count=30),
        device="opencl",
        device_contacts=1,
        on_failure="ignore",
    )
    methods = {sim.step().method for _ in range(30)}
    assert methods & {"apgd", "p-spg-fb"}


# Breaks when a method without passes stays silent about where it runs.
def test_other_methods_say_that_they_run_on_the_cpu():
    solution = problems()["wall"].solve(method="newton", device="numpy", max_iterations=5)
    assert solution.device == "cpu"
    assert "newton runs on the CPU" in solution.reason


# Breaks when threads that share a device mix up the arguments of their kernels, or their buffers.
def test_threads_share_a_device():
    pocl()
    options = dict(method="apgd", law="coulomb", tolerance=0, max_iterations=60, device=DEVICE)
    names = ("pile", "wall", "contacts", "pile")
    alone = {name: problems()[name].solve(**options).x for name in names}
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda name: problems()[name].solve(**options).x, names))
    for name, x in zip(names, together, strict=True):
        np.testing.assert_array_equal(x, alone[name])


def sent(memory, backend, problem):
    """Bytes that a solve of ten iterations uploads, and its x; the memory is that of the solve before."""
    begun = memory.sent
    made = DeviceMethod(problem._core, amontons._core.Law.coulomb, backend, memory)
    made.start("apgd", np.zeros(problem.rows), {"scale": 1, "relaxation": 0.9, "theta": 1, "l": 1.0})
    made.advance(10)
    return memory.sent - begun, made.extract()


# Breaks when a solve sends arrays that the device has already, or does not send one that differs: the bits
# are those of a solve in new memory.
def test_only_what_changed_is_sent(opened):
    memory, pile = Memory(opened[64]), problems()["pile"]
    pile = amontons.vi.Problem(pile.A, pile.b, pile.cones)
    first, x = sent(memory, opened[64], pile)
    vector = 8 * 3 * -(-pile.contacts // 32) * 32
    again, same = sent(memory, opened[64], pile)
    assert vector < again < vector + 4096 < first  # x, and the scalars of the method
    np.testing.assert_array_equal(same, x)
    pushed = amontons.vi.Problem(pile.A, 1.1 * pile.b, pile.cones)
    with_b, moved = sent(memory, opened[64], pushed)
    assert with_b == again + vector
    np.testing.assert_array_equal(moved, sent(Memory(opened[64]), opened[64], pushed)[1])
    for name in ("wall", "drum", "rows", "pile"):
        _, x = sent(memory, opened[64], problems()[name])
        np.testing.assert_array_equal(x, sent(Memory(opened[64]), opened[64], problems()[name])[1])


class Failing:
    """A backend whose next call of one function raises what it is told."""

    def __init__(self, held):
        self.held, self.fault, self.calls = held, None, 0

    def __getattr__(self, name):
        def call(*arguments):
            if self.fault and self.fault[0] == name:
                self.calls -= 1
                if self.calls < 0:
                    fault, self.fault = self.fault[1], None
                    raise fault
            return getattr(self.held, name)(*arguments)

        found = getattr(self.held, name)
        return call if callable(found) else found


# Breaks when a device that fails while arrays are on their way leaves some of them taken for sent.
def test_an_upload_that_fails(opened):
    failing = Failing(opened[64])
    memory, wall, pile = Memory(failing), problems()["wall"], problems()["pile"]
    _, x = sent(memory, failing, wall)
    for calls in range(0, 10, 3):
        sent(memory, failing, pile)
        failing.fault, failing.calls = ("upload", amontons.InputError("the cable is out")), calls
        with pytest.raises(amontons.InputError, match="the cable is out"):
            sent(memory, failing, wall)
        np.testing.assert_array_equal(sent(memory, failing, wall)[1], x)


def pile_on(name):
    """Spheres in motion that a device solves, and the arrays of its state."""
    sim = amontons.Simulation(
        amontons.scenes.make("spheres_in_box", count=80), device=name, device_contacts=1, method="apgd",
        tolerance=1e-4, on_failure="ignore",
    )  # fmt: skip
    sim.run(0.15)
    sim.state.positions[0, 2] += 1.0  # out of what the last search covered: the next step searches again
    return sim


def held(sim):
    state = sim.state
    return [np.array(x) for x in (state.positions, state.orientations, state.linear_velocities, sim.time)]


def check_put_back(sim, said):
    """The next step fails with these words, and changes nothing."""
    before = held(sim)
    with pytest.raises(amontons.InputError, match=said):
        sim.step()
    for own, then in zip(held(sim), before, strict=True):
        np.testing.assert_array_equal(own, then)


# Breaks when a device that fails, in any call of its driver, comes out as an exception of its package, or
# leaves the state between two steps; when the same device is not opened anew, or the simulation cannot go on
# without it.
@pytest.mark.parametrize(
    ("call", "which"),
    [("launch", "count_pairs"), ("launch", "decide_beta"), ("upload", 0), ("upload", 8), ("download", 0),
     ("download", 2)],
)  # fmt: skip
def test_a_device_that_is_lost(monkeypatch, call, which):
    cl = pytest.importorskip("pyopencl")
    monkeypatch.setattr(found, "_opened", {})
    sim = pile_on(pocl().name)
    opened = found.open_device(pocl())
    other = sim.copy()

    def fails(*_, **__):
        raise cl.RuntimeError("out of resources")

    with monkeypatch.context() as patch:
        if call == "launch":
            patch.setitem(opened._kernels, which, fails)
        else:
            copied, left = (
                cl.enqueue_copy,
                [which],
            )  # the search sends 6 arrays and reads 2, then the solve does

            def copy(queue, to, source, **options):
                if isinstance(to, np.ndarray) == (call == "download"):
                    fails() if left[0] == 0 else None
                    left[0] -= 1
                return copied(queue, to, source, **options)

            patch.setattr(cl, "enqueue_copy", copy)
        check_put_back(sim, f'device "{pocl().name}".*failed: .*out of resources.*device="cpu"')
    assert opened.lost
    assert found.open_device(pocl()) is not opened
    for now in (sim, other):
        assert now.step().advanced
    np.testing.assert_array_equal(sim.state.positions, other.state.positions)
    sim.change_options(device="cpu")
    assert sim.step().advanced


# Breaks when a device that has no room left in the middle of a run leaves the state between two steps.
@pytest.mark.parametrize("wanted", ["nodes", "vectors"])
def test_a_device_that_is_full(monkeypatch, wanted):
    monkeypatch.setattr(found, "_opened", {})
    sim = pile_on(pocl().name)
    opened = found.open_device(pocl())
    small = backend.Device(pocl().name, "Small card", "cpu", "", 1000, True)
    copied = sim.copy()  # takes buffers of its own
    with monkeypatch.context() as patch:
        patch.setattr(opened, "device", small)
        patch.setattr(
            Memory,
            "buffer",
            lambda self, name, nbytes: (grown if name == wanted else BUFFER)(self, name, nbytes),
        )
        check_put_back(copied, "Small card.*has 1e-06 GB of memory")
    assert copied.step().advanced


def grown(memory, name, nbytes):
    """The buffer as if it were too short."""
    memory._buffers.pop(name, None)
    return BUFFER(memory, name, 1000 + nbytes)


BUFFER = Memory.buffer


# Breaks when a card of NVIDIA that fails comes out as an exception of CuPy.
def test_a_card_that_is_lost(host, monkeypatch):
    monkeypatch.setitem(sys.modules, "cupy", fake_cupy(host))
    card = cuda.Cuda(0)
    made = method_on(card, "pile")

    def fails(*_):
        raise CardError("cudaErrorIllegalAddress")

    monkeypatch.setitem(card._kernels, "refresh", fails)
    with pytest.raises(
        amontons.InputError, match=r'device "cuda:0" \(fake\) failed: cudaErrorIllegalAddress'
    ):
        made.start("apgd", np.zeros(problems()["pile"].rows), {"scale": 1})
    assert card.lost


# Breaks when a state that is no number reaches a device.
def test_a_damaged_state(monkeypatch):
    sim = pile_on(pocl().name)
    was = np.array(sim.state.positions[3])
    sim.state.positions[3] = np.nan
    check_put_back(sim, "finite|number|nan")
    sim.state.positions[3] = was
    assert sim.step().advanced


# Breaks when a step on a device corrects the positions of a large pile on the CPU, or otherwise than the CPU.
def test_positions_are_corrected_there(monkeypatch):
    pocl()
    builder = amontons.ModelBuilder()
    builder.add_geom(None, amontons.shapes.Plane())
    for n in np.ndindex(6, 6, 5):  # each overlaps its neighbours by 4 % of its radius
        position = tuple(0.098 * (np.array(n) + 0.5))
        builder.add_body(position=position, shape=amontons.shapes.Sphere(0.05), density=1000)
    options = dict(method="apgd", tolerance=1e-6, max_iterations=200, on_failure="ignore")
    cpu = amontons.Simulation(builder.build(), **options)
    there = amontons.Simulation(builder.build(), device=DEVICE, device_contacts=300, **options)
    begun = np.array(cpu.state.positions)
    solved = []
    start = DeviceMethod.start

    def noted(self, *arguments):
        solved.append((self._layout.contacts, self._layout.rows))
        return start(self, *arguments)

    monkeypatch.setattr(DeviceMethod, "start", noted)
    for _ in range(3):
        cpu.step()
        there.step()
    assert any(contacts == 0 and rows > 300 for contacts, rows in solved)
    assert any(contacts > 300 and rows == 0 for contacts, rows in solved)
    moved = np.abs(cpu.state.positions - begun).max()
    assert np.abs(there.state.positions - cpu.state.positions).max() < 0.02 * moved
