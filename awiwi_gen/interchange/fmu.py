"""The hand as two FMUs of FMI 3.0 for co-simulation: the tick and the simulated hand, as C sources and a description."""

from __future__ import annotations

import platform
import re
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from awiwi_gen import extras
from awiwi_gen.build import FLAGS, compile_objects, load
from awiwi_gen.cache import Cache, key
from awiwi_gen.compiler import compiler
from awiwi_gen.emit.files import banner, render
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.hand_model import no_tick
from awiwi_gen.interchange.fmu_variables import CHOICES, KINDS, Variable, controller_variables, plant_variables
from awiwi_gen.interchange.model import Loss
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC
from awiwi_gen.units import parse_unit

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand

# What each unit calls; its sources are the files that have these, and those that they call.
CALLED = {
    "controller": ("awiwi_hand_init", "awiwi_hand_step", "{}_hand_model", "{}_default_gains"),
    "plant": ("awiwi_hand_place", "awiwi_hand_measure", "awiwi_hand_move", "{}_simulated_hand"),
}
ABOUT = {
    "controller": "The tick of the hand: sensors and demands in, motor torques out",
    "plant": "The simulated hand: motor torques in, sensors out",
}
DEFINED = re.compile(
    r"^(?!static|typedef|extern)[a-z_][\w ]*?[ *](\w+)\([^;{]*\)\n?\{|^const [\w ]+?(\w+)(?:\[[^=;]*)? =", re.M | re.S
)
SUFFIX = {"linux": ".so", "darwin": ".dylib"}
DAY = (2000, 1, 1, 0, 0, 0)  # of all files in the archive: equal hands give equal bytes


@dataclass(frozen=True)
class Unit:
    """One FMU: its name, the files in it by their paths, and its variables by value reference."""

    name: str
    files: Mapping[str, str]
    variables: Sequence[Variable]
    tree: Path

    def archive(self, binary: bytes | None = None) -> bytes:
        """The bytes of the FMU, with a compiled library for this machine if there is one."""
        files = {path: text.encode() for path, text in self.files.items()}
        if binary is not None:
            machine = {"arm64": "aarch64", "amd64": "x86_64"}.get(platform.machine().lower(), platform.machine())
            files[f"binaries/{machine}-{sys.platform}/{self.name}{SUFFIX[sys.platform]}"] = binary
        stream = BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for path, data in files.items():
                archive.writestr(zipfile.ZipInfo(path, DAY), data, zipfile.ZIP_DEFLATED)
        return stream.getvalue()

    def compiled(self, store: Cache) -> bytes:
        """The shared library of the unit, of objects in the cache where there are some.

        The headers of FMI come with fmpy. Raises MissingExtraError without it.
        """
        extras.require("a compiled FMU", "fmpy")
        headers = Path(str(find_spec("fmpy").origin)).parent / "c-code"  # type: ignore[union-attr]
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            objects = [
                path for path in compile_objects(self.tree, store, folder) if f"sources/{path.stem}.c" in self.files
            ]
            (folder / "fmu.c").write_text(self.files["sources/fmu.c"], encoding="utf-8")
            includes = (f"-I{self.tree}", f"-I{CSRC}", f"-I{headers}")
            compiler().run(*FLAGS, *includes, "-c", str(folder / "fmu.c"), "-o", str(folder / "fmu.o"))
            made = folder / "unit.so"
            compiler().run("-shared", str(folder / "fmu.o"), *map(str, objects), "-o", str(made), "-lm")
            return made.read_bytes()


def names(hand: Hand) -> list[str]:
    """The identifiers of a hand's units."""
    return [f"{hand.prefix}_{part}" for part in CALLED]


def units(hand: Hand) -> tuple[list[Unit], list[Loss]]:
    """The controller and the plant of a hand, and what they do not hold.

    Raises InputError for a hand without a tick, with the reason.
    """
    job = Job(hand, Options())
    if why := no_tick(hand, job.catalog, job.options):
        raise InputError(f"{hand.name} has no tick, and so no FMU: {why}")
    tree = cached_tree(job)
    library = load(tree, job.store)
    texts = {path.name: path.read_text(encoding="utf-8") for folder in (tree, CSRC) for path in folder.glob("*.[ch]")}
    period = repr(_period(library))
    made = []
    for part, variables in (
        ("controller", controller_variables(hand, library)),
        ("plant", plant_variables(hand, library)),
    ):
        identifier = f"{hand.prefix}_{part}"
        strings = {
            "banner": banner(), "part": part, "prefix": hand.prefix, "period": period, "variables": variables,
            "types": [
                {"name": kind, "kinds": [{"name": k, "c": c} for k, (t, c) in KINDS.items() if t == kind]}
                for kind in dict.fromkeys(t for t, _ in KINDS.values())
            ],
        }  # fmt: skip
        code = {name: texts[name] for name in _needed([each.format(hand.prefix) for each in CALLED[part]], texts)}
        token = key(*code.values(), render("fmu.c.j2", **strings, token=""))
        code["fmu.c"] = render("fmu.c.j2", **strings, token=token)
        files = {
            "modelDescription.xml": _description(hand, part, identifier, token, period, variables),
            "sources/buildDescription.xml": _build_description(identifier, sorted(code)),
            **{f"sources/{each}": text for each, text in sorted(code.items())},
        }
        made.append(Unit(identifier, files, variables, tree))
    used = {Path(path).stem for unit in made for path in unit.files}
    return made, _losses(hand, [name for name in library if name not in used])


