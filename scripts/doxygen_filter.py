"""Makes Doxygen's documentation of the `//` comments that stand before or behind declarations.

`doxygen_filter.py FOLDER TARGET` writes the headers below FOLDER, with the same number of lines, to TARGET. Comments inside function bodies
stay comments. The first comment that no declaration follows directly describes the file. One process filters all headers: Doxygen would
start one for each header, which takes most of the time.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

COMMENT = re.compile(r"^(\s*)//(?!/) ?(.*)$")
BEHIND = re.compile(r"^(\s*[^/\s].*[;,}{]|\s*\w+)(\s+)// (.*)$")
MORE = re.compile(r"^\s{8,}// (.*)$")
LITERAL = re.compile(r"""R"\(.*?\)"|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])'""")
DECLARATIVE = re.compile(r"\b(namespace|class|struct|union|enum|extern)\b[^()]*$")
FOREIGN = re.compile(r"template <.*>\nstruct Eigen::.*?\n};", re.DOTALL)  # Doxygen misses the scope
SPECIAL = re.compile(r"([\\@#<>&%$\"|])")


def markup(text: str) -> str:
    """Returns a comment's text with Doxygen's special characters escaped and `code` marked."""
    parts = [SPECIAL.sub(r"\\\1", part) for part in text.split("`")]
    if len(parts) % 2:
        parts[1::2] = [f"<tt>{part}</tt>" for part in parts[1::2]]
    return "".join(parts)


class Braces:
    """Tells whether a line lies inside a function body, from the braces before it."""

    def __init__(self) -> None:
        self.kinds: list[bool] = []  # of each open brace: whether declarations follow
        self.text = ""  # since the last brace or semicolon

    def in_body(self) -> bool:
        return not all(self.kinds)

    def read(self, line: str) -> None:
        for c in re.sub(r"//.*", "", LITERAL.sub("0", line)):
            if c == "{":
                self.kinds.append(bool(DECLARATIVE.search(self.text)))
            elif c == "}" and self.kinds:
                self.kinds.pop()
            self.text = "" if c in "{};" else self.text + c
        self.text += " "


def described(lines: list[str], first: int) -> tuple[int, bool]:
    """Returns the end of a comment block and whether a declaration follows it directly."""
    end = first
    while end < len(lines) and COMMENT.match(lines[end]):
        end += 1
    follows = lines[end].strip() if end < len(lines) else ""
    return end, bool(follows) and not follows.startswith(("}", "#", "namespace", "public:", "private:", "protected:"))


def converted(lines: list[str]) -> list[str]:
    """Returns the lines of a header with documentation comments."""
    out, braces, file_is_described = [], Braces(), False
    i = 0
    while i < len(lines):
        line = lines[i]
        if braces.in_body():
            out.append(line)
        elif COMMENT.match(line):
            end, follows = described(lines, i)
            texts = [COMMENT.match(text) for text in lines[i:end]]
            if not follows and not file_is_described and out and not out[-1]:
                out[-1], file_is_described, follows = "/// \\file", True, True
            out += [f"{text[1]}/// {markup(text[2])}" for text in texts] if follows else lines[i:end]
            i = end
            continue
        else:
            behind = BEHIND.match(line)
            out.append(f"{behind[1]}{behind[2]}///< {markup(behind[3])}" if behind else line)
            braces.read(line)
            # further lines of the comment behind a declaration
            while behind and i + 1 < len(lines) and (more := MORE.match(lines[i + 1])):
                i += 1
                out.append(f"///< {markup(more[1])}")
            i += 1
            continue
        braces.read(line)
        i += 1
    return out


def main(folder: Path, target: Path) -> None:
    for header in sorted(folder.rglob("*.hpp")):
        text = FOREIGN.sub(lambda found: "\n" * found[0].count("\n"), header.read_text(encoding="utf-8"))
        copy = target / header.relative_to(folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text("".join(f"{line}\n" for line in converted(text.splitlines())), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
