# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Lists what a wheel is made of, with the licence of each part, and writes the wheel with their notices.

    python scripts/licences.py WHEEL --out dist --linked linked.d --built build/wheel/build

What is looked at: the shared libraries in the wheel, every archive and library that the linker read
(`ld --dependency-file`), every header that a compiler read (`ninja -t deps`), and every other file of the
wheel. Whose a file is says the package that it came with; under which licence, the package's machine-readable
`copyright` file (Debian's DEP 5), stanza by stanza. Fails, with nothing written, on a file that belongs to
nobody known and on a licence that is not in ALLOWED.
"""

from __future__ import annotations

import argparse
import email
import fnmatch
import functools
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# What may be part of a wheel under the BSD licence: nothing here asks anything of the rest of it.
# Debian's word: SPDX's.
ALLOWED = {
    "bsd-2-clause": "BSD-2-Clause",
    "bsd-3-clause": "BSD-3-Clause",
    "expat": "MIT",
    "mit": "MIT",
    "apache-2": "Apache-2.0",
    "apache-2.0": "Apache-2.0",
    "isc": "ISC",
    "0bsd": "0BSD",
    "unlicense": "Unlicense",
    "zlib": "Zlib",
    "zlib/libpng": "Zlib",
    "mpl-2": "MPL-2.0",
    "mpl-2.0": "MPL-2.0",
    "psf-2.0": "PSF-2.0",
    "public-domain": "LicenseRef-public-domain",
}

# The tool chain and the interfaces of the system: headers and start-up code whose licences say that
# what is compiled with them is not bound. By source package.
SYSTEM = {
    "gcc": "GCC Runtime Library Exception 3.1",
    "glibc": "interface of the C library, which is not in the wheel; start-up code by its exception",
    "linux": "interface of the kernel, by the syscall note",
    "python": "interface of Python, which is not in the wheel",
}

# Files of truing's own in a wheel. Anything else has to be told here, with where its licence stands.
OWN_FILES = (
    "*.py",
    "*.pyi",
    "*.css",
    "*/py.typed",
    "truing/examples/*",
    "truing/report/boot.js",
    "*.dist-info/*",
)
# A script that is made of packages, and the file beside it that names each in a line `name version (licence)`
# and has their texts: web/build.mjs writes both.
SCRIPT = "truing/report/report.js"
SCRIPT_LICENCES = "truing/report/licences.txt"
SCRIPT_PART = re.compile(r"^(@?[\w./-]+) (\d[\w.-]*) \(([^()]+)\)$", re.MULTILINE)
MPL_SOURCE = (
    "Eigen is used unmodified. Its source is Debian's or Ubuntu's source package of the version named above,"
    " and at https://eigen.tuxfamily.org."
)


class LicenceError(Exception):
    """What cannot be shipped, and why."""


@dataclass
class Part:
    """Something by others that is in the wheel."""

    name: str
    version: str
    licences: set[str] = field(default_factory=set)  # SPDX
    notice: str = ""
    files: set[str] = field(default_factory=set)


# ---- Debian's copyright files --------------------------------------------------------------------


@dataclass
class Stanza:
    patterns: list[str]
    licence: str


def read_copyright(text: str) -> list[Stanza]:
    """The stanzas of a machine-readable copyright file, in order; none if it is not machine-readable."""
    if not text.startswith("Format:"):
        return []
    stanzas = [email.message_from_string(part) for part in re.split(r"\n[ \t]*\n", text)]
    return [
        Stanza(part["Files"].split(), part["License"].splitlines()[0].strip())
        for part in stanzas
        if part["Files"] and part["License"]
    ]


def licence_of(path: str, stanzas: list[Stanza]) -> str:
    """What the last stanza that fits says, as DEP 5 has it. An installed path ends as that of the source."""
    found = ""
    for stanza in stanzas:
        if any(fnmatch.fnmatch(path, "*/" + pattern) for pattern in stanza.patterns):
            found = stanza.licence
    return found


def accepted(licence: str) -> str:
    """The SPDX expression of a licence that may be shipped; of `A or B` the one that may, of `A and B` both.

    Raises LicenceError where there is none.
    """
    for choice in re.split(r"\s+or\s+", licence.lower()):
        parts = [ALLOWED.get(part) for part in re.split(r"\s+and\s+", choice.strip())]
        if all(parts):
            return " AND ".join(sorted({str(part) for part in parts}))
    raise LicenceError(
        f"its licence, {licence or 'which is not said'!r}, is not among those that may be shipped"
    )


# ---- Whose a file is -----------------------------------------------------------------------------


def _output(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _names_of(path: Path) -> list[str]:
    """What dpkg may know a file by: /usr/lib and /lib are one folder on merged systems."""
    real = str(path.resolve())
    return list(dict.fromkeys([str(path), real, real.removeprefix("/usr")]))


class DebianPackages:
    """Which package a file of the system came with. dpkg is asked for many at once: it takes its time."""

    def __init__(self) -> None:
        self._package: dict[str, str] = {}  # by file name
        self._about: dict[str, tuple[str, str]] = {}  # source package and version, by package

    def learn(self, paths: Iterable[Path]) -> None:
        names = [name for path in paths for name in _names_of(path)]
        if not names or shutil.which("dpkg-query") is None:
            return
        # It fails when one of them is unknown, and answers for the others.
        found = subprocess.run(
            ["dpkg-query", "--search", *names], capture_output=True, text=True, check=False
        )
        for line in found.stdout.splitlines():
            package, _, name = line.partition(": ")
            self._package[name] = re.split("[:,]", package)[0]
        if not self._about:
            listing = "${Package} ${source:Package} ${Version}\n"
            for line in _output("dpkg-query", "--show", f"--showformat={listing}").splitlines():
                package, source, version = line.split()
                self._about[package] = (source, version)

    def owner(self, path: Path) -> tuple[str, str, str]:
        """Package, its source package, and version; empty: nobody's."""
        package = next((self._package[name] for name in _names_of(path) if name in self._package), "")
        return (package, *self._about[package]) if package else ("", "", "")


@functools.cache
def debian_stanzas(package: str) -> tuple[str, list[Stanza]]:
    text = Path(f"/usr/share/doc/{package}/copyright").read_text(encoding="utf-8")
    return text, read_copyright(text)


class Inventory:
    """The parts that are found, and what cannot be shipped."""

    def __init__(self, own: Iterable[Path], ceres: Iterable[Path] = ()) -> None:
        """`own`: truing's folders. `ceres`: those of Ceres, its source first."""
        self.own = [folder.resolve() for folder in own]
        self.ceres = [folder.resolve() for folder in ceres]
        self.parts: dict[str, Part] = {}
        self.system: dict[str, int] = {}
        self.problems: list[str] = []
        self._python = self._python_packages()
        self._debian = DebianPackages()

    @staticmethod
    def _python_packages() -> dict[Path, metadata.Distribution]:
        """Headers that came by pip: the folder of each package that has any."""
        found = {}
        for distribution in metadata.distributions():
            if distribution.metadata["Name"] == "pybind11":
                found[Path(str(distribution.locate_file("pybind11"))).resolve()] = distribution
        return found

    def add(self, *paths: Path) -> None:
        """Notes files that were compiled, linked or packed in."""
        found = {path.resolve() if path.exists() else path for path in paths}
        self._debian.learn(sorted(path for path in found if not self._is_own(path)))
        for path in sorted(found):
            try:
                self._add(path)
            except LicenceError as problem:
                self.problems.append(f"{path}: {problem}")

    def _is_own(self, path: Path) -> bool:
        return any(path.is_relative_to(folder) for folder in self.own)

    def _add(self, path: Path) -> None:
        if any(path.is_relative_to(folder) for folder in self.ceres):
            return self._add_ceres(path)
        if self._is_own(path):
            return None
        for folder, distribution in self._python.items():
            if path.is_relative_to(folder):
                return self._add_python(path, distribution)
        package, source, version = self._debian.owner(path)
        if not package:
            raise LicenceError("belongs to no package")
        family = re.sub(r"-?[\d.]+$", "", source)  # gcc of gcc-12
        if family in SYSTEM:
            self.system[family] = self.system.get(family, 0) + 1
            return None
        text, stanzas = debian_stanzas(package)
        # One notice for a source package, whichever of its packages a file came with.
        self._part(source, version, accepted(licence_of(str(path), stanzas)), text, path)
        return None

    def _add_ceres(self, path: Path) -> None:
        source = self.ceres[0]
        notice = (source / "debian" / "copyright").read_text(encoding="utf-8")
        numbers = re.findall(
            r"VERSION_(?:MAJOR|MINOR|REVISION) (\d+)",
            (source / "include" / "ceres" / "version.h").read_text(encoding="utf-8"),
        )
        licence = accepted(licence_of(str(path), read_copyright(notice)))
        self._part("ceres-solver", ".".join(numbers), licence, notice, path)

    def _add_python(self, path: Path, distribution: metadata.Distribution) -> None:
        about = distribution.metadata
        licence = about["License-Expression"] or about["License"] or ""
        licence = {"BSD": "BSD-3-Clause"}.get(licence, licence)
        texts = [file for file in distribution.files or [] if re.match(r"LICEN|COPYING", file.name)]
        notice = "\n".join(file.read_text() for file in texts)
        self._part(about["Name"], distribution.version, accepted(licence), notice, path)

    def add_script(self, licences: str) -> None:
        """Notes the packages that the script of the reports is made of."""
        found = SCRIPT_PART.findall(licences)
        if not found:
            self.problems.append(f"{SCRIPT_LICENCES}: names no package")
        for name, version, licence in found:
            try:
                self._part(name, version, accepted(licence), f"Its text: {SCRIPT_LICENCES}.", Path(SCRIPT))
            except LicenceError as problem:
                self.problems.append(f"{SCRIPT}: {name}: {problem}")

    def _part(self, name: str, version: str, licence: str, notice: str, path: Path) -> None:
        if not notice.strip():
            raise LicenceError("its licence text is missing")
        part = self.parts.setdefault(name, Part(name, version, notice=notice))
        part.licences.add(licence)
        part.files.add(str(path))


# ---- What went into the wheel --------------------------------------------------------------------


def linked_files(dependency_file: Path, build: Path) -> Iterator[Path]:
    """What the linker read, in the folder `build`."""
    text = dependency_file.read_text(encoding="utf-8").replace("\\\n", " ")
    rule = text.split("\n", 1)[0].partition(":")[2]
    for word in rule.split():
        yield Path(word) if Path(word).is_absolute() else build / word


def included_files(build: Path) -> Iterator[Path]:
    """What the compilers read."""
    for line in _output("ninja", "-C", str(build), "-t", "deps").splitlines():
        if line.startswith("    "):
            name = Path(line.strip())
            yield name if name.is_absolute() else build / name


def bundled_library(name: str) -> Path | None:
    """The system's library that auditwheel put into the wheel as `name`, with part of a hash in it."""
    wanted = re.sub(r"-[0-9a-f]{8}(?=\.so)", "", name)
    for line in _output("/sbin/ldconfig", "-p").splitlines():
        soname, _, text = line.strip().partition(" => ")
        path = Path(text)
        # It has the name of the library as programs ask for it, or that of the file behind it.
        if wanted == soname.split(" ")[0] or (text and wanted == path.resolve().name):
            return path
    return None


def inspect_wheel(tree: Path, inventory: Inventory) -> None:
    for path in sorted(tree.rglob("*")):
        if path.is_dir():
            continue
        name = path.relative_to(tree).as_posix()
        if name.startswith("truing.libs/"):
            library = bundled_library(path.name)
            if library is None:
                inventory.problems.append(f"{name}: no library of this system has that name")
            else:
                inventory.add(library)
        elif name == SCRIPT:
            inventory.add_script((tree / SCRIPT_LICENCES).read_text(encoding="utf-8"))
        elif not any(
            fnmatch.fnmatch(name, pattern) for pattern in ("truing/_core*.so", SCRIPT_LICENCES, *OWN_FILES)
        ):
            inventory.problems.append(f"{name}: nobody says under which licence it is (OWN_FILES)")


def notices(parts: list[Part]) -> str:
    rule = "=" * 100
    pages = ["This wheel contains, besides truing itself, the following.\n"]
    for part in parts:
        extra = f"\n{MPL_SOURCE}\n" if part.name.startswith("eigen") else ""
        pages.append(
            f"{rule}\n{part.name} {part.version}: {', '.join(sorted(part.licences))}\n{extra}\n{part.notice}"
        )
    return "\n".join(pages)


def complete(tree: Path, parts: list[Part]) -> None:
    """Writes the notices into the wheel, and what they are into its metadata (PEP 639)."""
    info = next(tree.glob("*.dist-info"))
    licences = {word for part in parts for name in part.licences for word in name.split(" AND ")}
    expression = " AND ".join(["BSD-3-Clause", *sorted(licences - {"BSD-3-Clause"})])
    (info / "licenses").mkdir(exist_ok=True)
    (info / "licenses" / "THIRD-PARTY.txt").write_text(notices(parts), encoding="utf-8")
    about = info / "METADATA"
    head, blank, body = about.read_text(encoding="utf-8").partition("\n\n")
    head = re.sub(r"^License-Expression: .*$", f"License-Expression: {expression}", head, flags=re.MULTILINE)
    about.write_text(f"{head}\nLicense-File: THIRD-PARTY.txt{blank}{body}", encoding="utf-8")


def report(inventory: Inventory) -> None:
    print(f"{'part':24s} {'version':28s} {'files':>6s}  licence")
    for part in sorted(inventory.parts.values(), key=lambda part: part.name):
        licences = ", ".join(sorted(part.licences))
        print(f"{part.name:24s} {part.version:28s} {len(part.files):6d}  {licences}")
    for name, count in sorted(inventory.system.items()):
        print(f"{name:24s} {'':28s} {count:6d}  not bound: {SYSTEM[name]}")


def main() -> int:
    parser = argparse.ArgumentParser(description="What a wheel is made of, under which licences.")
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="folder for the wheel with its notices")
    parser.add_argument("--linked", type=Path, required=True, help="what ld --dependency-file wrote")
    parser.add_argument("--built", type=Path, action="append", default=[], help="a build folder of Ninja")
    parser.add_argument(
        "--ceres", type=Path, action="append", default=[], help="Ceres: its source, then where it was built"
    )
    asked = parser.parse_args()
    own = [ROOT / "cpp", ROOT / "python", *asked.built]
    inventory = Inventory(own, asked.ceres)
    inventory.add(*linked_files(asked.linked, asked.built[0]))
    for build in asked.built:
        inventory.add(*included_files(build))
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "wheel", "unpack", "--dest", folder, asked.wheel],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        tree = next(Path(folder).iterdir())
        inspect_wheel(tree, inventory)
        report(inventory)
        if inventory.problems:
            print("\n".join(["licences: this wheel cannot be shipped:", *sorted(set(inventory.problems))]))
            return 1
        complete(tree, sorted(inventory.parts.values(), key=lambda part: part.name))
        asked.out.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            [sys.executable, "-m", "wheel", "pack", "--dest-dir", asked.out, tree],
            check=True,
            stdout=subprocess.DEVNULL,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
