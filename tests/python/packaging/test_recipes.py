# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What packagers get agrees with the build: package.xml, the conda recipe, Debian's control file.

scripts/check_packaging.sh reads them with the packagers' own tools; here is what these cannot know.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[3]
CMAKE = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
PACKAGE = ElementTree.parse(ROOT / "package.xml").getroot()
RECIPE = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
DEBIAN = ROOT / "packaging" / "debian"

# What the build asks for, as rosdep, conda-forge and Debian name it.
LIBRARIES = {
    "Eigen3": ("eigen", "eigen", "libeigen3-dev"),
    "Ceres": ("libceres-dev", "ceres-solver", "libceres-dev"),
    "urdfdom": ("liburdfdom-dev", "urdfdom", "liburdfdom-dev"),
    "tinyxml2": ("tinyxml2", "tinyxml2", "libtinyxml2-dev"),
}


def version() -> str:
    found = re.search(r"project\(truing VERSION ([0-9.]+)", CMAKE)
    assert found is not None
    return found[1]


def libraries_of_the_build() -> set[str]:
    """Packages that the library cannot be built without, the compiler's threads aside."""
    section = CMAKE.split("# ---- Dependencies")[1].split("# ---- ")[0]
    return set(re.findall(r"find_package\((\w+)[^)]*REQUIRED", section)) - {"Threads"}


def words(requirements: list[object]) -> set[str]:
    return {str(item).split()[0] for item in requirements}


def debian_field(paragraph: str, field: str) -> set[str]:
    control = (DEBIAN / "control").read_text(encoding="utf-8")
    text = next(part for part in control.split("\n\n") if paragraph in part)
    value = re.search(rf"^{field}:(.*(?:\n .*)*)", text, re.MULTILINE)
    assert value is not None
    return {re.split(r"[ (\[]", item.strip())[0] for item in value[1].split(",")}


def test_every_package_has_the_version_of_the_build() -> None:
    changelog = (DEBIAN / "changelog").read_text(encoding="utf-8")
    assert PACKAGE.findtext("version") == version()
    assert RECIPE["context"]["version"] == version()
    assert changelog.startswith(f"truing ({version()}-")


def test_every_library_that_the_build_needs_is_asked_for_everywhere() -> None:
    assert libraries_of_the_build() == set(LIBRARIES)
    rosdep = {element.text for element in PACKAGE.findall("depend")}
    for ros, conda, debian in LIBRARIES.values():
        assert ros in rosdep
        assert all(conda in words(output["requirements"]["host"]) for output in RECIPE["outputs"])
        assert debian in debian_field("Source: truing", "Build-Depends")
        assert debian in debian_field("Package: libtruing-dev", "Depends")


def test_ros_builds_it_as_a_plain_cmake_package() -> None:
    assert PACKAGE.get("format") == "3"
    assert PACKAGE.findtext("export/build_type") == "cmake"


def test_the_conda_package_needs_at_run_time_what_the_wheel_does() -> None:
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    listed = re.search(r"^dependencies = \[(.*?)\]", project, re.MULTILINE | re.DOTALL)
    assert listed is not None
    wheel = set(re.findall(r'"([A-Za-z0-9_-]+)', listed[1]))
    (python,) = [output for output in RECIPE["outputs"] if output["package"]["name"] == "truing"]
    assert words(python["requirements"]["run"]) - {"python"} == wheel
