"""Kernels of several fingers at once, for hosts: one program with other numbers, a finger in each lane of a vector.

Fingers of a hand are often alike: the C of their kernels differs in its numbers only. Then one loop over these fingers
does the work of all, with the same operations in the same order as each kernel alone, so with the same bits.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from awiwi_gen.emit.batch import Entry, c_arrays, worthwhile
from awiwi_gen.emit.c import CFunction
from awiwi_gen.emit.names import function_name

NUMBER = re.compile(r"(?<![\w.])(?:\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+)f?(?![\w.])")


@dataclass(frozen=True)
class Lanes:
    """Kernels that are one program: its statements, with ``numbers[k]`` of every lane in place of ``n_[k]``."""

    name: str
    entry: Entry
    fingers: tuple[str, ...]
    includes: tuple[str, ...]
    statements: tuple[str, ...]
    numbers: tuple[tuple[str, ...], ...]

    def prototype(self, prefix: str, c_type: str) -> str:
        """The prototype of the function over all lanes."""
        arrays = [f"{kind}{port}[{size * len(self.fingers)}]" for kind, port, size in c_arrays(self.entry, c_type)]
        status = [f"int status[{len(self.fingers)}]"] * bool(self.entry["status"])
        return f"void {function_name(prefix, self.name)}({', '.join(arrays + status)})"

    def file(self, prefix: str, c_type: str) -> str:
        """The C of the function over all lanes."""
        from awiwi_gen.emit.files import banner, render  # here, because a library is loaded without Jinja

        ports = c_arrays(self.entry, c_type)
        return render(
            "lanes.c.j2",
            banner=banner(f"{self.entry['family']} of {', '.join(self.fingers)} at once; see batches.h."),
            prototype=self.prototype(prefix, c_type),
            alone=", ".join(f"{kind}{port}[{size}]" for kind, port, size in ports),
            includes=self.includes,
            statements=self.statements,
            numbers=self.numbers,
            lanes=len(self.fingers),
            inputs=[(port, size) for kind, port, size in ports if kind.startswith("const")],
            outputs=[(port, size) for kind, port, size in ports if not kind.startswith("const")],
            status=bool(self.entry["status"]),
            c_type=c_type,
        )


def shared_programs(entries: Iterable[Entry], functions: Mapping[str, CFunction]) -> Iterator[Lanes]:
    """Kernels of two fingers or more whose C is the same but for its numbers, if vectors make them faster."""
    alike = defaultdict(list)
    for entry in entries:
        where, _, finger = entry["part"].partition(".")
        text = "\n".join(functions[entry["name"]].statements)
        if where == "fingers" and not entry["params"] and worthwhile(entry, text):
            family = entry["name"].removeprefix(f"{finger}_")
            alike[family, NUMBER.sub("#", text)].append((finger, {**entry, "family": family}, text))
    for (family, _), kernels in alike.items():
        if len(kernels) > 1:
            fingers, found, texts = zip(*kernels, strict=True)
            includes = functions[found[0]["name"]].includes
            yield Lanes(f"{'_'.join(fingers)}_{family}_lanes", found[0], fingers, includes, *merged(texts))


def merged(texts: Sequence[str]) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """One text for all, in which numbers that differ are elements of ``n_``, and those numbers, lane by lane."""
    places = zip(*(NUMBER.findall(text) for text in texts), strict=True)
    numbers: dict[tuple[str, ...], int] = {}

    def one(_: re.Match[str]) -> str:
        each = next(places)
        return each[0] if len(set(each)) == 1 else f"n_[{numbers.setdefault(each, len(numbers))}]"

    return tuple(NUMBER.sub(one, texts[0]).split("\n")), tuple(numbers)
