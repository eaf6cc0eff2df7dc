"""An FMU as an importer runs it, by FMPy: values by name, one step after the other."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from ident.errors import UserError


class FmuError(UserError):
    """An FMU cannot be run, or has refused what it was asked to do."""


@dataclass(frozen=True)
class Port:
    """Real variables that are read or written together."""

    references: tuple[int, ...]


class FmuInstance:
    """A co-simulation instance of an FMU of either version.

    Args:
        path: of the FMU.
        start: start values by name: parameters, states, inputs.

    Attributes:
        time: that it has reached [s].

    Raises:
        FmuError: FMPy is not installed, the file is no FMU for this computer, or a start value is refused.
    """

    def __init__(self, path: Path, start: Mapping[str, float]) -> None:
        self._fmpy = _load_fmpy()
        self._path = path
        self._messages: list[str] = []
        self.time = 0.0
        try:
            self._description = self._fmpy.read_model_description(str(path))
            self._folder = str(self._fmpy.extract(str(path)))
        except Exception as error:
            raise FmuError(f"{path} cannot be read: {error}.", "Name a file that `quasiomni fmu` wrote.") from error
        self._variables = {row.name: int(row.valueReference) for row in self._description.modelVariables}
        self._is_fmi3 = str(self._description.fmiVersion).startswith("3")
        try:
            self._instance = self._open()
            self._begin(start)
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    @property
    def names(self) -> tuple[str, ...]:
        """Of all variables."""
        return tuple(self._variables)

    def reported(self, state: str) -> str:
        """What sensors report in place of a state: `<state>_reported` where that is a variable, else the state."""
        name = f"{state}_reported"
        return name if name in self._variables else state

    def port(self, names: Sequence[str]) -> Port:
        """What is needed to read or write variables.

        Raises:
            FmuError: the FMU has no variable of that name.
        """
        missing = [name for name in names if name not in self._variables]
        if missing:
            raise FmuError(
                f"{self._path} has no variable {missing[0]!r}.",
                "Name an FMU of `quasiomni fmu` with the right --inputs.",
            )
        return Port(tuple(self._variables[name] for name in names))

    def write(self, port: Port, values: Sequence[float]) -> None:
        """Set variables.

        Raises:
            FmuError: the FMU refuses a value; says which.
        """
        setter = self._instance.setFloat64 if self._is_fmi3 else self._instance.setReal
        self._call(setter, port.references, values)

    def read(self, port: Port) -> list[float]:
        """Values of variables.

        Raises:
            FmuError: the FMU cannot compute one.
        """
        getter = self._instance.getFloat64 if self._is_fmi3 else self._instance.getReal
        values: list[float] = self._call(getter, port.references)
        return values

    def step(self, size: float) -> None:
        """One communication step of `size` [s].

        Raises:
            FmuError: the FMU cannot take it.
        """
        self._call(self._instance.doStep, self.time, size)
        self.time += size

    def close(self) -> None:
        """Free the instance and what was unpacked for it."""
        self._instance.terminate()
        self._instance.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _open(self) -> Any:
        return self._instantiate()

    def _instantiate(self, **options: bool) -> Any:
        simulation = self._fmpy.simulation
        try:
            return simulation.instantiate_fmu(
                self._folder, self._description, "CoSimulation", logger=self._hear, **options
            )
        except Exception as error:
            told = self._messages[-1] if self._messages else str(error)
            raise FmuError(
                f"{self._path} does not run here: {told}", "Build it for this computer: quasiomni fmu --platforms host."
            ) from error

    def _begin(self, start: Mapping[str, float]) -> None:
        if self._is_fmi3:
            self._call(self._instance.enterInitializationMode)
        else:
            self._call(self._instance.setupExperiment)
            self._call(self._instance.enterInitializationMode)
        self.write(self.port(list(start)), list(start.values()))
        self._call(self._instance.exitInitializationMode)

    def _hear(self, *arguments: Any) -> None:
        """Keeps what the FMU says; the message comes last in both versions."""
        self._messages.append(arguments[-1].decode())

    def _call(self, function: Any, *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except Exception as error:
            told = self._messages[-1] if self._messages else str(error)
            raise FmuError(f"{self._path}: {told}", "Check the parameters and inputs that it is given.") from error


def _load_fmpy() -> Any:
    try:
        import fmpy
        import fmpy.simulation
    except ImportError as error:
        raise FmuError(
            f"FMPy, which runs FMUs, is not installed ({error.name}).", "Install it: pip install 'quasiomni[cosim]'."
        ) from error
    return fmpy
