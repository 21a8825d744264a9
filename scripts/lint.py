"""The project's own rules: include and import directions, sizes of files and functions, Python syntax, no machine paths.

`lint.py [FOLDER]` checks the tree (default: this one), prints `file:line: message` for each violation and exits with 1.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import lizard

# modules in the order of dependencies; a module may include itself and the modules before it
ROOMS = ("math", "model", "dynamics", "integrate", "fmi")
# parts of a module in the same order: folders ("" has the module's plain files) or single files; parts of one level may
# include each other
LEVELS = {
    "model": (("",), ("read",)),
    "dynamics": (("", "contact", "loops"), ("assembly",), ("straight_line",)),
    "integrate": (("control",), ("system", "actuator"), ("methods",)),
    "fmi": (
        ("platform",),
        ("boundary",),
        ("instance", "variables"),
        ("describe", "boundary/guarded.hpp", "boundary/guarded.cpp", "boundary/fmi2.cpp", "boundary/fmi3.cpp"),
    ),
}
# headers of libraries: (pattern of the header, modules that may include it, name)
FOREIGN = (
    (re.compile(r"^(Eigen|unsupported/Eigen)/"), ("math", "model", "dynamics"), "Eigen"),
    (re.compile(r"^(toml\+\+/|toml\.hpp)"), ("model",), "toml++"),
    (re.compile(r"^(sundials|arkode|cvode|cvodes|nvector|sunmatrix|sunlinsol|sunnonlinsol|ida|kinsol)/"), ("integrate",), "SUNDIALS"),
    (re.compile(r"^fmi[23]"), ("fmi",), "the FMI headers"),
)
# folders of build_fmu in the order of the imports, as above; its plain modules (errors, files, native) come before all of them
PACKAGES = ("model", "run", "draw", "importers", "report", "stress", "show", "fmu", "identify", "library", "cli")
LONGEST = 600  # lines of a file
LONGEST_FUNCTION = 60  # lines
MOST_COMPLEX = 15  # McCabe's cyclomatic complexity of a C++ function, as lizard counts; ruff counts in Python
SIZED = ("fmu_src", "build_fmu", "tests", "bench", "scripts")
CODE = (".hpp", ".cpp", ".h", ".py")
TEXT = (*CODE, ".sh", ".toml", ".md", ".json", ".txt", ".yml", ".cmake")
# folders of one machine; no path in a clone starts like this
MACHINE_PATH = re.compile(r"(?<![\w.$}~])/(home/\w|Users/\w|root/|work/|tmp/\w)")
SKIPPED = {".git", ".venv", ".sundials", "build", "out", "__pycache__", ".pytest_cache", ".hypothesis"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def breaches(root: Path) -> Iterator[str]:
    """Yields one line `file:line: message` for each violation, in the order of the files."""
    for path in files(root):
        name = path.relative_to(root).as_posix()
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:
            yield f"{name}:1: not a UTF-8 text"
            continue
        if path.suffix in CODE and name.split("/")[0] in SIZED and len(lines) > LONGEST:
            yield f"{name}:{len(lines)}: more than {LONGEST} lines; split the file by subject"
        for number, line in enumerate(lines, start=1):
            for sentence in [*arrow(name, line), *inner_arrow(name, line), *machine_path(line)]:
                yield f"{name}:{number}: {sentence}"
        if path.suffix == ".py":
            yield from python(path, name)
        if path.suffix in (".hpp", ".cpp"):
            yield from cpp_functions(path, name)
            yield from unit(root, name)
    yield from import_breaches(root)


def files(root: Path) -> list[Path]:
    """Returns the text files of the tree, sorted, without build results."""
    found = []
    for path in root.rglob("*"):
        parts = path.relative_to(root).parts
        if path.is_file() and not SKIPPED.intersection(parts) and (path.suffix in TEXT or path.name == "Makefile"):
            found.append(path)
    return sorted(found)


def arrow(name: str, line: str) -> Iterator[str]:
    """Yields a message if an include line of a file in fmu_src violates the table of modules."""
    parts = name.split("/")
    include = INCLUDE.match(line)
    if parts[0] != "fmu_src" or len(parts) < 3 or not include or parts[1] not in ROOMS:
        return
    room, header = parts[1], include[2]
    # "../fmi/boundary/log.hpp" is the same dependency as "fmi/boundary/log.hpp"
    target = next((part for part in header.split("/")[:-1] if part in ROOMS), None)
    if include[1] == '"' and target and ROOMS.index(target) > ROOMS.index(room):
        yield f"{room} may not include {target} ('{header}'): the arrows go {' → '.join(ROOMS)}"
    for pattern, rooms, what in FOREIGN:
        if pattern.match(header) and room not in rooms:
            yield f"{room} may not include {what} ('{header}'), only {', '.join(rooms)} may"


def inner_arrow(name: str, line: str) -> Iterator[str]:
    """Yields a message if an include line of a file in fmu_src violates the order of the parts of its module."""
    include = INCLUDE.match(line)
    if not name.startswith("fmu_src/") or not include or include[1] != '"':
        return
    source, header = name.removeprefix("fmu_src/"), include[2]
    room = source.split("/")[0]
    if room not in LEVELS or not header.startswith(f"{room}/"):
        return
    levels = {path: level(room, path) for path in (source, header)}
    for path, found in levels.items():
        if found is None:
            yield f"'{path}' has no level: add its folder to LEVELS in scripts/lint.py"
            return
    if levels[header] > levels[source]:
        order = " → ".join(", ".join(part or "plain files" for part in parts) for parts in LEVELS[room])
        yield f"{source} may not include '{header}': in {room} the arrows go {order}"


def level(room: str, path: str) -> int | None:
    """Returns the level of a file of a module; a file's own entry precedes that of its folder."""
    inner = path.removeprefix(f"{room}/")
    folder = inner.split("/")[0] if "/" in inner else ""
    numbers = {part: number for number, parts in enumerate(LEVELS[room]) for part in parts}
    return numbers.get(inner, numbers.get(folder))


