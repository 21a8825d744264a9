"""A model file without optional outputs."""

from __future__ import annotations

import re
from pathlib import Path


def bare(model: Path, folder: Path, outputs: tuple[str, ...] = (), method: str = "") -> Path:
    """Writes a copy of the model with positions, velocities and these output groups only, without reference and tunable parameters.

    `method`: in place of that of the model.
    """
    text = model.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^\[report\]\n(?:(?!\[).*\n)*", "", text)
    text = re.sub(r"(?m)^outputs = .*\n", "", text)
    text = re.sub(r"(?ms)^tunable = \[.*?\]$\n", "", text)
    line = f"outputs = [{', '.join(repr(name).replace(chr(39), chr(34)) for name in outputs)}]"
    text = re.sub(r"(?m)^\[fmu\]$", f"[fmu]\n{line}", text) if re.search(r"(?m)^\[fmu\]$", text) else f"{text}\n[fmu]\n{line}\n"
    if method:
        text = re.sub(r"(?m)^method = .*\n", "", text)
        line = f'[solver]\nmethod = "{method}"'
        text = text.replace("[solver]", line) if "[solver]" in text else f"{text}\n{line}\n"
    file = folder / model.name
    file.write_text(text, encoding="utf-8")
    return file
