"""Prose of the project: phrases that must not come back, in pages, model comments, help texts, messages and code comments."""

from __future__ import annotations

import io
import json
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# pattern -> what to write instead
FORBIDDEN = {
    # metaphors and figures of speech
    r"hangs? on nothing": "has no path to the root link",
    r"form a ring": "cyclic parent references",
    r"comes? to rest on what": "name the stable solution",
    r"what rings|\bringing\b|\brings (at|as|for)\b": "highly oscillatory, vibration",
    r"border of (its |their )?stability|at (its|the) border": "stability limit",
    r"(floats?|floating) free": "floating base",
    r"fall(s|en)? apart|come apart": "constraint violation",
    r"clock on the wall": "wall-clock time",
    r"computing time|\b(s|seconds|minutes|hours) of computing": "CPU time",
    r"does what a very fast one would": "acts as an impulsive drive",
    r"\bthe seed('s)?\b (paper|inverse|Fig)|\bthe seed's\b": "the ReDySim paper",
    r"rows that say nothing|say nothing new": "redundant constraints",
    r"\bsquare to\b": "perpendicular to",
    r"\bbeginnings?\b of a (multistep )?method|begin(s|ning)? anew": "restart",
    r"lives? on its history|state of life|whole lives": "state of the instance, instance lifetime",
    r"how it is cut": "communication step size",
    # loops
    r"what is open|is open by|leaves? [^.|]{0,40}\bopen by\b|\bmm open\b|remains? open|rad open|loop open": "constraint violation, residual",
    r"(nearest|a) closed (one|pose|point)|closed start pose|start pose closed|nearest closed": "configuration that satisfies the constraints",
    r"cannot close:": "no configuration satisfies the loop constraints",
    # degrees of freedom, motion, parameters
    r"\bfreedoms\b": "degrees of freedom (DOF)",
    r"counting freedoms|motions? (that|which) (is|are) wired": "degrees of freedom, prescribed motion",
    r"moved from outside": "prescribed motion",
    r"what may be turned": "tunable parameter",
    # accuracy and effort
    r"what accuracy costs": "work-precision diagram, accuracy report",
    r"no step is small enough": "minimum step size reached",
    r"\b(the|of) least and most\b|\bleast and greatest\b": "minimum and maximum",
    r"in the mean\b": "on average",
    # status and messages
    r"no finite time": "not finite",
    r"bytes are no saved|are no saved state": "invalid or truncated FMU state",
    r"is no parameter but|(?<!there\s)\bis no (list|number|name|file|record|variable|method|input|output|model|table)\b": "is not a ...",
    r", of them \d": "(n ...)",
    r"\bof them tunable\b": "(n tunable)",
    r"\bsays? how (they|it) went": "reports the results",
    r"\bsay(s)? which torques\b|tells? (the|which) torques": "inverse dynamics",
    r"a format of no kind": "unsupported file type",
    r"longest two in part": "partially",
    r"\bis tried under\b|\btried under\b": "tested under",
    r"depth of full stiffness": "penetration depth at which the stop reaches full stiffness",
    r"0 but for (numerical )?errors": "zero in exact arithmetic",
    r"gets? (a )?sentences?\b|with a sentence\b": "a message",
    r"\b(not|can) be had\b": "available",
    r"hard to break": "robust",
    # word order and negation
    r"lint sees to it|sees to it": "is checked by",
    r"\bfor ever\b": "forever, permanently",
    r"\bthere is no such (file|model|stage|variable|name|field|joint|link)\b": "not found",
    r"\bis not there\b|\bare not there\b": "not found, does not exist",
    r"\b(ms|seconds) an? (second|simulated|step)|\bµs a ms\b|\ba simulated second": "per",
    # module names
    r"\barrows? between rooms|\bthe rooms\b|\bother rooms\b|\bthis room\b|\ba room\b|\beach room\b": "module",
}
PATTERNS = [(re.compile(pattern.replace(" ", r"[\s#/*]+"), re.IGNORECASE), instead) for pattern, instead in FORBIDDEN.items()]

