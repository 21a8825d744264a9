"""Hook of mkdocs: replaces links to files outside docs/, which the site does not contain, by file names; prevents breaks in numbers.

The page contributing.md shows the file CONTRIBUTING.md.
"""

import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# a browser may break 1e-06 after its sign
NUMBER = re.compile(r"(?<=\de)-(?=\d)")
FROM_ROOT = re.compile(r"\]\((?!https?:|#)")
LINK = re.compile(r"\[([^\]]+)\]\(((?:\.\./)+)([^)#]+)(#[^)]*)?\)")


def on_page_markdown(markdown: str, page, **_) -> str:
    """Returns the text of the page; a link to a missing file outside docs/ is an error."""
    folder = (ROOT / "docs" / page.file.src_uri).parent
    if page.file.src_uri == "contributing.md":
        markdown = FROM_ROOT.sub("](../", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))

    def named(link: re.Match) -> str:
        target = (folder / (link[2] + link[3])).resolve()
        if target == ROOT / "CONTRIBUTING.md":
            return f"[{link[1]}](contributing.md)"
        if target.is_relative_to(ROOT / "docs"):
            return f"[{link[1]}]({os.path.relpath(target, folder)}{link[4] or ''})"
        if not target.exists():
            raise FileNotFoundError(f"docs/{page.file.src_uri} links to {link[2]}{link[3]}, which does not exist")
        name = target.relative_to(ROOT).as_posix()
        return f"`{name}`" if link[1].strip("`") in (name, Path(name).name) else f"{link[1]} (`{name}`)"

    lines = (NUMBER.sub("-\u2060", line) if line.startswith("|") else line for line in LINK.sub(named, markdown).splitlines())
    return "\n".join(lines)
