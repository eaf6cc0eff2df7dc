"""Each command loads what it needs, and nothing else."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

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


def test_every_module_of_the_command_line_is_listed() -> None:
    modules = {path.stem for path in Path(quasiomni.__file__).parent.glob("*.py")}
    assert modules - {"__init__", "__main__", "application", "options"} == set(quasiomni.COMMANDS)


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
