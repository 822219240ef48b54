# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Dask does the work as this process would: to the last bit, whoever dies meanwhile."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import truing
from truing.cli import main
from truing.examples import example
from truing.fleet import FleetIdentification
from truing.fleet.workers import workers_of
from truing.testing.fleet import save_fleet, simulate_fleet

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def robot() -> truing.Robot:
    return truing.load_robot(example("ur10"))


@pytest.fixture(scope="module")
def folder(robot: truing.Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three arms in 24 partitions: more than one addition takes."""
    place = tmp_path_factory.mktemp("fleet")
    save_fleet(place, simulate_fleet(robot, arms=3, poses=160, faults=0, columns=(), seed=8), robot)
    for path in place.glob("*.parquet"):
        pq.write_table(pq.read_table(path), path, row_group_size=20)
    return place


@pytest.fixture(scope="module")
def alone(robot: truing.Robot, folder: Path) -> FleetIdentification:
    return truing.fleet.identify(robot, folder, workers=0)


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Two workers."""
    with workers_of(workers=2) as workers:
        yield workers.client


def bits(found: FleetIdentification) -> str:
    """Every number that was found, digit by digit."""
    own = [(arm.parameters, arm.robot.T_measurement_base.tolist()) for arm in found.arms.values()]
    errors = (found.after.fitted.squares, found.after.held_out.total, found.after.fitted.counts.tolist())
    return repr((found.parameters, found.covariance.tolist(), own, errors, found.passes))


def test_two_workers_find_the_same_bits_as_this_process(
    robot: truing.Robot, folder: Path, alone: FleetIdentification, client: Any
) -> None:
    assert alone.partitions == 24
    assert bits(truing.fleet.identify(robot, folder, client)) == bits(alone)


def test_a_dask_dataframe_is_a_source(robot: truing.Robot, folder: Path, client: Any) -> None:
    import dask.dataframe as frames  # the extra `test` has it: a test that cannot run is to fail

    files = sorted(str(path) for path in folder.glob("*.parquet"))
    frame = frames.read_parquet(files[:1])
    found = truing.fleet.identify(robot, frame, client)
    same = truing.fleet.identify(robot, files[:1], client, one_arm=True)
    assert found.arms["arm"].rows == 160
    for one, other in zip(found.parameters, same.parameters, strict=True):
        assert one.frozen or one.value == pytest.approx(other.value, abs=0.01 * one.sigma)


def test_a_wrong_scheduler_is_one_line_and_exit_2(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("truing.fleet.workers.ANSWER_WITHIN", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        code = main(
            ["fleet", "identify", str(example("ur10")), str(folder), "--scheduler", address]
            + ["--out", str(tmp_path / "out")]
        )
        said = capsys.readouterr().err
        assert code == 2
        assert said.count("\n") == 1 and said.startswith(f"truing: --scheduler: found '{address}'"), said
    assert not (tmp_path / "out").exists()


def test_the_command_works_on_the_scheduler_at_an_address(
    folder: Path, tmp_path: Path, client: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    address = client.scheduler_info()["address"]
    code = main(
        ["fleet", "identify", str(example("ur10")), str(folder), "--scheduler", address, "--out", str(out)]
    )
    assert code == 0
    assert "3 arms, 480 rows, 24 partitions" in capsys.readouterr().out
    assert (out / "robot_a003.yaml").exists()


def test_a_script_without_a_guard_is_told_to_have_one(folder: Path, tmp_path: Path) -> None:
    """Every worker runs the script again: one error says what to write, and none is of Dask."""
    script = tmp_path / "script.py"
    script.write_text(
        "import truing\nfrom truing.examples import example\n"
        f"truing.fleet.identify(truing.load_robot(example('ur10')), {str(folder)!r}, workers=1)\n"
    )
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=300)
    assert ran.returncode == 1
    assert ran.stderr.count("Traceback") == 1, ran.stderr
    last = ran.stderr.strip().splitlines()[-1]
    assert last.startswith("truing.errors.InputError: the worker processes did not start"), last
    assert 'if __name__ == "__main__":' in last


class _Killer(threading.Thread):
    """Kills workers as soon as they are at work, once."""

    def __init__(self, client: Any, most: int) -> None:
        super().__init__(daemon=True)
        self.client, self.most, self.killed = client, most, 0
        self.pids = list(client.run(os.getpid).values())

    def run(self) -> None:
        while not any(self.client.processing().values()):
            time.sleep(0.002)
        for pid in self.pids[: self.most]:
            os.kill(pid, signal.SIGKILL)
            self.killed += 1


@pytest.mark.slow
@pytest.mark.parametrize("most", [1, 2])
def test_workers_killed_at_work_change_no_bit(
    robot: truing.Robot, folder: Path, alone: FleetIdentification, most: int
) -> None:
    with workers_of(workers=2) as workers:
        killer = _Killer(workers.client, most)
        killer.start()
        found = truing.fleet.identify(robot, folder, workers.client)
        killer.join(1.0)
        again = set(workers.client.run(os.getpid).values())
        assert killer.killed == most
        assert not set(killer.pids[:most]) & again  # they were replaced
    assert bits(found) == bits(alone)