def _losses(hand: Hand, unused: Sequence[str]) -> list[Loss]:
    numbers = [name for name in ("fingers", "motor", "spring", "tendon", "wrist") if getattr(hand, name, None)]
    return [
        Loss("numbers of the hand: they are constants of the C, no parameters", tuple(numbers)),
        Loss("kernels that neither the tick nor the simulated hand calls", tuple(unused)),
        Loss("logs of the tick, for replay", ("awiwi_hand_log",)),
    ]


def _period(library: Any) -> float:
    return float(getattr(library.c, f"{library.manifest['prefix']}_default_gains").period)


def _needed(called: Iterable[str], texts: Mapping[str, str]) -> list[str]:
    """The C files that define some names, and all that these need.

    They need headers that they include, C files that define what they mention, and the C file of a header's name.
    """
    home = {a or b: file for file, text in texts.items() if file.endswith(".c") for a, b in DEFINED.findall(text)}
    found, waiting = set[str](), ["awiwi_hand_plant.h", "hand.h", *(home[name] for name in called)]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            waiting += re.findall(r'#include "([^"]+)"', texts[file])
            companion = file.removesuffix(".h") + ".c"
            mentioned = re.findall(r"\b\w+\b", texts[file]) if file.endswith(".c") else []
            waiting += [home[word] for word in mentioned if word in home] + [companion] * (companion in texts)
    return sorted(found)


def _build_description(name: str, code: Iterable[str]) -> str:
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=name)
    options = "-ffp-contract=off -fno-math-errno"  # the bits depend on the first, the time on the second
    files = ElementTree.SubElement(build, "SourceFileSet", language="C99", compilerOptions=options)
    for source in code:
        if source.endswith(".c"):
            ElementTree.SubElement(files, "SourceFile", name=source)
    ElementTree.SubElement(build, "Library", name="m", external="true")
    return _document(root)


def _description(hand: Hand, part: str, name: str, token: str, period: str, variables: Sequence[Variable]) -> str:
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=f"{hand.prefix} {part}", instantiationToken=token,
        description=f"{ABOUT[part]}. {hand.name}.", generationTool="awiwi-gen", variableNamingConvention="structured",
    )  # fmt: skip
    ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=name, canGetAndSetFMUState="true", canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize="true", fixedInternalStepSize=period,
    )  # fmt: skip
    defined = ElementTree.SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(each.unit for each in variables if each.unit):
        _define(defined, unit)
    types = ElementTree.SubElement(root, "TypeDefinitions")
    for choice in dict.fromkeys(each.choices for each in variables if each.choices):
        made = ElementTree.SubElement(types, "EnumerationType", name=choice)
        for value, word in enumerate(CHOICES[choice]):
            ElementTree.SubElement(made, "Item", name=word, value=str(value))
    if not len(types):
        root.remove(types)
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize=period)
    listed = ElementTree.SubElement(root, "ModelVariables")
    structure = ElementTree.SubElement(root, "ModelStructure")
    for reference, each in enumerate(variables):
        _list(listed, reference, each)
    for element in ("Output", "InitialUnknown"):
        for reference, each in enumerate(variables):
            if each.causality == "output":
                ElementTree.SubElement(structure, element, valueReference=str(reference))
    return _document(root)


def _define(parent: ElementTree.Element, unit: str) -> None:
    found = parse_unit(unit)
    exponents = {**found.dimension._asdict(), "rad": found.radians}
    base = {symbol: str(int(exponent)) for symbol, exponent in exponents.items() if exponent}
    ElementTree.SubElement(ElementTree.SubElement(parent, "Unit", name=unit), "BaseUnit", base)


def _list(parent: ElementTree.Element, reference: int, each: Variable) -> None:
    attributes = {"name": each.name, "valueReference": str(reference), "causality": each.causality}
    attributes |= {"variability": each.variability, "description": each.doc}
    if each.choices:
        attributes["declaredType"] = each.choices
    elif each.unit:
        attributes["unit"] = each.unit
    if each.start is not None:
        attributes["start"] = each.start_text
    if each.causality in ("output", "local"):
        attributes["initial"] = "calculated"
    ElementTree.SubElement(parent, "Enumeration" if each.choices else each.type, attributes)


def _document(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'
