"""`kemba-opt effects`, as scripts see it."""

import json

from typer.testing import CliRunner, Result

from kemba.effects import BY_KIND
from kemba_cli.main import app


def effects(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["effects", *arguments])


def test_the_catalogue_lists_everything() -> None:
    shown = effects()
    assert shown.exit_code == 0
    for kind in ("seal_friction", "orifice_chamber", "sensor_bias", "expression"):
        assert kind in shown.output
    listed = json.loads(effects("--json").stdout)["effects"]
    assert sorted(e["name"] for e in listed) == sorted(BY_KIND)
    for effect in listed:
        assert effect["equation"] and effect["source"] and effect["description"]


def test_one_effect_in_detail() -> None:
    shown = effects("stribeck_friction")
    assert "equation    -F_s exp(-(v/v_b)^2) tanh(v/0.01)" in shown.stdout
    assert "parameter   F_s (N) 10, off at 0: extra force near standstill" in shown.stdout
    found = json.loads(effects("stribeck_friction", "--json").stdout)
    assert [(p["name"], p["unit"], p["size"], p["off"]) for p in found["parameters"]] == [
        ("F_s", "N", 10.0, 0.0),
        ("v_b", "m.s-1", 0.05, None),
    ]


def test_tables_are_shown_with_their_unit() -> None:
    shown = effects("chamber").stdout
    assert "table       F_extend (N) = that of the robot's cylinder: of Table II" in shown
    assert "table       gauge (Pa) = (572000.0, " in effects("orifice_chamber").stdout


def test_no_json_number_is_infinite() -> None:
    assert json.loads(effects("ground_compliance", "--json").stdout)["parameters"][0]["off"] == (
        "infinity"
    )


def test_a_wrong_name_is_answered_with_the_nearest() -> None:
    wrong = effects("sel_friction")
    assert wrong.exit_code == 2
    assert wrong.stderr == "effects sel_friction: no such effect; did you mean 'seal_friction'?\n"
    assert wrong.stdout == ""


def test_sensor_names_may_carry_their_channel() -> None:
    assert effects("sensor_bias:body/pitch").stdout.startswith("sensor_bias (sensors")
