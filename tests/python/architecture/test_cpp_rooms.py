# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The layers of docs/architecture.md, checked over every #include: a part knows only what is below it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

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
