# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The pages of the documentation site that nobody writes; MkDocs calls the functions `on_...` (mkdocs.yml).

- A page for every room of the Python package, with what its `__init__` offers; mkdocstrings writes them out.
- A page for every public C++ header: its comments as text, its declarations as code.
- A page for every file outside of docs/ that a page of docs/ links to, so that links work without a network.
"""

from __future__ import annotations

import ast
import fnmatch
import posixpath
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "python" / "truing"
HEADERS = ROOT / "cpp" / "include" / "truing"
SOURCES = "source"  # folder of the pages that show files

LINK = re.compile(r"(?P<open>\]\()(?P<target>[^()\s#]+)(?P<anchor>#[^()\s]*)?(?P<close>\))")
LANGUAGES = {".cpp": "cpp", ".hpp": "cpp", ".py": "python", ".sh": "sh", ".yaml": "yaml", ".json": "json"}
NO_SEARCH = "---\nsearch:\n  exclude: true\n---\n\n"


# ---- Python --------------------------------------------------------------------------------------


def offered(module: Path) -> list[str]:
    """The names that a module imports in order to offer them: `from ... import name as name`."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    return [
        alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    ]


def rooms() -> list[str]:
    """The rooms of the package that users see, as `truing.public` lists them."""
    names = offered(PACKAGE / "public.py")
    return [name for name in names if (PACKAGE / name).is_dir() or (PACKAGE / f"{name}.py").exists()]


def python_pages() -> dict[str, str]:
    pages = {}
    own = [name for name in offered(PACKAGE / "public.py") if name not in rooms()]
    pages["python/truing.md"] = _python_page(
        "truing", ast_docstring(PACKAGE / "__init__.py"), "truing.public", own
    )
    for room in rooms():
        module = PACKAGE / room / "__init__.py" if (PACKAGE / room).is_dir() else PACKAGE / f"{room}.py"
        names = [name for name in offered(module) if name[0] != "_"]
        if not names:
            continue
        pages[f"python/{room}.md"] = _python_page(
            f"truing.{room}", ast_docstring(module), f"truing.{room}", names
        )
    return pages


def ast_docstring(module: Path) -> str:
    return ast.get_docstring(ast.parse(module.read_text(encoding="utf-8"))) or ""


def _python_page(title: str, summary: str, module: str, names: list[str]) -> str:
    functions_first = sorted(names, key=lambda name: (name[0].isupper(), name.lower()))
    blocks = "\n".join(f"::: {module}.{name}\n" for name in functions_first)
    return f"# {title}\n\n{summary}\n\n{blocks}"


# ---- C++ -----------------------------------------------------------------------------------------


@dataclass
class Declaration:
    """A declaration with the `///` comment before it; `code` is empty for a comment by itself."""

    comment: str
    code: str

    @property
    def name(self) -> str:
        """Of a type, a function or a constant."""
        code = re.sub(r"//.*", "", self.code)
        code = re.sub(r"template\s*<[^>]*>\s*", "", code).strip()
        kind = re.match(r"(?:enum\s+class|struct|class)\s+(\w+)", code) or re.match(
            r"using\s+(\w+)\s*=", code
        )
        kind = kind or re.search(r"([\w~]+)\s*\(", code) or re.search(r"(\w+)\s*(?:=|{|;)", code)
        return kind.group(1) if kind else ""


def declarations(text: str) -> Iterator[Declaration]:
    """What the namespaces of a header declare, in order."""
    comment: list[str] = []
    code: list[str] = []
    depth = 0
    for line in text.splitlines():
        bare = line.strip()
        if not code and (not bare or bare.startswith(("#", "// SPDX", "namespace ", "}"))):
            if comment and not bare:
                yield Declaration("\n".join(comment), "")
                comment = []
            continue
        if not code and bare.startswith("//"):
            comment.append(re.sub(r"^///?<? ?", "", bare))
            continue
        code.append(line)
        plain = re.sub(r"//.*|\"[^\"]*\"", "", line)
        depth += sum(plain.count(c) for c in "({") - sum(plain.count(c) for c in ")}")
        if depth == 0 and re.search(r"[;}]\s*$", plain):
            yield Declaration("\n".join(comment), "\n".join(code))
            comment, code = [], []
    if code:
        raise ValueError(f"a declaration that does not end: {code[0]}")


def header_page(name: str, text: str) -> str:
    parts = [f"# {name}\n", f"```cpp\n#include <truing/{name}>\n```\n"]
    seen = ""
    for found in declarations(text):
        if found.code and found.name and found.name != seen:  # overloads share a heading
            parts.append(f"## {found.name}\n")
            seen = found.name
        if found.comment:
            parts.append(f"{as_markdown(found.comment)}\n")
        if found.code:
            public = re.sub(r"\n *private:.*(?=\n};)", "", found.code, flags=re.DOTALL)
            parts.append(f"```cpp\n{public}\n```\n")
    return "\n".join(parts)


