"""Completion scripts: read by the shells themselves where they are installed."""

import shutil
import subprocess

import pytest

from build_fmu.cli import _parser, main
from build_fmu.completion import SHELLS, commands_of


@pytest.mark.parametrize("shell", SHELLS)
def test_each_command_and_option_is_in_the_script(shell, capsys):
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    for command in commands_of(_parser()):
        assert command.name in text
        for option in command.options:
            assert (f"-l {option[2:]}" if shell == "fish" and option.startswith("--") else option if shell != "fish" else option[1:]) in text
    assert "modified standard" in text  # the words of import --dh


@pytest.mark.parametrize("shell", SHELLS)
def test_the_shell_reads_it(shell, capsys):
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    main(["completion", shell])
    done = subprocess.run([shell, "-n"], input=capsys.readouterr().out, text=True, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def completed(words, capsys):
    main(["completion", "bash"])
    listed = " ".join(f"'{word}'" for word in words)
    text = f'{capsys.readouterr().out}\nCOMP_WORDS=({listed})\nCOMP_CWORD={len(words) - 1}\n_build_fmu\nprintf "%s\\n" "${{COMPREPLY[@]}}"\n'
    return subprocess.run(["bash", "--norc"], input=text, text=True, capture_output=True, check=True).stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes(capsys):
    assert completed(["build-fmu", "si"], capsys) == ["simulate"]
    assert completed(["build-fmu", "simulate", "--red"], capsys) == ["--redysim-layout"]
    assert completed(["build-fmu", "import", "--dh", "s"], capsys) == ["standard"]
    assert completed(["build-fmu", "completion", ""], capsys)[-3:] == list(SHELLS)
