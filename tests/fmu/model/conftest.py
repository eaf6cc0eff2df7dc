"""The C model compiled for this computer and called through ctypes."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.model.generate import generate_core
from fmu.table import variable_table
from fmu.variables import Block, Inputs
from ident.effects import Effect
from ident.vehicle.description import load_vehicle
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared")


class CoreError(Exception):
    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


@dataclass(frozen=True)
class Outcome:
    status: int
    message: str


class Core:
    """A compiled model; `new` gives instances of it."""

    def __init__(
        self,
        folder: Path,
        vehicle: str = "prototype",
        effects: Sequence[Effect] = (),
        inputs: Inputs = Inputs.TORQUE,
        parameters: Parameters | None = None,
    ) -> None:
        self.vehicle = load_vehicle(vehicle)
        self.table = variable_table(self.vehicle, parameters or self.vehicle.prior, effects, inputs)
        self.generated = generate_core(self.table, effects, inputs)
        for name, text in self.generated.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        self.folder, self.library_path = folder, folder / "model.so"
        sources = [str(path) for path in sorted(folder.glob("*.c"))]
        compiler = shutil.which("gcc") or "cc"
        subprocess.run([compiler, *FLAGS, "-o", str(self.library_path), *sources, "-lm"], check=True)
        self.library = ctypes.CDLL(str(self.library_path))
        self.library.qo_step.argtypes = [ctypes.c_void_p, ctypes.c_double]
        self.library.qo_advance.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p]
        self.sizes = {block: len(self.table.block(block)) for block in Block}
        self.struct = type("Model", (ctypes.Structure,), {"_fields_": self._fields()})

    def _fields(self) -> list[tuple[str, type]]:
        blocks = (Block.STATE, Block.INPUT, Block.PARAMETER, Block.OUTPUT)
        vectors = [(block.value, ctypes.c_double * self.sizes[block]) for block in blocks]
        vectors.append(("ur", ctypes.c_double * self.sizes[Block.INPUT]))
        scalars = [(name, ctypes.c_double) for name in ("tolerance", "step_length")]
        memory = [("after_jump", ctypes.c_double * 4), ("last_u", ctypes.c_double * self.sizes[Block.INPUT])]
        counts = [("since_jump", ctypes.c_int), ("mode", ctypes.c_int)]
        return [*vectors, *scalars, *memory, *counts, ("message", ctypes.c_char * 160)]

    def new(self, **values: float) -> Instance:
        instance = Instance(self)
        instance.set(**values)
        return instance


class Instance:
    """One vehicle; values by the names of the table."""

    def __init__(self, core: Core) -> None:
        self.core, self.raw = core, core.struct()
        core.library.qo_init(ctypes.byref(self.raw))
        self.blocks = {
            block: np.frombuffer(getattr(self.raw, block.value), dtype=float)
            for block in (Block.STATE, Block.INPUT, Block.PARAMETER, Block.OUTPUT)
        }

    @property
    def x(self) -> Array:
        return self.blocks[Block.STATE]

    @property
    def input_rates(self) -> Array:
        return np.frombuffer(self.raw.ur, dtype=float)

    @property
    def u(self) -> Array:
        return self.blocks[Block.INPUT]

    def set(self, **values: float) -> None:
        for name, value in values.items():
            row = self.core.table[name]
            self.blocks[row.block][row.index] = value

    def set_parameter(self, name: str, value: float) -> None:
        self.set(**{name: value})

    def __getitem__(self, name: str) -> float:
        row = self.core.table[name]
        return float(self.blocks[row.block][row.index])

    @property
    def mode(self) -> int:
        return int(self.raw.mode)

    def _call(self, function: str, *arguments: object) -> None:
        status = getattr(self.core.library, function)(ctypes.byref(self.raw), *arguments)
        if status:
            raise CoreError(status, self.raw.message.decode())

    def step(self, h: float) -> None:
        self._call("qo_step", h)

    def attempt(self, h: float) -> Outcome:
        status = self.core.library.qo_step(ctypes.byref(self.raw), h)
        return Outcome(status, self.raw.message.decode())

    def advance(self, h: float) -> float:
        taken = ctypes.c_double()
        self._call("qo_advance", h, ctypes.byref(taken))
        return taken.value

    def outputs(self) -> Array:
        self._call("qo_outputs")
        return self.blocks[Block.OUTPUT].copy()

    def derivatives(self) -> Array:
        return self._results("qo_derivatives", [], [Block.STATE])[0]

    def indicators(self) -> Array:
        z = np.empty(4)
        self._call("qo_event_indicators", z.ctypes.data_as(ctypes.c_void_p))
        return z

    def update_discrete(self) -> bool:
        changed = ctypes.c_int()
        self._call("qo_update_discrete", ctypes.byref(changed))
        return bool(changed.value)

    def jacobian_vector(self, dx: Array, du: Array, dp: Array) -> Array:
        return np.concatenate(self._results("qo_jacobian_vector", [dx, du, dp], [Block.STATE, Block.OUTPUT]))

    def vector_jacobian(self, lxd: Array, ly: Array) -> Array:
        blocks = [Block.STATE, Block.INPUT, Block.PARAMETER]
        return np.concatenate(self._results("qo_vector_jacobian", [lxd, ly], blocks))

    def _results(self, function: str, arguments: Sequence[Array], blocks: Sequence[Block]) -> list[Array]:
        given = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        results = [np.empty(self.core.sizes[block]) for block in blocks]
        self._call(function, *(array.ctypes.data_as(ctypes.c_void_p) for array in [*given, *results]))
        return results

    def copy(self) -> Instance:
        twin = Instance(self.core)
        ctypes.memmove(ctypes.byref(twin.raw), ctypes.byref(self.raw), ctypes.sizeof(self.raw))
        return twin

    def bytes(self) -> bytes:
        return bytes(self.raw)


CoreOf = Callable[..., Core]


@pytest.fixture(scope="session")
def core_of(tmp_path_factory: pytest.TempPathFactory) -> CoreOf:
    """Compiles a model for a vehicle, effects and kind of inputs, once each."""
    built: dict[tuple[str, ...], Core] = {}

    def build(vehicle: str = "prototype", effects: Sequence[Effect] = (), inputs: Inputs = Inputs.TORQUE) -> Core:
        key = (vehicle, inputs, *map(str, effects))
        if key not in built:
            built[key] = Core(tmp_path_factory.mktemp("core"), vehicle, effects, inputs)
        return built[key]

    return build


@pytest.fixture(scope="session", params=["prototype", "compact"])
def core(core_of: CoreOf, request: pytest.FixtureRequest) -> Core:
    return core_of(request.param)


POSTURES = {
    "straight": (0.0, 0.0),
    "steered": (0.3, 0.2),
    "lateral": (-np.pi / 2, np.pi / 2),
    "rotation": (None, None),
    "alignment": (0.7, -0.3),
    "just_off": (0.001, -0.001),
    "at_the_stop": (1.6203, -1.61995),
}


@pytest.fixture(params=list(POSTURES))
def posture(request: pytest.FixtureRequest, core: Core) -> Array:
    """Steering angles (2,) of every mode and between the modes."""
    if request.param == "rotation":
        return core.vehicle.geometry.rotation_angle * np.array([-1.0, 1.0])
    return np.array(POSTURES[request.param], dtype=float)
