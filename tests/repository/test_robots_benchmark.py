"""benchmarks/robots.py: every model is a row, whatever happens to it."""

import sys

import pytest

pytest.importorskip("mujoco")

BALL = """<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.3"><freejoint/><geom size="0.1"/></body>
    <body name="arm" pos="2 0 1">
      <joint name="elbow" axis="0 1 0" range="-90 90" frictionloss="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.05"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="cord" limited="true" range="-1 1" frictionloss="0.1"><joint joint="elbow" coef="1"/></fixed>
  </tendon>
  <actuator><motor joint="elbow"/><position tendon="cord" kp="2"/></actuator>
</mujoco>"""
LUMP = """<robot name="lump"><link name="base">
  <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="0.25"/></geometry></collision>
</link></robot>"""


@pytest.fixture
def robots(root, monkeypatch):
    monkeypatch.syspath_prepend(str(root / "benchmarks"))
    import robots

    yield robots
    for name in ("robots", "common"):
        sys.modules.pop(name, None)


def run(robots, monkeypatch, tmp_path, *arguments):
    command = ["robots.py", str(tmp_path), "--out", str(tmp_path / "out"), "--duration", "0.05"]
    monkeypatch.setattr(sys, "argv", [*command, *arguments])
    assert robots.main() == ("--check" in arguments)
    from common import read_csv

    return {row["model"]: row for row in read_csv(tmp_path / "out" / "robots.csv")}


# Breaks when a file that another one includes, or that is no model, gets a row, when what happens to one
# model ends the run, or when free motion no longer agrees with MuJoCo's.
def test_every_model_is_a_row(robots, monkeypatch, tmp_path, capsys):
    (tmp_path / "ball.xml").write_text(BALL)
    (tmp_path / "scene.xml").write_text(
        '<mujoco><!-- <include file="ball.xml"/> --><include file="part.xml"/></mujoco>'
    )
    (tmp_path / "part.xml").write_text(BALL)
    (tmp_path / "other.xml").write_text("<html/>")
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody><body></mujoco>")
    (tmp_path / "lump.urdf").write_text(LUMP)
    rows = run(robots, monkeypatch, tmp_path)
    assert set(rows) == {"ball.xml", "broken.xml", "lump.urdf", "scene.xml"}
    assert rows["broken.xml"]["outcome"] == "refused, by MuJoCo too"
    for name in ("ball.xml", "scene.xml"):
        assert rows[name]["outcome"] == "finished"
        assert rows[name]["steps"] == rows[name]["wanted_steps"] == "10"
        assert float(rows[name]["free_in_errors"]) < robots.ERRORS
        assert rows[name]["free_kicked"] == "True"
        assert float(rows[name]["missed_percent"]) == 0
        assert float(rows[name]["energy_gain_relative"]) < 1e-9
    assert rows["lump.urdf"]["outcome"] == "finished"
    assert float(rows["lump.urdf"]["floor"]) == -0.25  # URDF has none
    assert rows["lump.urdf"]["contacts"] == rows["lump.urdf"]["mujoco_contacts"] == "1"
    assert "models without a fault: 4 of 4" in capsys.readouterr().out


# Breaks when a model that takes too long holds up the others.
def test_a_limit_of_time(robots, monkeypatch, tmp_path):
    (tmp_path / "ball.xml").write_text(BALL)
    rows = run(robots, monkeypatch, tmp_path, "--limit", "0.01", "--check")
    assert rows["ball.xml"]["outcome"] == "loading did not end"


# Breaks when what the worker said before it crashed is lost, or a crash is taken for an end.
def test_a_crash(robots, monkeypatch, tmp_path):
    (tmp_path / "ball.xml").write_text(BALL)
    worker = tmp_path / "worker.py"
    worker.write_text('print(\'{"load": "ok", "bodies": 3}\', flush=True); raise SystemExit(\'gone\')')
    monkeypatch.setattr(robots, "WORKER", (worker,))
    rows = run(robots, monkeypatch, tmp_path)
    assert rows["ball.xml"]["outcome"] == "crashed (1): gone"
    assert rows["ball.xml"]["bodies"] == "3"


# Breaks when the two forms of joints are no longer compared in one run, or a form runs as the other one.
def test_both_forms_run_beside_mujoco(robots, monkeypatch, tmp_path, capsys):
    (tmp_path / "ball.xml").write_text(BALL)
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody><body></mujoco>")
    out = tmp_path / "out"
    command = ["robots.py", str(tmp_path), "--out", str(out), "--duration", "0.05", "--trees", "both"]
    monkeypatch.setattr(sys, "argv", command)
    assert robots.main() == 0
    from common import read_csv

    rows = {row["model"]: row for row in read_csv(out / "robots_forms.csv")}
    ball = rows["ball.xml"]
    assert ball["steps"] == ball["wanted_steps"] == "25"
    assert float(ball["rows_joint_rows"]) - float(ball["trees_joint_rows"]) == 5  # those of one hinge
    assert float(ball["trees_to_mujoco"]) > 0
    assert ball["rows_missed"] == ball["trees_missed"] == "0"
    assert rows["broken.xml"]["outcome"] == "refused, by MuJoCo too"
    assert "ball.xml" in capsys.readouterr().out


# Breaks when a case does not load in one of the two programs, or when its controls or counts are not written.
def test_the_work_of_steps_on_the_floor_is_counted(robots, monkeypatch, tmp_path, capsys):
    command = ["robots.py", str(tmp_path), "--out", str(tmp_path), "--duration", "0.05", "--fall"]
    monkeypatch.setattr(sys, "argv", [*command, "--only", "held by adhesion", "gripper"])
    assert robots.main() == 0
    from common import read_csv

    rows = read_csv(tmp_path / "robots_fall.csv")
    assert [row["control"] for row in rows] == ["none", "random"] * 2
    assert all(row["steps"] == "25" and row["missed"] == "0" for row in rows)
    assert all(float(row["contacts"]) > 0 and float(row["products_mean"]) >= 1 for row in rows)
    assert "held by adhesion" in capsys.readouterr().out
