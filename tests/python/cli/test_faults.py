# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Names that carry markup, folders that are inputs, disks that are full, streams that are closed, runs that
are killed: a line and an exit status, never a traceback, and no mixture of old and new files.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import truing
from browser import dom_of
from pages import charts_of
from truing.cli import main
from truing.errors import InputError
from truing.examples import example
from truing.files import atomic_output_dir, load_robot
from truing.files.output import files_read, require_whole_file

ROBOT = str(example("irb120"))
TRUING = Path(sys.executable).with_name("truing")
SIMULATE = ["simulate", ROBOT, "--poses", "40", "--seed", "1", "--out", "sim"]
IDENTIFY = ["identify", "sim/robot.yaml", "sim/measurements.csv", "--out", "found"]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def call(*arguments: str, **options: Any) -> subprocess.CompletedProcess[bytes]:
    """truing in a process of its own."""
    options = {"capture_output": True, "timeout": 120, **options}
    return subprocess.run([str(TRUING), *arguments], check=False, **options)


def through_shell(text: str, **options: Any) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        ["bash", "-c", text.replace("truing ", f"{TRUING} ")],
        capture_output=True,
        check=False,
        timeout=120,
        **options,
    )


def is_one_line(text: bytes) -> bool:
    return text.startswith(b"truing: ") and text.count(b"\n") == 1