PROSE = [
    "build_fmu/show/*.html",
    "README.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "docs/**/*.md",
    "models/README.md",
    "tests/scenes/README.md",
    "Makefile",
    "mkdocs.yml",
]
COMMENTED = ["models/*.toml", "scripts/*.sh"]
PYTHON = [
    "build_fmu/**/*.py",
    "examples/**/*.py",
    "scripts/*.py",
    "bench/**/*.py",
    "docs/pictures/*.py",
    "models/*.py",
    "tests/**/*.py",
]
CPP = [
    "fmu_src/**/*.cpp",
    "fmu_src/**/*.hpp",
    "tests/**/*.cpp",
    "tests/**/*.hpp",
    "build_fmu/show/*.js",
    "bench/**/*.cpp",
    "bench/**/*.hpp",
]


def breaches(text: str) -> Iterator[tuple[int, str]]:
    """Yields line number and message of each forbidden phrase."""
    for pattern, instead in PATTERNS:
        for match in pattern.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            phrase = " ".join(match[0].split())
            yield line, f"'{phrase}': {instead}"


def files(patterns: list[str]) -> list[Path]:
    return sorted(path for pattern in patterns for path in ROOT.glob(pattern) if path.is_file())


def unreleased() -> str:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    return re.split(r"^## (?!Unreleased)", text, flags=re.MULTILINE)[0]


def comments(text: str) -> str:
    """The text with everything but comments blanked; lines keep their numbers."""
    return "\n".join(line[line.index("#") :] if "#" in line else "" for line in text.splitlines())


def python_prose(text: str) -> str:
    """Comments and strings of a Python file; all else is blanked, lines keep their numbers."""
    lines: list[list[str]] = [[] for _ in range(text.count("\n") + 2)]
    kinds = {tokenize.COMMENT, tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", -1)}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in kinds:
            for offset, part in enumerate(token.string.split("\n")):
                lines[token.start[0] - 1 + offset].append(part)
    return "\n".join(" ".join(line) for line in lines)


CPP_PROSE = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)


def cpp_prose(text: str) -> str:
    """Comments and string literals of a C++ file, adjacent literals joined; all else is blanked, lines keep their numbers."""
    found, end = [], 0
    for match in CPP_PROSE.finditer(text):
        gap = text[end : match.start()]
        found += ["\n" * gap.count("\n"), "; " if gap.strip() else " ", match[0]]
        end = match.end()
    return re.sub(r'"(\s*)"', r"\1", "".join(found))


def notebook_prose(text: str) -> str:
    return "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])


def sources() -> Iterator[tuple[str, str]]:
    """Yields name and prose of all files."""
    kinds = [(PROSE, str), (COMMENTED, comments), (PYTHON, python_prose), (CPP, cpp_prose), (["examples/*.ipynb"], notebook_prose)]
    for patterns, prose in kinds:
        for path in files(patterns):
            if path.name in ("CHANGELOG.md", Path(__file__).name):
                continue
            yield path.relative_to(ROOT).as_posix(), prose(path.read_text(encoding="utf-8"))
    yield "CHANGELOG.md", unreleased()


def test_no_forbidden_phrase():
    found = [f"{name}:{line}: {message}" for name, text in sources() for line, message in breaches(text)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("The tree has\nthree freedoms.", 2),
        ("it is 0 but\nfor numerical errors", 1),
        ("'x' is no parameter but a variable", 1),
        ("a block that floats\n# free", 1),
    ],
)
def test_a_planted_phrase_is_found(text, line):
    assert [number for number, _ in breaches(text)] == [line]


def test_prose_is_taken_from_comments_and_strings_only():
    assert [line for line, _ in breaches(python_prose('freedoms = 1\n"""Some\nfreedoms."""  # freedoms\n'))] == [3, 3]
    assert [line for line, _ in breaches(cpp_prose('int freedoms;\n// freedoms\nf("freedoms");\n/* a\nfreedoms */'))] == [2, 3, 5]
    assert [line for line, _ in breaches(cpp_prose('f("fall "\n  "apart", "fall", "apart");'))] == [1]
    assert [line for line, _ in breaches(comments("freedoms = 1\nx = 2  # freedoms\n"))] == [2]
