"""The licence files of an FMU: the full licence of the library, and a list of third-party parts."""

from __future__ import annotations

from collections.abc import Iterable

from build_fmu import native

# name, licence, copyright holder, use in the library, address of source and terms
THIRD_PARTY = (
    ("SUNDIALS", "BSD-3-Clause", "Lawrence Livermore National Security and Southern Methodist University, 2002-2022",
     "time integration (ARKODE, CVODE), linked into the shared library", "https://github.com/LLNL/sundials"),
    ("Eigen", "MPL-2.0", "Benoit Jacob, Gael Guennebaud and others, 2006-2021",
     "small vectors and matrices, compiled in from unmodified headers", "https://gitlab.com/libeigen/eigen"),
    ("toml++", "MIT", "Mark Gillard and others, 2019-2022",
     "reads the model file, compiled in from unmodified headers", "https://github.com/marzer/tomlplusplus"),
    ("libstdc++ and libgcc", "GPL-3.0-or-later with GCC-exception-3.1", "Free Software Foundation",
     "C++ run time, linked into the shared library", "https://gcc.gnu.org/git/gcc.git"),
    ("FMI 2.0 and 3.0 C headers", "BSD-2-Clause", "MODELISAR consortium and Modelica Association Project FMI, 2008-2023",
     "declarations of the interface", "https://github.com/modelica/fmi-standard"),
)  # fmt: skip
LIBCXX = (
    "libc++ and libc++abi",
    "Apache-2.0 WITH LLVM-exception",
    "LLVM project contributors",
    "C++ run time, linked into the library for macOS",
    "https://github.com/llvm/llvm-project",
)


def licence_files(platforms: Iterable[str] = ("linux64",)) -> dict[str, bytes]:
    """Returns the files of documentation/licenses: the licences of the library and of its parts."""
    parts = native.licences_of_parts(platforms)
    return {"license.txt": _overview(list(parts))} | {f"{name}.txt": text.encode() for name, text in parts.items()}


def _overview(parts: list[str]) -> bytes:
    lines = [
        native.licence_text().rstrip(),
        "",
        "-" * 78,
        "",
        "The licence above covers the simulation library in this FMU. The model in resources/model.toml",
        "belongs to its author. The library also contains parts of these projects:",
        "",
    ]
    for name, licence, holder, use, address in (*THIRD_PARTY, *([LIBCXX] if "libcxx" in parts else [])):
        lines += [
            f"  {name}",
            f"    licence    {licence}",
            f"    copyright  {holder}",
            f"    use        {use}",
            f"    source     {address}",
            "",
        ]
    if parts:
        lines.append(f"Their full terms are in this folder: {', '.join(f'{name}.txt' for name in parts)}.")
    return "\n".join(lines).encode()