def machine_path(line: str) -> Iterator[str]:
    """Yields a message if the line contains a path of one machine."""
    found = MACHINE_PATH.search(line)
    if found:
        yield f"'{line[found.start() : found.end() + 12].strip()}' is a path of one machine"


def python(path: Path, name: str) -> Iterator[str]:
    """Yields the syntax error of a Python file, if any, and its long functions."""
    try:
        tree = ast.parse(path.read_bytes(), name)
        compile(tree, name, "exec")
    except (SyntaxError, ValueError) as error:
        yield f"{name}:{getattr(error, 'lineno', None) or 1}: {getattr(error, 'msg', error)}"
        return
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            lines = node.end_lineno - node.lineno + 1
            if lines > LONGEST_FUNCTION:
                yield f"{name}:{node.lineno}: function '{node.name}' has {lines} lines, more than {LONGEST_FUNCTION}; split it"


def cpp_functions(path: Path, name: str) -> Iterator[str]:
    """Yields the long and the complex functions of a C++ file."""
    for function in lizard.analyze_file(str(path)).function_list:
        lines, paths = function.end_line - function.start_line + 1, function.cyclomatic_complexity
        if lines <= LONGEST_FUNCTION and paths <= MOST_COMPLEX:
            continue
        yield (
            f"{name}:{function.start_line}: function '{function.name}' has {lines} lines and cyclomatic complexity {paths}, "
            f"more than {LONGEST_FUNCTION} or {MOST_COMPLEX}; split it"
        )


def unit(root: Path, name: str) -> Iterator[str]:
    """Yields a unit test whose folder has no counterpart in fmu_src."""
    parts = name.split("/")
    if parts[:2] == ["tests", "unit"] and not (root / "fmu_src").joinpath(*parts[2:-1]).is_dir():
        yield f"{name}:1: tests/unit mirrors fmu_src, which has no folder '{'/'.join(parts[2:-1])}'"


def import_breaches(root: Path) -> Iterator[str]:
    """Yields imports of build_fmu against the order of its folders, and one import of each cycle of modules."""
    paths = {module_name(path.relative_to(root)): path for path in sorted((root / "build_fmu").rglob("*.py"))}
    graph = {name: imports(path, set(paths)) for name, path in paths.items()}
    for name, targets in graph.items():
        where = paths[name].relative_to(root).as_posix()
        for target, line in targets.items():
            if rank(target) > rank(name):
                yield f"{where}:{line}: {name} may not import {target}: the imports go errors, files, native → {' → '.join(PACKAGES)}"
    for cycle in cycles(graph):
        where = paths[cycle[0]].relative_to(root).as_posix()
        yield f"{where}:{graph[cycle[0]][cycle[1]]}: cyclic import: {' → '.join(cycle)}"


def module_name(path: Path) -> str:
    """Returns the dotted name of a module's file."""
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def imports(path: Path, known: set[str]) -> dict[str, int]:
    """Returns the modules among `known` that a file imports anywhere, with the line of the first import of each."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return {}  # `python` reports it
    found: dict[str, int] = {}
    for node in ast.walk(tree):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            parts = [f"{node.module}.{alias.name}" for alias in node.names]
            names = [part if part in known else node.module for part in parts]
        for name in names:
            if name in known:
                found.setdefault(name, node.lineno)
    return found


def rank(module: str) -> int:
    """Returns the place of a module in the order; build_fmu itself (version, public names) is first, `__main__` last."""
    part = (module.split(".") + [""])[1]
    return PACKAGES.index(part) if part in PACKAGES else len(PACKAGES) if part == "__main__" else -1


def cycles(graph: dict[str, dict[str, int]]) -> Iterator[list[str]]:
    """Yields a cycle for each import that leads back into the path by which it was found, depth first."""
    done: set[str] = set()

    def visit(name: str, path: list[str]) -> Iterator[list[str]]:
        if name in path:
            yield [*path[path.index(name) :], name]
        elif name not in done:
            for target in graph[name]:
                yield from visit(target, [*path, name])
            done.add(name)

    for name in graph:
        yield from visit(name, [])


def main() -> int:
    """Checks the tree and returns the exit code."""
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent
    found = list(breaches(root))
    for line in found:
        print(line)
    print(f"{len(files(root))} files, {len(found)} breaches")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
