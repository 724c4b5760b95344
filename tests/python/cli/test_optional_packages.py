"""What works with NumPy, SciPy and h5py alone, and what the rest says when it is missing."""

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
BLOCKED = """
import sys
for name in ("matplotlib", "PIL", "rich", "typer"):
    sys.modules[name] = None  # an import of it fails, as where it is not installed
"""


def without(program, folder):
    """A new interpreter in which the packages of the extra `cli` cannot be imported."""
    command = [sys.executable, "-c", BLOCKED + program]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


# Breaks when the library needs a package that only the command needs: at its import, in a step, a solve, a
# recording, a saved state or a picture.
def test_library_needs_three_packages(tmp_path):
    done = without(
        """
import amontons
simulation = amontons.Simulation(amontons.scenes.arch(), dt=5e-3)
with amontons.record("arch.h5", simulation) as recorder:
    for _ in range(3):
        recorder.add(simulation.step())
assert len(amontons.read_recording("arch.h5")) == 4
simulation.save("saved.h5")
assert amontons.Simulation.load("saved.h5").time == simulation.time
simulation.problem().write("step.hdf5")
assert amontons.vi.read_problem("step.hdf5").solve().converged
assert amontons.render(simulation, (32, 24)).shape == (24, 32, 3)
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


# Breaks when the command ends with a traceback, or does not name what to install.
def test_command_says_what_to_install(tmp_path):
    done = without("import runpy; runpy.run_module('amontons', run_name='__main__')", tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("amontons: the command needs")
    assert 'pip install "amontons[cli]"' in done.stderr
    assert "Traceback" not in done.stderr


# Breaks when a function that draws figures fails by an ImportError of Matplotlib.
def test_figures_say_what_to_install(tmp_path):
    done = without(
        """
import amontons
for module in ("figures", "run_summary"):
    try:
        __import__(f"amontons.report.{module}")
    except amontons.InputError as error:
        assert 'pip install "amontons[cli]"' in str(error), error
    else:
        raise AssertionError(module)
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


# Breaks when the package requires more than its three, or the command starts where the check is not.
def test_requirements():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {line.split(">")[0] for line in project["dependencies"]} == {"numpy", "scipy", "h5py"}
    extra = {line.split(">")[0] for line in project["optional-dependencies"]["cli"]}
    assert extra == {"matplotlib", "pillow", "rich", "typer"}
    assert project["scripts"]["amontons"] == "amontons.__main__:main"


# Breaks when `make demo` and `make test` do not install what the command needs.
def test_make_installs_the_command():
    listed = subprocess.run(
        [sys.executable, ROOT / "tools" / "requirements.py"], capture_output=True, text=True, check=True
    ).stdout
    assert {"typer", "rich", "matplotlib", "pillow"} <= {line.split(">")[0] for line in listed.splitlines()}


# Breaks when `import amontons` loads what only some functions need. SciPy's optimisers alone took as long to
# load as the rest of the package.
def test_import_loads_no_optional_part():
    heavy = [
        "scipy.optimize",
        "scipy.spatial",
        "matplotlib",
        "mujoco",
        "gymnasium",
        "viser",
        "rich",
        "typer",
        "loky",
        "pyarrow",
    ]
    program = f"import sys, amontons; print([name for name in {heavy} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
