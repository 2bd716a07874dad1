"""Pages that are made: one for each kernel from the manifest, its definition and its proof, and the keys of hand files."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from awiwi_gen import mathematics
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.hand.schema import json_schema
from awiwi_gen.ir.cost import operations_text
from awiwi_gen.kernel import Kernel
from awiwi_gen.pipeline import Job, Proof
from awiwi_gen.records import load_graphs
from awiwi_gen.verify.verdict import Verdict

ROOT = Path(__file__).resolve().parent.parent.parent


def write(sources: Path, job: Job, proof: Proof) -> None:
    """Write all pages below a folder; the hand's kernels are generated and proved."""
    manifest: Any = read_manifest(ROOT / "generated")
    entries = {entry["name"]: entry for entry in manifest["kernels"]}
    verdicts = {verdict.name: verdict for verdict in proof.verdicts}
    folder = sources / "kernels"
    folder.mkdir()
    mended = errata()
    for kernel in job.kernels:
        lines = kernel_page(job, kernel, entries[kernel.name], verdicts[kernel.name], mended)
        (folder / f"{kernel.name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "index.md").write_text("\n".join(kernel_index(job.kernels, entries)) + "\n", encoding="utf-8")
    (sources / "hand_file_keys.md").write_text("\n".join(key_pages(json_schema())) + "\n", encoding="utf-8")


def kernel_index(kernels: Iterable[Kernel], entries: Mapping[str, Any]) -> Iterator[str]:
    """All kernels in a table for each part of the hand."""
    yield from (
        "# All kernels",
        "",
        "Functions of the C interface of the Awiwi hand, each proved against two derivations.",
        "",
    )
    parts: dict[str, list[Kernel]] = {}
    for kernel in kernels:
        parts.setdefault(kernel.path or "hand", []).append(kernel)
    for part, members in parts.items():
        yield from (f"## {part.removeprefix('fingers.')}", "", "| kernel | operations | what |", "|---|---|---|")
        for kernel in members:
            cost = operations_text(entries[kernel.name])
            yield f"| [{kernel.name}]({kernel.name}.md) | {cost} | {cell(kernel.doc.partition('. ')[0])} |"
        yield ""
    yield from ("```{toctree}", ":hidden:", *(kernel.name for kernel in kernels), "```")


def kernel_page(
    job: Job, kernel: Kernel, entry: Mapping[str, Any], verdict: Verdict, mended: Mapping[str, str]
) -> Iterator[str]:
    """What a kernel computes, from what, how exactly and at which cost."""
    yield from (f"# {kernel.name}", "", cell(kernel.doc), "")
    yield from ("```c", f"{job.records[kernel.name].function.prototype};", "```", "")
    numbers = f", with the numbers of `{kernel.path}` in the hand file" if kernel.part.quantities() else ""
    yield f"**Source**: {kernel.source}{errata_note(kernel.source, mended)}{numbers}"
    yield from ("", "## Formula", "", *formula(job, kernel), "")
    yield from ("## Arguments", "", "| | name | shape | unit | range |", "|---|---|---|---|---|")
    for side in ("inputs", "outputs"):
        for port in entry[side]:
            shape = " x ".join(map(str, port["shape"])) or "1"
            yield f"| {side[:-1]} | `{port['name']}` | {shape} | {port['unit']} | {cell(ranges(port))} |"
    yield ""
    if kernel.guards:
        yield from ("It returns 1, and no result, unless", "", *(f"- {guard}" for guard in kernel.guards), "")
    counts = ", ".join(f"{n} {what}" for what, n in entry["cost"].items() if n and what != "operations")
    yield from ("## Cost and proof", "", "| | |", "|---|---|")
    yield f"| operations | {operations_text(entry)} ({counts or 'only moves'}) |"
    yield f"| largest error | {verdict.worst_ulp:.3g} ulp; {verdict.worst_scaled_error:.1e} of the scale of its terms |"
    yield f"| the derivations agree to | {verdict.agreement:.0e} |"
    yield f"| verdict | {'proved' if verdict.passed else cell('; '.join(verdict.reasons))}, at {verdict.samples} samples |"
    yield from ("", "[What proved means](../docs/verification.md), [frames, signs and units](../docs/conventions.md).")


def formula(job: Job, kernel: Kernel) -> Iterator[str]:
    """The definition typeset if it is short enough, else where to read it."""
    if kernel.solver is not None:
        calls = ", ".join(f"[{name}]({name}.md)" for name in kernel.needs.values())
        yield f"By iteration: {kernel.solver.problem}" + (f", with {calls}." if calls else ".")
        return
    definition = next(iter(load_graphs(kernel, job.store).values()))
    if not mathematics.is_readable(definition):
        yield f"Too long to be read as a whole; its definition is {kernel.source}, and"
        yield f"`awiwi-gen explain {kernel.name}` prints its graph."
        return
    for line in mathematics.latex(kernel, definition):
        yield from ("```{math}", line, "```", "")
    used = {path: kernel.part.quantities()[path] for path in definition.params}
    if used:
        yield from ("| number of the hand file | value |", "|---|---|")
        for path, value in used.items():
            yield f"| `{kernel.path}.{path}` | {value} |"


def ranges(port: Mapping[str, Any]) -> str:
    """The documented range of an input: one for all elements, or one for each."""
    if "low" not in port:
        return ""
    pairs = [f"{low:.4g} to {high:.4g}" for low, high in zip(port["low"], port["high"], strict=True)]
    return pairs[0] if len(set(pairs)) == 1 else "; ".join(pairs)


def cell(text: str) -> str:
    """Text that Markdown leaves as it is."""
    return re.sub(r"([\\`*_|<>\[\]$])", r"\\\1", text)


def errata() -> dict[str, str]:
    """Equation -> page that says how it is mended."""
    found = {}
    for page in sorted((ROOT / "docs").glob("errata_*.md")):
        for row in re.findall(r"^\| ([^|]+) \|", page.read_text(encoding="utf-8"), re.MULTILINE):
            found |= dict.fromkeys(equations(row), page.name)
    return found


def equations(text: str) -> set[str]:
    """The numbers of equations in a text such as "eq. 2.4 to 2.15, 2.17"; ranges are filled."""
    text = re.sub(r"\b(table|figure|section|chapter)s? [\d., ]*\d", "", text)
    found = set(re.findall(r"(?<![\d.])\d+\.\d+(?![\d.])", text))
    for chapter, first, last in re.findall(r"\b(\d+)\.(\d+) to \1\.(\d+)\b", text):
        found |= {f"{chapter}.{n}" for n in range(int(first), int(last) + 1)}
    return found


def errata_note(source: str, mended: Mapping[str, str]) -> str:
    """Links to the errata of the equations that a kernel is made from."""
    by_page: dict[str, list[str]] = {}
    for equation in sorted(equations(source), key=lambda text: [int(n) for n in text.split(".")]):
        if equation in mended:
            by_page.setdefault(mended[equation], []).append(equation)
    links = [f"[{', '.join(found)}](../docs/{page})" for page, found in by_page.items()]
    return f" (errata: {'; '.join(links)})" if links else ""


def key_pages(schema: Mapping[str, Any]) -> Iterator[str]:
    """Every table of a hand file with its keys, from the schema."""
    yield from ("# Keys of the hand file", "", "Made from the schema that the reader itself declares;")
    yield "[the hand file](docs/hand_file.md) explains it with examples. Editors read"
    yield from ("[hand.schema.json](_static/hand.schema.json): `awiwi-gen schema -o hand.schema.json` writes it,", "")
    yield from ("and the line `#:schema hand.schema.json` at the top of a hand file names it.", "")
    tables = {"The file": schema} | {name.rpartition("__")[2] if name.count("Friction") == 0 else name: each
                                     for name, each in schema["$defs"].items() if "properties" in each}  # fmt: skip
    for name, table in tables.items():
        yield from (f"## {name.replace('awiwi_gen__hand__', '').replace('__', ' ')}", "")
        yield from (cell(table.get("description", "")), "", "| key | needed | value |", "|---|---|---|")
        for key, value in table["properties"].items():
            yield f"| `{key}` | {'yes' if key in table.get('required', ()) else ''} | {cell(kind(value))} |"
        yield ""


def kind(value: Mapping[str, Any]) -> str:
    """What a value is, in words."""
    if "anyOf" in value:
        return "; or ".join(kind(each) for each in value["anyOf"])
    if "$ref" in value:
        return f"table {value['$ref'].rpartition('/')[2].rpartition('__')[2]}"
    if "enum" in value or "const" in value:
        return "one of " + ", ".join(json.dumps(each) for each in value.get("enum", [value.get("const")]))
    if value["type"] == "array":
        each = value["items"] if isinstance(value.get("items"), dict) else value["prefixItems"][0]
        most, least = value.get("maxItems"), value.get("minItems")
        count = f"{most}" if most == least and most else f"up to {most}" if most else "any number"
        return f"{count} of: {kind(each)}"
    if value["type"] == "object":
        patterns = [kind(each) for each in value.get("patternProperties", {}).values()]
        return f"by name: {patterns[0]}" if patterns else "table"
    words = {"string": "text", "integer": "integer", "boolean": "true or false"}[value["type"]]
    examples = ", ".join(json.dumps(each) for each in value.get("examples", ()))
    return value.get("description") or (f"{words} such as {examples}" if examples else words)
