"""Each command loads what it needs, and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import typer

import quasiomni


def test_every_command_is_listed_at_the_module_that_adds_it() -> None:
    app = quasiomni.app
    added: dict[str, set[str]] = {}
    for command in app.registered_commands:
        assert command.callback is not None
        added.setdefault(command.callback.__module__, set()).add(command.name or command.callback.__name__)
    for group in app.registered_groups:
        assert group.typer_instance is not None
        callback = group.typer_instance.registered_commands[0].callback
        assert callback is not None
        added.setdefault(callback.__module__, set()).add(str(group.name))
    listed = {f"quasiomni.{module}": set(commands) for module, commands in quasiomni.COMMANDS.items()}
    assert added == listed


def test_every_command_is_listed_with_the_first_line_of_its_help() -> None:
    loaded = typer.main.get_group(quasiomni.app).commands
    first_lines = {name: (command.help or "").split("\n\n")[0].replace("\n", " ") for name, command in loaded.items()}
    listed = {name: summary for commands in quasiomni.COMMANDS.values() for name, summary in commands.items()}
    assert first_lines == listed


def test_every_module_of_the_command_line_is_listed() -> None:
    modules = {path.stem for path in Path(quasiomni.__file__).parent.glob("*.py")}
    shared = {
        "__init__",
        "__main__",
        "application",
        "behind_the_bus",
        "filming",
        "interface",
        "interrupts",
        "options",
        "paging",
        "real_time",
        "scenarios",
        "showing",
    }
    assert modules - shared == set(quasiomni.COMMANDS)


@pytest.mark.parametrize(
    ("words", "unneeded"),
    [(["can", "faults"], ("can", "casadi", "emulator")), (["campaign"], ("emulator",))],
    ids=["can", "campaign"],
)
def test_a_command_loads_no_more_than_it_needs(words: list[str], unneeded: tuple[str, ...]) -> None:
    code = (
        "import sys, quasiomni; quasiomni.load_commands(sys.argv[2:]);"
        "print([name for name in sys.argv[1].split(',') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, ",".join(unneeded), *words], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"


def run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A command line in a process of its own that says what it has loaded."""
    code = (
        "import atexit, sys, quasiomni; sys.argv = ['quasiomni', *sys.argv[1:]];"
        "atexit.register(lambda: print(*sorted(sys.modules), file=sys.stderr)); quasiomni.main()"
    )
    return subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=True, env=os.environ | environment
    )


@pytest.mark.parametrize("words", [("--help",), ("-h",), ("--version",)], ids=" ".join)
def test_help_and_version_wait_for_no_mathematics_and_no_bus(words: tuple[str, ...]) -> None:
    done = run(*words)
    assert not {"numpy", "scipy", "casadi", "can", "canopen"} & set(done.stderr.split())
    if words == ("--version",):
        assert done.stdout == f"quasiomni {version('quasiomni')}\n"
    else:
        assert all(name in done.stdout for commands in quasiomni.COMMANDS.values() for name in commands)


def test_help_has_a_short_name_at_every_level(quasi: Callable[..., Any]) -> None:
    groups = {"can": "faults", "exam": "seal"}
    for name in (name for commands in quasiomni.COMMANDS.values() for name in commands):
        words = [(name,), (name, groups[name])] if name in groups else [(name,)]
        for one in words:
            short, long = quasi(*one, "-h"), quasi(*one, "--help")
            assert short.code == 0
            assert short.out == long.out
            assert "Usage" in short.out


@pytest.mark.parametrize(
    ("line", "expected", "unneeded"),
    [
        ("quasiomni dia", "diagnose", "numpy"),
        ("quasiomni can fa", "faults", "casadi"),
        ("quasiomni emulate --lock", "--lockstep", "fmpy"),
    ],
)
def test_a_shell_completes_commands_and_options_and_loads_what_it_needs(
    line: str, expected: str, unneeded: str
) -> None:
    done = run(_QUASIOMNI_COMPLETE="complete_bash", COMP_WORDS=line, COMP_CWORD=str(len(line.split()) - 1))
    assert expected in done.stdout.split()
    assert unneeded not in done.stderr.split()


def test_the_script_that_a_shell_needs_is_shown() -> None:
    done = run("--show-completion", "bash", _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert "_QUASIOMNI_COMPLETE=complete_bash" in done.stdout
