"""What commands print: for people, for pipes, for programs."""

import csv
import json
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import typer
from command import chipglow, refused
from measured_band import BandImage, measured

from chipglow.cli import app
from chipglow.cli.screen import Screen
from chipglow.io import write_measurement


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_measurement(measured([BandImage().temperature()]), tmp_path / "measured.nc")
    return "measured.nc"


def commands(group, *names):
    """All commands of a group and of those below it, by what a user types."""
    for name, one in group.commands.items():
        if hasattr(one, "commands"):
            yield from commands(one, *names, name)
        else:
            yield (*names, name)


@pytest.mark.parametrize("names", list(commands(typer.main.get_command(app))), ids=" ".join)
def test_every_command_can_answer_programs(names):
    assert "--json" in chipglow(*names, "--help").output


def test_a_program_reads_the_columns_that_the_table_file_has(file, tmp_path):
    result = chipglow("shearband", file, "--out", "band.csv", "--json")
    found = json.loads(result.stdout)
    assert found["files"] == ["band.csv"]
    with (tmp_path / "band.csv").open(encoding="utf-8") as table:
        assert len(list(csv.DictReader(table))) > 10
    (stage,) = found["tables"]["stages"]
    shown = chipglow("shearband", file).stdout
    assert f"{stage['mean_degC']:.1f}" in shown
    assert {row["part"] for row in found["tables"]["budget"]} >= {"u"}


def test_a_pipe_that_ends_early_loses_no_file(file, tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "chipglow", "shearband", file, "--out", "band.csv"]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, encoding="utf-8")
    os.close(writing)
    assert "Error" not in done.stderr
    assert (tmp_path / "band.csv").is_file()


def test_a_program_that_asks_wrongly_gets_the_line_and_no_object(file):
    result = chipglow("shearband", file, "--width", "3 s", "--json", code=2)
    assert result.stdout == "" and result.stderr.startswith("chipglow: --width: ")


def test_what_json_cannot_say_is_null(capsys):
    screen = Screen(json=True)
    frame = pd.DataFrame({"name": ["a", "b"], "value_K": [1.5, np.nan]})
    screen.table("all", frame, ["name"])
    screen.say("Two.", {"array": np.array([1.0, np.inf]), "count": np.int64(2)})
    screen.close()
    found = json.loads(capsys.readouterr().out)
    assert found["tables"]["all"] == [{"name": "a", "value_K": 1.5}, {"name": "b", "value_K": None}]
    assert found["values"] == {"array": [1.0, None], "count": 2}


def run_piped(*arguments, **environment):
    given = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    command = [sys.executable, "-m", "chipglow", *arguments]
    return subprocess.run(command, env=given | environment, capture_output=True, text=True)


def test_a_pipe_gets_one_line_a_row_without_colours():
    result = run_piped("materials", "aisi-1045", FORCE_COLOR="1", NO_COLOR="1")
    assert result.returncode == 0, result.stderr
    assert "\x1b[3" not in result.stdout
    rows = [line for line in result.stdout.splitlines() if line.rstrip().endswith(")")]
    program = chipglow("materials", "aisi-1045", "--json")
    fields = [row["field"] for row in json.loads(program.stdout)["tables"]["properties"]]
    assert [row.split()[0] for row in rows[: len(fields)]] == fields


@pytest.mark.parametrize("command", ["shearband", "rake"])
def test_a_narrow_terminal_loses_no_number(file, command):
    wide = chipglow(command, file, COLUMNS="200").stdout
    narrow = chipglow(command, file, COLUMNS="60").stdout
    assert max(map(len, narrow.split("\n\n")[0].splitlines())) <= 60  # the columns of the terminal
    numbers = [word for word in wide.split("\n\n")[0].split() if word[-1].isdigit()]
    assert numbers
    assert all(number in narrow for number in numbers)


def test_the_doctor_finds_what_is_missing(monkeypatch):
    from chipglow.cli import doctor

    real = doctor.version
    monkeypatch.setattr(doctor, "version", lambda name: "0.1" if name == "numpy" else real(name))
    refused(("doctor", "--json"), "packages: numpy (too old)")


def test_threads_sleep_while_they_wait_unless_told_otherwise():
    code = "import chipglow, os; print(os.environ['OMP_WAIT_POLICY'])"
    for given, expected in (({}, "passive"), ({"OMP_WAIT_POLICY": "active"}, "active")):
        environment = {name: text for name, text in os.environ.items() if name != "OMP_WAIT_POLICY"}
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, env=environment | given, capture_output=True, text=True)
        assert done.stdout.strip() == expected


def test_the_doctor_computes_and_lists_the_optional_parts():
    found = json.loads(chipglow("doctor", "--json", OMP_WAIT_POLICY="active").stdout)
    assert found["values"]["greatest_radiance_difference"] < 1e-6
    parts = {row["extra"]: row["advice"] for row in found["tables"]["optional"]}
    assert parts["mesh"] == ""
    assert parts["pyxel"] in ("", 'python -m pip install ".[pyxel]"')
    assert "all" not in parts
    assert found["facts"]["machine"]["cache"]
    assert found["facts"]["machine"]["threads"].endswith("; active while they wait")
