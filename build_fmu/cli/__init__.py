"""The command line `build-fmu`, one module per command. Errors are one sentence on stderr with exit code 1, of wrong arguments 2."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from build_fmu import __version__
from build_fmu.cli import build, check, completion, equilibrium, identify, import_model, linearise, modes, report, show, simulate, stress
from build_fmu.cli.parser import Parser
from build_fmu.cli.streams import emit, open_closed_streams, standard_streams
from build_fmu.cli.termination import cleaned_up_at_sigterm
from build_fmu.errors import InvalidArgument, UserError

COMMANDS = (build, import_model, check, simulate, linearise, modes, equilibrium, identify, report, stress, show, completion)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns the exit code."""
    open_closed_streams()
    parser = parser_of_commands()
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete

        argcomplete.autocomplete(parser)
    options, rest = parser.parse_known_args(arguments)
    if rest:
        options.parser.refuse(rest)
    try:
        with cleaned_up_at_sigterm(), standard_streams(options):
            code = options.run(options) or 0
        sys.stdout.flush()
        return code
    except InvalidArgument as error:
        return options.parser.complain(str(error))
    except UserError as error:
        print(error, file=sys.stderr)
        emit(options, {"errors": str(error).splitlines()})
        return 1
    except BrokenPipeError:
        # the reader of the output (head, less) has ended
        sys.stderr.close()
        return 1
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the rest of a full disk's buffer
        print(f"{error.filename or 'standard output'}: {error.strerror}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def parser_of_commands() -> Parser:
    """Returns the parser of all commands."""
    parser = Parser(
        prog="build-fmu",
        description="Builds FMUs (co-simulation and model exchange, FMI 2.0 or 3.0) from DH model files, and simulates and plots them.",
        epilog="For example: build-fmu import arm.urdf; build-fmu show arm.toml; build-fmu build arm.toml. "
        "build-fmu COMMAND --help lists the options. In place of a model file `-` is standard input, in place of an output file "
        "standard output.",
    )
    parser.add_argument("--version", action="version", version=f"build-fmu {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add(commands)
    for name, command in commands.choices.items():
        command.set_defaults(parser=command, command=name)
    return parser
