# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The layers of docs/architecture.md, checked over every #include and every import: a part knows only what is
below it.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# ---- C++
# ---------------------------------------------------------------------------------------------------------------

# From the ground up. A file may include files of its own layer and of those above it in this list.
CPP_LAYERS = [
    ("kernel", ["kernel/kernel.hpp", "kernel/kernel.cpp", "kernel/dispatch.cpp"]),
    (
        "tools",
        [
            "truing/version.hpp",
            "text.hpp",
            "random.hpp",
            "rotation.hpp",
            "frame.hpp",
            "dual_quaternion.hpp",
            "registration.hpp",
            "registration.cpp",
            "observability.hpp",
            "observability.cpp",
            "evidence.hpp",
            "evidence.cpp",
            "trigonometry.hpp",
            "batch.hpp",
        ],
    ),
    (
        "robot",
        [
            "truing/robot.hpp",
            "robot.cpp",
            "motion.hpp",
            "truing/urdf.hpp",
            "urdf.cpp",
            "truing/interference.hpp",
        ],
    ),
    ("measurement", ["truing/measurement.hpp", "measurement.cpp"]),
    ("effect", ["truing/effect.hpp", "effect.cpp", "gravity.hpp", "gravity.cpp"]),
    ("model", ["model.hpp", "model.cpp"]),
    ("evaluate", ["evaluate.hpp", "evaluate.cpp"]),
    # what is asked for and what comes back
    (
        "options",
        [
            "truing/identify.hpp",
            "truing/diagnose.hpp",
            "truing/inverse.hpp",
            "truing/compensate.hpp",
            "statistics.hpp",
        ],
    ),
    (
        "estimation",
        ["selection.hpp", "selection.cpp", "solvers.hpp", "levenberg_marquardt.cpp", "ceres_solver.cpp"],
    ),
    (
        "diagnosis",
        [
            "linearise.hpp",
            "linearise.cpp",
            "sanity.hpp",
            "sanity.cpp",
            "candidates.hpp",
            "candidates.cpp",
            "free_search.hpp",
            "free_search.cpp",
            "where.hpp",
            "where.cpp",
            "next_poses.hpp",
            "next_poses.cpp",
        ],
    ),
    (
        "reach",
        [
            "arm.hpp",
            "arm.cpp",
            "closed_form.hpp",
            "closed_form.cpp",
            "descent.hpp",
            "descent.cpp",
            "surroundings.hpp",
            "surroundings.cpp",
            "reach.hpp",
            "reach.cpp",
            "why_not.cpp",
            "best.cpp",
            "path.cpp",
        ],
    ),
    (
        "tasks",
        [
            "truing/plan.hpp",
            "identify.cpp",
            "plan_poses.hpp",
            "plan_effects.cpp",
            "plan.cpp",
            "diagnosis.hpp",
            "weigh.cpp",
            "decide.cpp",
            "sureness.cpp",
            "refit.cpp",
            "describe.cpp",
            "diagnose.cpp",
            "inverse.cpp",
            "compensate.cpp",
        ],
    ),
    (
        "hand-eye",
        [
            "truing/handeye.hpp",
            "handeye_closed_form.hpp",
            "handeye_closed_form.cpp",
            "handeye_consensus.hpp",
            "handeye_consensus.cpp",
            "handeye_readings.hpp",
            "handeye_readings.cpp",
            "handeye_refine.hpp",
            "handeye_refine.cpp",
            "handeye_images.hpp",
            "handeye_images.cpp",
            "handeye_errors.hpp",
            "handeye_errors.cpp",
            "handeye.cpp",
            "handeye_plan.cpp",
            "handeye_clock.cpp",
            "handeye_kinematics.cpp",
        ],
    ),
    ("streams", ["truing/streams.hpp", "truing/stream_simulation.hpp", "stream_simulation.cpp"]),
    (
        "tracking",
        [
            "truing/track.hpp",
            "pose_filter.hpp",
            "pose_filter.cpp",
            "deviation.hpp",
            "deviation.cpp",
            "modes.cpp",
            "track_watch.hpp",
            "track_watch.cpp",
            "correction_limiter.hpp",
            "track.cpp",
            "truing/track_calibrate.hpp",
            "track_calibrate.cpp",
            "track_calibrate_inertial.cpp",
        ],
    ),
    ("replay", ["truing/track_replay.hpp", "track_replay.cpp"]),
    ("everything", ["truing/truing.hpp"]),
]
CPP_RANK = {file: rank for rank, (_, files) in enumerate(CPP_LAYERS) for file in files}

