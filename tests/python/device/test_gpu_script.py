"""What `make gpu` runs on a machine with a GPU, in small by pocl."""

import sys
from pathlib import Path

import pytest
from device_problems import pocl

sys.path.append(str(Path(__file__).resolve().parents[3] / "benchmarks"))


# Breaks when the script of a machine with a GPU would fail there: a phase of a step has another name, the
# command has other options, or a film is not drawn.
def test_phases_and_film(tmp_path):
    script = pytest.importorskip("device")
    rows = list(script.simulated(pocl(), (30,), steps=2))
    assert [row["spheres"] for row in rows] == [30]
    for where in ("cpu", "device"):
        parts = [rows[0][f"{phase}_ms_{where}"] for phase in script.PHASES]
        assert sum(parts[:-1]) == pytest.approx(parts[-1], rel=1e-6)
    assert rows[0]["iterations_device"] == pytest.approx(rows[0]["iterations_cpu"], rel=0.3, abs=5)
    script.film(pocl(), tmp_path / "avalanche.webp", 10, 0.1)
    assert (tmp_path / "avalanche.webp").read_bytes()[8:12] == b"WEBP"