def as_markdown(comment: str) -> str:
    """A comment's paths of documents as links, its angle brackets as text."""
    comment = re.sub(r"<(?=[\w:])", r"\\<", comment)
    return re.sub(r"\bdocs/([\w/-]+\.md)\b", lambda m: f"[{m[1]}]({DOCS}/{m[1]})", comment)


DOCS = "DOCS"  # replaced where a page is written, by the way from it to docs/


def cpp_pages() -> dict[str, str]:
    pages = {}
    for path in sorted(HEADERS.rglob("*.hpp")):
        name = path.relative_to(HEADERS).as_posix()
        if name == "truing.hpp":
            continue
        page = f"cpp/{name.removesuffix('.hpp')}.md"
        up = posixpath.relpath(".", posixpath.dirname(page))
        pages[page] = header_page(name, path.read_text(encoding="utf-8")).replace(f"({DOCS}/", f"({up}/")
    return pages


# ---- Files outside of docs/ ----------------------------------------------------------------------


def led_to(page: str, target: str) -> Path | None:
    """The file or folder of the repository, from its root, that a link leads to; None: elsewhere."""
    if re.match(r"[a-zA-Z][\w+.-]*:|/", target):
        return None
    # A page that shows a file has the links of that file.
    own = page.removeprefix(f"{SOURCES}/") if page.startswith(f"{SOURCES}/") else f"docs/{page}"
    path = Path(posixpath.normpath(posixpath.join(posixpath.dirname(own), target)))
    return path if path.parts[0] != ".." and (ROOT / path).exists() else None


def page_of(path: Path) -> str:
    if path.parts[0] == "docs":
        return path.relative_to("docs").as_posix()
    if path.is_relative_to(HEADERS.relative_to(ROOT)):
        return f"cpp/{path.relative_to(HEADERS.relative_to(ROOT)).with_suffix('.md').as_posix()}"
    return f"{SOURCES}/{path.as_posix()}" + ("" if path.suffix == ".md" else ".md")


def source_page(path: Path) -> str:
    full = ROOT / path
    if full.is_dir():
        listing = "\n".join(f"- `{entry.name}`" for entry in sorted(full.iterdir()))
        return f"{NO_SEARCH}# {path}\n\n{listing}\n"
    text = full.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return f"{NO_SEARCH}{text}"
    return f"{NO_SEARCH}# {path.name}\n\n`{path}`\n\n````{LANGUAGES.get(path.suffix, 'text')}\n{text}\n````\n"


def linked_sources(files: Files) -> set[Path]:
    found = set()
    for file in files.documentation_pages():
        for link in LINK.finditer(file.content_string):
            path = led_to(file.src_uri, link["target"])
            if path is not None and path.parts[0] != "docs":
                found.add(path)
    return found


# ---- What MkDocs calls ---------------------------------------------------------------------------


def on_files(files: Files, config: MkDocsConfig) -> Files:
    pages = python_pages() | cpp_pages()
    pages |= {
        page_of(path): source_page(path) for path in linked_sources(files) if page_of(path) not in pages
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    config.nav = _expanded(config.nav, [file.src_uri for file in files.documentation_pages()])
    return files


def _expanded(nav: Any, pages: list[str]) -> Any:
    """The navigation with the pages of every folder and pattern that it names; of a pattern first."""
    named = set(_leaves(nav))
    patterns = [leaf for leaf in named if "*" in leaf]
    matched = {page for page in pages if any(fnmatch.fnmatch(page, pattern) for pattern in patterns)}

    def expand(entry: Any) -> Any:
        if isinstance(entry, dict):
            return [{title: _as_list(expand(inside)) for title, inside in entry.items()}]
        if isinstance(entry, list):
            return [one for inside in entry for one in _as_list(expand(inside))]
        if "*" in entry:
            return sorted(page for page in matched if fnmatch.fnmatch(page, entry) and page not in named)
        if entry.endswith("/"):
            return sorted(page for page in pages if page.startswith(entry) and page not in named | matched)
        return entry

    return expand(nav)


def _as_list(entry: Any) -> list[Any]:
    return entry if isinstance(entry, list) else [entry]


def _leaves(nav: Any) -> Iterator[str]:
    if isinstance(nav, str):
        yield nav
    else:
        for inside in nav.values() if isinstance(nav, dict) else nav:
            yield from _leaves(inside)


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links that lead out of docs/, to the pages made of what they lead to."""
    here = page.file.src_uri

    def rewritten(link: re.Match[str]) -> str:
        path = led_to(here, link["target"])
        if path is None or (path.parts[0] == "docs" and not here.startswith(f"{SOURCES}/")):
            return link[0]
        if files.get_file_from_path(page_of(path)) is None:
            return "]"  # a link of a file that is shown only because another page links to it
        target = posixpath.relpath(page_of(path), posixpath.dirname(here))
        return f"{link['open']}{target}{link['anchor'] or ''}{link['close']}"

    return LINK.sub(rewritten, markdown)
