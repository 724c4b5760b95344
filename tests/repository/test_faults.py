"""tools/plant_faults.py: the table of faults fits the sources, and a fault that no test finds is told."""

import plant_faults
import pytest


# Breaks when a source changes, so that a fault can no longer be planted, or a fault names no test.
def test_faults_can_be_planted(root):
    faults = plant_faults.faults([])
    assert len(faults) >= 20
    for fault in faults:
        assert (root / fault["file"]).read_text().count(fault["was"]) == 1, fault["what"]
        tests = [f"tests/cpp/{fault['cpp']}.cpp"] if "cpp" in fault else fault["python"].split()
        assert all((root / test).is_file() for test in tests), fault["what"]


# Breaks when a fault stays in the source after its test, or one that its test passes is called found.
@pytest.mark.parametrize(("now", "outcome"), [("1 - 1", "NOT FOUND"), ("1 + 1", "found")])
def test_a_fault_is_planted_and_taken_back(now, outcome, tmp_path, monkeypatch, capsys):
    (tmp_path / "tests").mkdir()
    (tmp_path / "a.py").write_text("ZERO = 1 - 1\n")
    (tmp_path / "test_a.py").write_text("from a import ZERO\ndef test(): assert ZERO == 0\n")
    table = f'[[fault]]\nwhat = "w"\nfile = "a.py"\nwas = "1 - 1"\nnow = "{now}"\npython = "test_a.py"\n'
    (tmp_path / "tests" / "faults.toml").write_text(table)
    monkeypatch.setattr(plant_faults, "ROOT", tmp_path)
    assert plant_faults.main([]) == (outcome != "found")
    assert capsys.readouterr().out == f"{outcome}: w (a.py, test_a.py)\n"
    assert (tmp_path / "a.py").read_text() == "ZERO = 1 - 1\n"
