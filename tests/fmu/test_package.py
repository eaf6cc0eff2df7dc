"""What is in the file, and that the same input gives the same file."""

from __future__ import annotations

import re
import struct
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from fmu.compiling import HEADERS, Compiler, check_platforms, compile_libraries, find_compiler, universal_binary
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu, fmu_interface, fmu_sources, token_of
from fmu.platforms import PLATFORMS, host_platform, parse_platforms
from fmu.source import ModelSource, make_model
from fmu.units import unit_of
from fmu.variables import Inputs
from ident.errors import UserError
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import GEOMETRY_UNITS
from ident.vehicle.parameters import PARAMETER_NAMES

Build = Callable[[FmiVersion, Inputs], Path]

MAGIC = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}
"""How shared libraries begin."""


def contents(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def description(path: Path) -> ElementTree.Element:
    return ElementTree.fromstring(contents(path)["modelDescription.xml"])


def starts(path: Path) -> dict[str, float]:
    root = description(path)
    rows = {row.get("name"): row for row in root.iter() if row.get("valueReference") and row.get("name")}
    values = {name: row.get("start") or next((child.get("start") for child in row), None) for name, row in rows.items()}
    return {str(name): float(value) for name, value in values.items() if value is not None}


def test_the_same_model_gives_the_same_bytes_wherever_it_is_built(source: ModelSource, tmp_path: Path) -> None:
    """Not from memory: the second build has its sources in another place."""
    order = Order(FmiVersion.FMI3, Inputs.TORQUE, (host_platform(),))
    first, second = (build_fmu(source, order, find_compiler(), cache=tmp_path / place) for place in ("here", "there"))
    assert first == second


def test_binaries_name_no_place_on_the_builder_s_machine(variant: Path) -> None:
    for name, content in contents(variant).items():
        if name.startswith("binaries/"):
            assert str(Path.home()).encode() not in content
            assert b"/tmp/" not in content


def test_everything_that_a_user_looks_for_is_inside(build: Build) -> None:
    new = contents(build(FmiVersion.FMI3, Inputs.TORQUE))
    host = host_platform()
    assert {
        f"binaries/{host.name}/quasiomni{host.suffix}",
        "documentation/index.html",
        "documentation/licenses/license.txt",
        "documentation/parameters.toml",
        "sources/buildDescription.xml",
        "terminalsAndIcons/terminalsAndIcons.xml",
        "terminalsAndIcons/icon.png",
        "terminalsAndIcons/icon.svg",
    } <= new.keys()
    assert {f"binaries/{host.folder_fmi2}/quasiomni{host.suffix}", "model.png"} <= contents(
        build(FmiVersion.FMI2, Inputs.TORQUE)
    ).keys()


def test_sources_are_whole_but_for_the_headers_of_fmi(variant: Path) -> None:
    """As both standards want it: whoever compiles brings the headers of the standard."""
    files = contents(variant)
    sources = {name.removeprefix("sources/"): text for name, text in files.items() if name.endswith((".c", ".h"))}
    included = {match.decode() for text in sources.values() for match in re.findall(rb'#include "([^"]+)"', text)}
    assert included - sources.keys() <= {path.name for path in HEADERS.glob("fmi*.h")}
    assert not [name for name in sources if name.startswith("fmi") and name.endswith(".h")]
    listed = files.get("sources/buildDescription.xml", files["modelDescription.xml"])
    for name in sources:
        assert (f'name="{name}"'.encode() in listed) == name.endswith(".c")


def test_start_values_are_those_that_were_identified(variant: Path, source: ModelSource) -> None:
    found = starts(variant)
    for name in PARAMETER_NAMES:
        assert found[name] == source.parameters[name]
    for name in GEOMETRY_UNITS:
        if name != "steering_limit":
            assert found[name] == getattr(source.vehicle.geometry, name)
    assert found["stribeck.steering_left.amplitude"] == 2.0
    assert found["stribeck.steering_right.amplitude"] == 0.0


def test_the_documentation_tells_values_deviations_effects_and_where_they_come_from(variant: Path) -> None:
    page = contents(variant)["documentation/index.html"].decode()
    assert "stribeck@steering_left: amplitude = 2 ± 0.1 Nm" in page
    assert "backlash@drive_fl: gap = " in page
    assert "monday" in page
    for row in description(variant).iter():
        if row.get("causality") in ("input", "output", "parameter"):
            assert f"<code>{row.get('name')}</code>" in page


def test_every_parameter_is_tunable(variant: Path) -> None:
    parameters = [row for row in description(variant).iter() if row.get("causality") == "parameter"]
    assert len(parameters) > 30
    assert {row.get("variability") for row in parameters} == {"tunable"}


def test_terminals_name_variables_that_there_are(build: Build) -> None:
    for inputs in Inputs:
        path = build(FmiVersion.FMI3, inputs)
        names = {row.get("name") for row in description(path).iter()}
        root = ElementTree.fromstring(contents(path)["terminalsAndIcons/terminalsAndIcons.xml"])
        members = [row.get("variableName") for row in root.iter("TerminalMemberVariable")]
        assert len(members) == len(set(members)) > 20
        assert set(members) <= names


def test_outputs_depend_on_what_they_depend_on(build: Build) -> None:
    """The position changes with its velocities alone; a wheel accelerates by its own torque."""
    root = description(build(FmiVersion.FMI3, Inputs.TORQUE))
    references = {row.get("valueReference"): row.get("name") for row in root.iter() if row.get("name")}
    told = {
        references[row.get("valueReference")]: {references[other] for other in str(row.get("dependencies")).split()}
        for row in root.iter("ContinuousStateDerivative")
    }
    assert told["der(pose_x)"] == {"x_dot", "y_dot", "gamma"}
    assert told["der(beta_fl)"] == {"beta_fl_dot"}
    assert "torque_rl" in told["der(beta_rl_dot)"]
    assert "torque_rr" not in told["der(beta_rl_dot)"]
    assert "torque_fl" in told["der(gear_fl_twist_dot)"]


@pytest.mark.parametrize(
    ("name", "exponents"),
    [
        ("Nm s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("N s^2/m^2", {"kg": 1, "m": -1}),
        ("rad/Nm", {"rad": 1, "kg": -1, "m": -2, "s": 2}),
        ("1", {}),
    ],
)
def test_units_carry_the_exponents_of_si(name: str, exponents: dict[str, int]) -> None:
    assert unit_of(name).exponents == exponents


def test_platforms_are_chosen_by_name() -> None:
    assert [platform.name for platform in parse_platforms("all")] == list(PLATFORMS)
    assert parse_platforms("host") == (host_platform(),)
    assert parse_platforms("x86_64-windows, host, x86_64-windows")[0] is PLATFORMS["x86_64-windows"]
    with pytest.raises(UserError, match="riscv"):
        parse_platforms("riscv-linux")


def test_the_system_s_compiler_builds_for_this_computer_alone() -> None:
    compiler = Compiler("gcc", ("gcc",), cross=False)
    check_platforms(compiler, (host_platform(),))
    with pytest.raises(UserError, match="ziglang") as error:
        check_platforms(compiler, parse_platforms("all"))
    assert "ziglang" in error.value.remedy


@pytest.mark.slow
def test_the_system_s_compiler_will_do(source: ModelSource, need: Callable[[str], str], tmp_path: Path) -> None:
    compiler = Compiler("gcc", (need("gcc"),), cross=False)
    content = build_fmu(source, Order(FmiVersion.FMI2, Inputs.TORQUE, (host_platform(),)), compiler, cache=tmp_path)
    (tmp_path / "gcc.fmu").write_bytes(content)
    assert any(name.startswith("binaries/") for name in contents(tmp_path / "gcc.fmu"))


def test_a_compiler_that_fails_is_told_with_its_last_words(need: Callable[[str], str], tmp_path: Path) -> None:
    compiler = Compiler("gcc", (need("gcc"),), cross=False)
    with pytest.raises(UserError, match="nonsense"):
        compile_libraries({"a.c": b"int nonsense("}, (host_platform(),), compiler, lambda _: None, tmp_path)


def test_a_universal_binary_holds_both_processors_at_page_boundaries() -> None:
    """Magic, two entries of processor type, offset, size; mach-o/fat.h."""
    slices = {"x86_64-darwin": b"intel" * 5000, "aarch64-darwin": b"arm" * 9000}
    content = universal_binary(slices)
    magic, count = struct.unpack_from(">II", content)
    assert (magic, count) == (0xCAFEBABE, 2)
    for index, (processor, library) in enumerate(zip((0x01000007, 0x0100000C), slices.values(), strict=True)):
        kind, _, offset, size, align = struct.unpack_from(">IIIII", content, 8 + 20 * index)
        assert kind == processor
        assert offset % (1 << align) == 0
        assert content[offset : offset + size] == library


@pytest.mark.slow
@pytest.mark.parametrize("version", list(FmiVersion))
def test_every_platform_is_built_and_warm_in_less_than_five_seconds(
    source: ModelSource, version: FmiVersion, tmp_path: Path
) -> None:
    order = Order(version, Inputs.TORQUE, parse_platforms("all"))
    compiler = find_compiler()
    first = build_fmu(source, order, compiler)
    start = time.monotonic()
    again = build_fmu(source, order, compiler)
    assert time.monotonic() - start < 5.0
    assert first == again
    (tmp_path / "all.fmu").write_bytes(first)
    binaries = {name: text for name, text in contents(tmp_path / "all.fmu").items() if name.startswith("binaries/")}
    assert len(binaries) == (len(PLATFORMS) if version is FmiVersion.FMI3 else len(PLATFORMS) - 1)
    for name, content in binaries.items():
        universal = name == "binaries/darwin64/quasiomni.dylib"
        assert content.startswith(b"\xca\xfe\xba\xbe" if universal else MAGIC[Path(name).suffix])
        assert b"fmi2DoStep" in content or b"fmi3DoStep" in content


@pytest.mark.parametrize("version", FmiVersion)
def test_another_vehicle_has_tables_of_its_own_and_nothing_else_to_compile(version: FmiVersion) -> None:
    """A compiled unit is kept by its content and that of all that it includes."""
    made = [_sources_of(name, version) for name in ("prototype", "compact")]
    differing = {name for name in made[0] if made[0][name] != made[1][name]}
    assert made[0].keys() == made[1].keys()
    assert differing == {"qo_table.c", "variables.c"}


def _sources_of(vehicle: str, version: FmiVersion) -> dict[str, bytes]:
    described = load_vehicle(vehicle)
    source = ModelSource(described, described.prior, (), {}, {})
    order = Order(version, Inputs.TORQUE, (host_platform(),))
    model = make_model(source, order.inputs)
    interface = fmu_interface(source, model, order)
    return fmu_sources(model, interface, version, token_of(model, interface, version))
