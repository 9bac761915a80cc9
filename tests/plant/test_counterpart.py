"""The plant that stands for a plan's robot."""

from pathlib import Path

from kemba.plant.repeat import counterpart

OWN = """\
name: heavy
base: planning
supply: 0.65 MPa
effects:
  - {kind: contact, mu: 0.6}
  - {kind: boom_damping, b: 2 N.s.m-1}
  - {kind: seal_friction, F_c: 30 N}
  - {kind: valve, dead_time: 9 ms}
  - {kind: sensor_bias, channel: body/pitch, b: 0.01}
"""


def test_the_shipped_models_make_the_shipped_plant() -> None:
    plant = counterpart("planning", payload=0.5, supply=0.6e6)
    assert (plant.name, plant.supply) == ("plant", 0.6e6)
    names = {e.name for e in plant.effects}
    assert {"orifice_chamber", "supply_line", "payload"} <= names and "chamber" not in names
    assert counterpart("plant").effects == counterpart("planning").effects


def test_own_effects_are_carried_but_the_air_is_the_plants(tmp_path: Path) -> None:
    (tmp_path / "heavy.yaml").write_text(OWN)
    plant = counterpart(str(tmp_path / "heavy.yaml"))
    assert plant.effect("contact").value("mu") == 0.6
    assert plant.effect("boom_damping").value("b") == 2.0
    assert plant.effect("seal_friction").value("F_c") == 5.0
    assert plant.effect("valve").value("dead_time") == 5.6e-3
    assert plant.ignored == [] and plant.supply == 0.65e6