# Which files may include what comes from elsewhere.
CPP_ONLY_IN = {
    "ceres/": {"ceres_solver.cpp", "handeye_images.cpp"},
    "urdf_": {"urdf.cpp"},
    "console_bridge/": {"urdf.cpp"},
    "tinyxml2": {"urdf.cpp"},
    "thread": {"evaluate.cpp", "weigh.cpp", "batch.hpp"},
    "iostream": set[str](),  # the library prints nothing
}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
STANDARD = re.compile(r"[a-z_]+")  # <vector>; but not <ceres/ceres.h>


def cpp_files() -> dict[str, Path]:
    """Every C++ file by the name that an #include gives it."""
    source, include = ROOT / "cpp" / "src", ROOT / "cpp" / "include"
    found = {path.relative_to(source).as_posix(): path for path in source.rglob("*.[ch]pp")}
    found.update({path.relative_to(include).as_posix(): path for path in include.rglob("*.hpp")})
    found["truing/version.hpp"] = include / "truing" / "version.hpp.in"
    return found


def includes(path: Path) -> Iterator[tuple[str, str]]:
    """'<' or '"', and the name, of every #include."""
    for match in INCLUDE.finditer(path.read_text(encoding="utf-8")):
        yield match[1], match[2]


def own(including: str, name: str) -> str:
    """A file of ours that `including` names relative to its own folder or to cpp/src."""
    beside = (Path(including).parent / name).as_posix()
    return beside if beside in CPP_RANK else name


@pytest.mark.parametrize("file", sorted(cpp_files()))
def test_a_cpp_file_includes_only_what_is_below_it(file: str) -> None:
    assert file in CPP_RANK, f"{file} is in no layer: give it one, here and in docs/architecture.md"
    for bracket, name in includes(cpp_files()[file]):
        name = own(file, name)
        if name not in CPP_RANK:
            assert bracket == "<", (
                f'{file}: "{name}" is no file of ours; what comes from elsewhere stands in < >'
            )
            continue
        layer, theirs = CPP_LAYERS[CPP_RANK[file]][0], CPP_LAYERS[CPP_RANK[name]][0]
        assert CPP_RANK[name] <= CPP_RANK[file], (
            f"{file} ({layer}) includes {name}, which belongs to a higher layer ({theirs})"
        )


def test_the_table_of_layers_has_no_files_that_are_gone() -> None:
    assert set(CPP_RANK) == set(cpp_files())


@pytest.mark.parametrize("file", sorted(name for name in cpp_files() if name.startswith("kernel/")))
def test_the_kernel_knows_nothing_of_what_uses_it(file: str) -> None:
    for _, name in includes(cpp_files()[file]):
        assert name == "kernel.hpp" or STANDARD.fullmatch(name), (
            f"{file} includes {name}: raw pointers and the standard library are all there is here"
        )


@pytest.mark.parametrize("file", sorted(name for name in cpp_files() if name.startswith("truing/")))
def test_a_public_header_shows_its_users_eigen_and_nothing_else(file: str) -> None:
    for _, name in includes(cpp_files()[file]):
        allowed = name.startswith(("Eigen/", "truing/")) or STANDARD.fullmatch(name)
        assert allowed, f"{file} includes {name}: users would need it too"


