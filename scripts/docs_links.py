"""Hook of mkdocs: a link to a file of the tree outside docs/ becomes the file's name, for a site holds no such file; numbers stay whole."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# a browser breaks 1e-06 after its sign
NUMBER = re.compile(r"(?<=\de)-(?=\d)")
LINK = re.compile(r"\[([^\]]+)\]\(((?:\.\./)+)([^)#]+)(#[^)]*)?\)")


def on_page_markdown(markdown: str, page, **_) -> str:
    """Returns the page's text; a link out of docs/ to a file that is not there is an error."""
    folder = (ROOT / "docs" / page.file.src_uri).parent

    def named(link: re.Match) -> str:
        target = (folder / (link[2] + link[3])).resolve()
        if target.is_relative_to(ROOT / "docs"):
            return link[0]
        if not target.exists():
            raise FileNotFoundError(f"docs/{page.file.src_uri} links to {link[2]}{link[3]}, and there is no such file")
        name = target.relative_to(ROOT).as_posix()
        return f"`{name}`" if link[1].strip("`") in (name, Path(name).name) else f"{link[1]} (`{name}`)"

    lines = (NUMBER.sub("-\u2060", line) if line.startswith("|") else line for line in LINK.sub(named, markdown).splitlines())
    return "\n".join(lines)
