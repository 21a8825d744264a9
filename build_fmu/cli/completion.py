"""`build-fmu completion`: prints the shell code with which argcomplete completes commands, options and their values."""

from __future__ import annotations

import argparse

SHELLS = ("bash", "zsh", "fish")


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "completion",
        help="print the shell code that completes commands and options",
        description='Print the shell code; for bash, add this line to ~/.bashrc: eval "$(build-fmu completion bash)"',
    )
    command.add_argument("shell", choices=SHELLS)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the shell code."""
    import argcomplete

    print(argcomplete.shellcode(["build-fmu"], shell=options.shell))
    return 0