@pytest.mark.parametrize("dependency", sorted(CPP_ONLY_IN))
def test_a_dependency_is_known_to_one_file_only(dependency: str) -> None:
    users = {
        file
        for file, path in cpp_files().items()
        if any(name.startswith(dependency) for _, name in includes(path))
    }
    assert users <= CPP_ONLY_IN[dependency], (
        f"<{dependency}…> belongs into {sorted(CPP_ONLY_IN[dependency]) or 'no file'}"
    )


def test_solvers_and_planning_do_not_know_each_other() -> None:
    files = cpp_files()
    assert "solvers.hpp" not in {name for _, name in includes(files["plan.cpp"])}
    for solver in ("levenberg_marquardt.cpp", "ceres_solver.cpp"):
        assert {name for bracket, name in includes(files[solver]) if bracket == '"'} == {"solvers.hpp"}


# ---- Python
# ------------------------------------------------------------------------------------------------------------

# What each module of the package may import from it, late imports inside functions and those for type
# checking included.
# "truing" stands for the public names of the package.
PYTHON_MAY_IMPORT = {
    "truing.errors": {"truing._core"},
    "truing.effects": {"truing._core", "truing.errors"},
    "truing.api": {"truing._core", "truing.errors", "truing.effects"},
    "truing.boards": {"truing._core", "truing.errors"},
    "truing.files": {"truing._core", "truing.errors", "truing.boards", "truing.files"},
    "truing.hand_eye": {"truing._core", "truing.errors", "truing.effects", "truing.files"},
    "truing.inverse_kinematics": {"truing._core", "truing.errors", "truing.files"},
    "truing.track": {"truing._core", "truing.errors", "truing.files"},
    "truing.simulation": {"truing", "truing.errors", "truing.files"},
    "truing.handeye_simulation": {"truing.errors"},  # no solver: it says what solvers should find
    "truing.results": {"truing", "truing.errors", "truing.files", "truing.report", "truing.diagnose_report"},
    "truing.handeye_results": {
        "truing",
        "truing.errors",
        "truing.files",
        "truing.results",
        "truing.handeye_report",
    },
    "truing.inverse_results": {"truing", "truing.files", "truing.results", "truing.inverse_report"},
    "truing.inverse_report": {"truing.inverse_results", "truing.report"},
    "truing.handeye_report": {"truing.handeye_results", "truing.report"},
    "truing.track_results": {
        "truing",
        "truing.files",
        "truing.track",
        "truing.results",
        "truing.handeye_results",
        "truing.track_report",
    },
    "truing.track_report": {"truing.track", "truing.track_results", "truing.report"},
    "truing.report": {"truing.results"},
    "truing.diagnose_report": {"truing.results", "truing.report"},
    "truing.demo": {"truing", "truing.errors", "truing.files", "truing.simulation", "truing.results"},
    "truing.exam": {"truing"},  # and of that only containers and readers: test_exam.py
    "truing.cli": {
        "truing",
        "truing.errors",
        "truing.files",
        "truing.simulation",
        "truing.results",
        "truing.report",
        "truing.diagnose_report",
        "truing.handeye_results",
        "truing.inverse_results",
        "truing.track",
        "truing.track_results",
        "truing.demo",
        "truing.exam",
    },
    "truing": {
        "truing._core",
        "truing.errors",
        "truing.effects",
        "truing.api",
        "truing.boards",
        "truing.files",
        "truing.hand_eye",
        "truing.inverse_kinematics",
        "truing.track",
        "truing.simulation",
    },
}

# Parts of several modules, which may import each other.
FOLDERS = {"truing.files", "truing.exam"}
# Those of the examination, from the ground up: each may import those before it.
EXAM_LAYERS = [
    "robots",
    "kinematics",
    "laws",
    "surprises",
    "design",
    "physics",
    "worlds",
    "sizing",
    "recordings",
    "confounded",
    "sets",
    "answers",
    "score",
    "sealing",
    "run",
]

