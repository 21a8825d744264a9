"""`build-fmu completion SHELL`: prints a completion script made from the command line itself, so that it cannot fall behind."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field

SHELLS = ("bash", "zsh", "fish")


@dataclass
class Command:
    """What can follow a command's name."""

    name: str
    help: str
    options: dict[str, str] = field(default_factory=dict)  # option -> help
    choices: dict[str, list[str]] = field(default_factory=dict)  # option -> its words
    words: list[str] = field(default_factory=list)  # words of the argument without a name


def script(shell: str, parser: argparse.ArgumentParser) -> str:
    """Returns the script that the shell reads."""
    return {"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](commands_of(parser))


def commands_of(parser: argparse.ArgumentParser) -> list[Command]:
    """Returns the commands of the parser with their options."""
    group = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    helps = {choice.dest: choice.help or "" for choice in group._choices_actions}
    return [_command(name, helps.get(name, ""), inner) for name, inner in group.choices.items()]


def _command(name: str, text: str, parser: argparse.ArgumentParser) -> Command:
    command = Command(name, text)
    for action in parser._actions:
        words = [str(word) for word in action.choices or ()]
        if not action.option_strings:
            command.words += words
        for option in action.option_strings:
            command.options[option] = (action.help or "").split(";")[0]
            if words:
                command.choices[option] = words
    return command


def _bash(commands: list[Command]) -> str:
    cases = []
    for command in commands:
        choices = "".join(f"        {option}) words='{' '.join(words)}' ;;\n" for option, words in command.choices.items())
        inner = f'      case "$before" in\n{choices}      esac\n' if choices else ""
        cases.append(f"    {command.name})\n      words='{' '.join([*command.options, *command.words])}'\n{inner}      ;;\n")
    return f"""# completion of build-fmu for bash: eval "$(build-fmu completion bash)"
_build_fmu() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" words
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{" ".join(command.name for command in commands)} --help --version' -- "$word"))
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{"".join(cases)}  esac
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _build_fmu build-fmu
"""


def _zsh(commands: list[Command]) -> str:
    names = "\n".join(f"    {_quoted(f'{command.name}:{command.help}')}" for command in commands)
    cases = []
    for command in commands:
        rows = [f"{option}[{_flat(text)}]" + (f": :({' '.join(command.choices[option])})" if option in command.choices else "")
                for option, text in command.options.items()]
        rest = f"*: :({' '.join(command.words)})" if command.words else "*: :_files"
        cases.append(f"    {command.name}) _arguments {' '.join(_quoted(row) for row in [*rows, rest])} ;;")
    listed = "\n".join(cases)
    return f"""#compdef build-fmu
# completion of build-fmu for zsh: eval "$(build-fmu completion zsh)", after compinit
_build_fmu() {{
  local -a commands=(
{names}
  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  local name=$words[2]
  shift words
  (( CURRENT-- ))
  case $name in
{listed}
  esac
}}
compdef _build_fmu build-fmu
"""


def _fish(commands: list[Command]) -> str:
    lines = ["# completion of build-fmu for fish: build-fmu completion fish | source"]
    for command in commands:
        lines.append(f"complete -c build-fmu -n __fish_use_subcommand -f -a {command.name} -d {_quoted(command.help)}")
        seen = f"-n '__fish_seen_subcommand_from {command.name}'"
        for option, text in command.options.items():
            flag = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
            words = f" -x -a {_quoted(' '.join(command.choices[option]))}" if option in command.choices else ""
            lines.append(f"complete -c build-fmu {seen} {flag}{words} -d {_quoted(_flat(text))}")
        if command.words:
            lines.append(f"complete -c build-fmu {seen} -f -a {_quoted(' '.join(command.words))}")
    return "\n".join(lines) + "\n"


def _flat(text: str) -> str:
    return text.replace("[", "(").replace("]", ")").replace(":", " ")


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"