# ---- Names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["arm [/x]", "[bold]", "[link=x]y", "<!--<script>", "a\\[b", "🤖:x:"])
def test_markup_in_names_is_printed_as_it_is(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    robot = truing.load_robot(ROBOT)
    robot.name = name
    robot.joint("J2").name = f"{name}2"
    truing.save_robot("arm.yaml", robot)
    assert main(["simulate", "arm.yaml", "--poses", "60", "--out", "sim"]) == 0
    assert f"{name}: simulated measurements" in " ".join(capsys.readouterr().out.split())
    assert main(["identify", "sim/robot.yaml", "sim/measurements.csv", "--out", "found"]) == 0
    assert name in " ".join(capsys.readouterr().out.split())


def test_escape_sequences_are_written_out_on_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    text = Path(ROBOT).read_text()
    Path("arm.yaml").write_text(
        text.replace("name: irb120", 'name: "i\\e[31m\\u202e"').replace("name: J2", 'name: "\\e]0;x\\a"')
    )
    axis = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    Path("arm.urdf").write_text(
        '<robot name="\x1b[31mx"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        f'<parent link="a"/><child link="b"/>{axis}</joint></robot>'
    )
    for file, status in (("arm.yaml", 0), ("arm.urdf", 0), ("no\x1b[31m.yaml", 2), ("no\u202e.yaml", 2)):
        assert main(["simulate", file, "--poses", "60", "--out", "sim"]) == status
        if file == "arm.yaml":
            assert main(["identify", "sim/robot.yaml", "sim/measurements.csv", "--out", "found"]) == 0
            assert main(["identify", "sim/robot.yaml", "sim/measurements.csv", "--free", "x.y"]) == 2
        said = "".join(capsys.readouterr())
        assert not set(said) & {"\x1b", "\a", "\u202e"} and ("\\x1b" in said or "\\u202e" in said)


def test_a_name_cannot_blank_the_charts_of_a_report() -> None:
    robot = truing.load_robot(ROBOT)
    for index, name in enumerate(["<!--<script>", "</script><img src=x onerror=document.title='owned'>"]):
        robot.joints[index].name = name
    truing.save_robot("arm.yaml", robot)
    assert main(["simulate", "arm.yaml", "--poses", "80", "--out", "sim"]) == 0
    assert main(["identify", "sim/robot.yaml", "sim/measurements.csv", "--out", "found"]) == 0
    page = Path("found/report.html").read_text(encoding="utf-8")
    charts = charts_of(page)
    assert "<!--<script>" in str(charts)
    data = page[page.index('id="charts">') + len('id="charts">') :]
    assert "<" not in data[: data.index("</script>")]
    assert "script-src 'sha256-" in page and "default-src 'none'" in page
    dom = dom_of(Path("found/report.html"))
    assert "owned" not in dom[dom.index("<title>") : dom.index("</title>")]
    # A chart that was drawn holds plotly's picture.
    assert dom.count('class="main-svg"') >= len(charts) > 0
    # So does a robot: its joints' names are text, on the page and in its sliders.
    assert 'class="scene cloud drawn"' in dom and "<canvas" in dom
    sliders = re.findall('class="slider"><span>(.*?)</span>', dom)
    assert {
        "&lt;!--&lt;script&gt;",
        "&lt;/script&gt;&lt;img src=x onerror=document.title='owned'&gt;",
    } <= set(sliders)
    # Where scripts are blocked, pictures are there.
    Path("blocked.html").write_text(re.sub("script-src [^;]*;", "script-src 'none';", page), encoding="utf-8")
    still = dom_of(Path("blocked.html"))
    assert still.count('<svg class="picture"') == len(charts) + 1 and "main-svg" not in still


# ---- Folders -------------------------------------------------------------------------------------


def test_an_input_is_never_replaced_by_the_result(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(SIMULATE) == 0
    before = {path.name: path.read_bytes() for path in Path("sim").iterdir()}
    Path("other").symlink_to("sim")
    for out in ("sim", "./sim/", "other"):
        assert main([*IDENTIFY[:-1], out]) == 2
        assert "is an input of this run" in capsys.readouterr().err
        assert {path.name: path.read_bytes() for path in Path("sim").iterdir()} == before


def test_the_result_of_another_command_is_not_mixed_with_what_was_read_from_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(SIMULATE) == 0 and main(IDENTIFY) == 0
    before = {path.name: path.read_bytes() for path in Path("found").iterdir()}
    predict = ["predict", "found/robot.yaml", "sim/measurements.csv", "--out"]
    assert main([*predict, "found"]) == 2
    assert "reads files of the result there (truing-identification/1)" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in Path("found").iterdir()} == before
    for _ in range(2):  # its own result may be replaced
        assert main([*predict, "predicted"]) == 0


def test_a_file_that_another_file_names_is_an_input_too() -> None:
    Path("named.csv").write_text("read")
    with files_read() as read:
        require_whole_file(Path("named.csv"))
    with pytest.raises(InputError, match="is an input"), atomic_output_dir(".", inputs=read) as folder:
        (folder / "named.csv").write_text("written")
    with atomic_output_dir(".", inputs=read, obsolete=["named.csv"]) as folder:
        (folder / "other.csv").write_text("written")
    assert Path("named.csv").read_text() == "read" and Path("other.csv").exists()
    with files_read() as nothing:
        pass
    assert read == [Path("named.csv")] and nothing == []


def test_what_a_killed_run_left_is_cleared_by_the_next(tmp_path: Path) -> None:
    program = (
        "import sys, time; from truing.files import atomic_output_dir\n"
        "with atomic_output_dir('out') as folder:\n"
        "    (folder / 'a').write_text('half'); print('ready', flush=True); time.sleep(60)\n"
    )
    for there_already in (False, True):
        if there_already:
            Path("out").mkdir(exist_ok=True)
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
            assert process.stdout is not None and process.stdout.readline() == b"ready\n"
            # While it lives its folder stays.
            with atomic_output_dir("other"):
                pass
            assert len(list(tmp_path.rglob(".truing-*"))) == 1
            process.kill()
        with atomic_output_dir("out") as folder:
            (folder / "a").write_text("whole")
        assert Path("out/a").read_text() == "whole"
        assert not list(tmp_path.rglob(".truing-*"))


def test_a_run_killed_while_it_replaced_files_is_told_by_its_manifest(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(SIMULATE) == 0
    replace = Path.replace
    moved: list[Path] = []

    def killed(self: Path, target: Path) -> Path:
        if target.parent == Path("sim"):
            if moved:
                raise GeneratorExit  # after kill -9 nothing of ours runs: what is on the disk now counts
            moved.append(self)
        return replace(self, target)

    with monkeypatch.context() as patched, pytest.raises(GeneratorExit):
        patched.setattr(Path, "replace", killed)
        main([*SIMULATE[:-1], "sim", "--seed", "2"])
    assert len(moved) == 1 and Path("sim/.truing-unfinished").exists()
    with pytest.raises(InputError, match="left old and new ones mixed"):
        load_robot("sim/robot.yaml")
    assert main(IDENTIFY) == 2
    assert "mixed" in capsys.readouterr().err
    assert main(SIMULATE) == 0 and main(IDENTIFY) == 0


def test_a_full_disk_is_a_line_and_exit_status_1(tmp_path: Path) -> None:
    assert main(SIMULATE) == 0

    def small() -> None:  # no file may be larger; what writes more gets an error as from a full disk
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    done = call(*IDENTIFY, preexec_fn=small)
    assert done.returncode == 1
    assert is_one_line(done.stderr) and b"File too large" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sim"]


def test_a_working_folder_that_is_gone_is_a_line(tmp_path: Path) -> None:
    for command in ("simulate " + ROBOT, "effects", "--version", "identify a b --out c", "demo"):
        done = through_shell(f"mkdir gone && cd gone && rmdir ../gone && truing {command}", cwd=tmp_path)
        assert b"Traceback" not in done.stderr
        assert done.returncode == (0 if command in ("effects", "--version") else 2), done.stderr
        assert done.returncode == 0 or is_one_line(done.stderr)


def test_a_pipe_is_refused_as_an_input() -> None:
    os.mkfifo("pipe.csv")
    os.mkfifo("pipe.yaml")
    for arguments in (["identify", ROBOT, "pipe.csv"], ["identify", "pipe.yaml", "pipe.csv"]):
        done = call(*arguments, timeout=30)
        assert done.returncode == 2 and is_one_line(done.stderr) and b"is a pipe" in done.stderr


# ---- Streams -------------------------------------------------------------------------------------


def test_output_that_nobody_reads_is_no_traceback() -> None:
    assert main(SIMULATE) == 0
    for command in ("truing effects", "truing effects --help", "truing identify " + " ".join(IDENTIFY[1:])):
        cut = through_shell(f"set -o pipefail; {command} | head -c 1")
        assert cut.returncode == 0 and cut.stderr == b"", cut.stderr
        for json in ("", " --json"):
            if json and "identify" not in command:
                continue
            full = through_shell(f"{command}{json} > /dev/full")
            assert full.returncode == 1 and is_one_line(full.stderr), full.stderr
            assert b"No space left on device" in full.stderr
            closed = through_shell(f"{command}{json} >&-")
            assert closed.returncode == 1 and is_one_line(closed.stderr), closed.stderr
        for nowhere in ("2>&-", ">&- 2>&-", "2> /dev/full", "<&- >&- 2>&-"):
            assert through_shell(f"{command} {nowhere}").returncode in (0, 1)


def test_a_terminal_without_utf_8_gets_escapes() -> None:
    robot = truing.load_robot(ROBOT)
    robot.name = "Größe 机器人"
    truing.save_robot("arm.yaml", robot)
    for language in ({"LC_ALL": "C"}, {"LC_ALL": "POSIX"}):
        plain = {**os.environ, **language, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
        done = call("simulate", "arm.yaml", "--poses", "5", "--out", "sim", env=plain)
        assert done.returncode == 0 and b"Gr\\xf6\\xdfe" in done.stdout and done.stderr == b""
        assert call("simulate", "机.yaml", env=plain).returncode == 2
        assert call("effects", "--help", env=plain).returncode == 0


def test_ctrl_c_that_meets_a_finaliser_is_a_line(tmp_path: Path) -> None:
    """Nothing can be raised there: Python prints a traceback and goes on."""
    assert main(SIMULATE) == 0
    before = sorted(tmp_path.iterdir())
    program = (
        "import os, signal, sys, time\n"
        "from truing.cli import main\n"
        "from truing.cli.commands import identify\n"
        "class Dropped:\n"
        "    def __del__(self):\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "        time.sleep(5)\n"
        "write = identify.Command.write\n"
        "def interrupted(self, folder, *rest):\n"
        "    written = write(self, folder, *rest)\n"
        "    Dropped()\n"
        "    time.sleep(5)\n"
        "    return written\n"
        "identify.Command.write = interrupted\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *IDENTIFY], capture_output=True, check=False, timeout=120
    )
    assert done.returncode == 130
    assert done.stderr == b"truing: interrupted\n", done.stderr.decode()
    assert sorted(tmp_path.iterdir()) == before


def test_ctrl_c_twice_leaves_nothing_behind(tmp_path: Path) -> None:
    program = (
        "import os, shutil, signal\n"
        "from truing.files import output\n"
        "remove = shutil.rmtree\n"
        "def slow(*arguments, **options):\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    remove(*arguments, **options)\n"
        "output.shutil.rmtree = slow\n"
        "with output.atomic_output_dir('out') as folder:\n"
        "    (folder / 'a').write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False, timeout=60)
    assert b"KeyboardInterrupt" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_leaves_the_process_of_a_caller_alone() -> None:
    """What still computes is waited for: coming back while Python puts itself away, it would abort."""
    program = (
        "import os, signal, sys, threading, time\n"
        "from truing.cli import main\n"
        "from truing.cli.commands import effects\n"
        "from truing.cli.run import working\n"
        "def computes(self):\n"
        "    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "    return working('working', lambda progress: time.sleep(2.0))\n"
        "effects.Command.run = computes\n"
        "status = main(['effects'])\n"
        "print(status, threading.active_count() > 1, flush=True)\n"
        "sys.exit(7)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False, timeout=60)
    assert done.returncode == 7
    assert done.stdout.split() == [b"130", b"True"]
    assert done.stderr == b"truing: interrupted\n"


@pytest.mark.parametrize(("code", "status"), [("", 0), ("0", 0), ("3", 3), ("'a line'", 1)])
def test_a_program_that_exits_inside_keeps_its_status(code: str, status: int) -> None:
    program = (
        "import sys\n"
        "from truing.cli import main\n"
        "from truing.cli.commands import effects\n"
        f"def leaves(self): raise SystemExit({code})\n"
        "effects.Command.run = leaves\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "effects"], capture_output=True, check=False, timeout=60
    )
    assert done.returncode == status
    assert done.stderr == (b"truing: a line\n" if status == 1 else b"")


@pytest.mark.slow
def test_ctrl_c_at_any_moment_is_a_line(tmp_path: Path) -> None:
    assert main(SIMULATE) == 0
    before = sorted(tmp_path.iterdir())
    for step in range(40):
        with subprocess.Popen(
            [str(TRUING), *IDENTIFY], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        ) as process:
            time.sleep(0.1 + 0.025 * step)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=30)
        assert b"Traceback" not in errors, errors.decode()
        if process.returncode == 130:
            assert errors == b"truing: interrupted\n"
        else:
            assert process.returncode == 0
        if process.returncode == 0 or Path("found").exists():  # at the very end: all is written
            assert len(list(Path("found").iterdir())) == 5
            shutil.rmtree("found")
        assert sorted(tmp_path.iterdir()) == before