# Packages that are slow to import, or belong to one job: who may import them.
PYTHON_ONLY_IN = {
    "yaml": {"truing.files", "truing.simulation"},
    "pydantic": {"truing.files"},
    "pyarrow": {"truing.files"},
    "plotly": {"truing.report"},
    "typer": {"truing.cli"},
    "rich": {"truing.cli", "truing.demo"},
    "mujoco": {"truing.exam"},
    "cv2": {"truing.boards"},
}


def python_files() -> dict[str, Path]:
    """Every module of the package; those in truing/files count as one part."""
    folder = ROOT / "python" / "truing"
    return {path.relative_to(folder).as_posix(): path for path in folder.rglob("*.py")}


def part_of(module: str) -> str:
    """truing.files.table -> truing.files; truing.api.identify -> truing.api."""
    words = module.split(".")
    return ".".join(words[:2]) if ".".join(words[:2]) in {*PYTHON_MAY_IMPORT, "truing._core"} else words[0]


def part_of_file(file: str) -> str:
    words = file.removesuffix(".py").split("/")
    return "truing" if words == ["__init__"] else f"truing.{words[0]}"


def imports(path: Path) -> Iterator[str]:
    """The full name of everything that is imported anywhere in a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: write imports out, from truing…"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("file", sorted(python_files()))
def test_a_module_imports_only_what_its_part_may(file: str) -> None:
    part = part_of_file(file)
    assert part in PYTHON_MAY_IMPORT, f"{file} is in no part: give it one, here and in docs/architecture.md"
    for name in imports(python_files()[file]):
        if name.split(".")[0] == "truing":
            assert part_of(name) in PYTHON_MAY_IMPORT[part] | ({part} if part in FOLDERS else set()), (
                f"{file} imports {name}"
            )


@pytest.mark.parametrize("file", sorted(python_files()))
def test_heavy_packages_stay_where_they_are_needed(file: str) -> None:
    for name in imports(python_files()[file]):
        package = name.split(".")[0]
        if package in PYTHON_ONLY_IN:
            assert part_of_file(file) in PYTHON_ONLY_IN[package], f"{file} imports {package}"
        else:
            assert package in {
                "truing",
                "numpy",
                "pydantic_core",
                *sys.stdlib_module_names,
            }, f"{file} imports {package}: a new dependency?"


@pytest.mark.parametrize("module", EXAM_LAYERS)
def test_a_module_of_the_examination_imports_only_those_below_it(module: str) -> None:
    below = set(EXAM_LAYERS[: EXAM_LAYERS.index(module)])
    for name in imports(python_files()[f"exam/{module}.py"]):
        words = name.split(".")
        assert words[:2] != ["truing", "exam"] or (words[2] if len(words) > 2 else "") in below, (
            f"exam/{module}.py imports {name}"
        )


def test_every_module_of_the_examination_has_a_layer() -> None:
    assert {f"exam/{module}.py" for module in EXAM_LAYERS} | {"exam/__init__.py"} == {
        file for file in python_files() if file.startswith("exam/")
    }


def test_nobody_imports_the_command_line() -> None:
    for file, path in python_files().items():
        assert not any(part_of(name) == "truing.cli" for name in imports(path)), (
            f"{file} imports the command line"
        )


def test_importing_truing_stays_cheap() -> None:
    """The package itself needs no plotting, no command line and no report."""
    later = {
        "truing.cli",
        "truing.report",
        "truing.diagnose_report",
        "truing.results",
        "truing.handeye_results",
        "truing.handeye_report",
        "truing.inverse_results",
        "truing.inverse_report",
        "truing.track_results",
        "truing.track_report",
        "truing.demo",
        "truing.exam",
    }
    assert not later & PYTHON_MAY_IMPORT["truing"]
    assert not any(part_of(name) in later for name in imports(python_files()["__init__.py"]))
