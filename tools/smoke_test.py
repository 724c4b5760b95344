"""Uses an installed amontons: tools/make_wheel.py runs it in an environment with nothing else installed.

With the argument `cli`, the command that the extra of this name brings; with `library`, nothing that starts a
process, for a Python that an emulator runs (tools/wheels_test.py).
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import amontons
import numpy as np

assert "site-packages" in amontons.__file__, amontons.__file__

if sys.argv[1:] == ["cli"]:  # the command, its self-test and its optional parts, which are missing here
    done = subprocess.run(["amontons", "doctor", "--json"], capture_output=True, check=True)
    told = json.loads(done.stdout)
    assert told["passed"], told
    assert told["parts"]["cli"]["installed"] and not told["parts"]["studies"]["installed"], told
    subprocess.run([sys.executable, "-m", "amontons", "--version"], check=True)
    sys.exit()

# The command says what it needs.
if sys.argv[1:] != ["library"]:
    refused = subprocess.run(["amontons", "--version"], capture_output=True, text=True, check=False)
    assert refused.returncode == 1 and "amontons[cli]" in refused.stderr, refused

# A simulation, its problem through a file, a recording.
with tempfile.TemporaryDirectory() as folder:
    simulation = amontons.Simulation(amontons.scenes.arch(), dt=5e-3)
    with amontons.record(Path(folder) / "arch.h5", simulation) as recorder:
        for _ in range(20):
            recorder.add(simulation.step())
    assert len(amontons.read_recording(Path(folder) / "arch.h5")) >= 20
    simulation.problem().write(Path(folder) / "step.hdf5")
    solution = amontons.vi.read_problem(Path(folder) / "step.hdf5").solve(tolerance=1e-6)
    assert solution.converged and np.isfinite(solution.x).all()

# The files of examples come along.
assert amontons.vi.read_problem(amontons.examples.path("plates.hdf5")).b.size

# What is missing says what to do.
try:
    amontons.sweep(lambda mu: None, {"mu": [1]})
except amontons.InputError as error:
    assert "amontons[studies]" in str(error)
