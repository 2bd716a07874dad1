"""Mutated hand files: each loads, or gives a clear error with a location, in a second of CPU time and 1 GiB.

python tests/mutations.py COUNT [SEED]      prints how many of them loaded and how many were refused, as JSON
"""

from __future__ import annotations

import json
import random
import re
import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out

ROOT = Path(__file__).resolve().parent.parent
BASES = {"tests/one_finger.toml": 16, "examples/claw.toml": 3, "awiwi_gen/hand.toml": 1}  # with their shares
MOST_CPU, MOST_MEMORY = 1.0, 2**30  # [s], [bytes]
KEPT = 5  # mutants of each kind of failure that are shown

QUANTITY = re.compile(r'"-?[0-9][^"\n]*"')
ODD = [
    '""', '"0"', '"0 mm"', '"-1 mm"', '"nan mm"', '"inf"', '"1e30 mm"', '"1e-30 mm"', '"1e-30 nm^39/m^38"', '"9e999 mm"',
    '"6.2"', '"6.2 N"', '"0.25 in"', '"3 mm²"', '"6,2 mm"', '"6.2 mm mm"', '"1/0 mm"', '"1 m/(s"', '"\\u001b[2J 1 mm"',
    '"[/b]"', '"180 deg"', '"3.1 rad"', '"1e-29 deg"', '"1 kg m^2"', '"5 kg"', '"-5 g"', '"1000 mm"', '"1 um"', '" 1 mm "',
    "1", "-1", "1.5", "nan", "true", "2024-02-29", "[]", "{}", "[[]]", "{ a = { b = 1 } }", '["a", 1]', "0x1F", "'raw'",
    '"' + "9" * 70 + ' mm"', '"' + "x" * 900 + '"', "[" * 60 + "]" * 60,
]  # fmt: skip
LINES = [
    "x = 1", "[fingers.other]", "[[fingers.jaw.links]]", "[limits]", "[motor]", "[spring]", "[wrist]", "gains = 3",
    'gains = "../../etc/passwd"', 'gains = "/dev/zero"', "a.b.c.d = 1", '"odd key" = 2', "= 3", "]", '"""', "\u202e = 1",
    "over = [" + '"+pip", ' * 90 + "]", "source = {}", "couplings = [{ follower = \"mid\", leader = \"root\" }]",
]  # fmt: skip


def mutant(chance: random.Random, text: str) -> str:
    """The text after one to three mutations."""
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        text = chance.choice(MUTATIONS)(chance, text)
    return text


def _lines(change: Callable[[random.Random, list[str]], object]) -> Callable[[random.Random, str], str]:
    def mutate(chance: random.Random, text: str) -> str:
        lines = text.split("\n")
        change(chance, lines)
        return "\n".join(lines)

    return mutate


def _match(chance: random.Random, pattern: re.Pattern[str], text: str) -> re.Match[str] | None:
    found = [*pattern.finditer(text)]
    return chance.choice(found) if found else None


def _quantity(chance: random.Random, text: str, new: Callable[[str], str]) -> str:
    found = _match(chance, QUANTITY, text)
    return text[: found.start()] + new(found[0]) + text[found.end() :] if found else text


def _odd(chance: random.Random, text: str) -> str:
    return _quantity(chance, text, lambda _: chance.choice(ODD))


def _scaled(chance: random.Random, text: str) -> str:
    factor = chance.choice((-1, 0, 1e-9, 1e-3, 0.01, 0.1, 10, 100, 1e3, 1e9))
    return _quantity(
        chance, text, lambda old: re.sub(r"[-0-9.]+", lambda n: f"{_number(n[0]) * factor:g}", old, count=1)
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 1.0


def _other_unit(chance: random.Random, text: str) -> str:
    unit = chance.choice(("mm", "m", "g", "kg", "deg", "rad", "N", "N m", "g mm^2", "kg m^2", "Hz", "in", ""))
    return _quantity(chance, text, lambda old: re.sub(r'(?<=[0-9]) ?[^0-9"]*"$', f' {unit}"', old))


def _copied(chance: random.Random, text: str) -> str:
    found = _match(chance, QUANTITY, text)
    return _quantity(chance, text, lambda _: found[0]) if found else text


def _word(chance: random.Random, text: str) -> str:
    """One word in place of another: a key, a joint, a table."""
    words = [*re.finditer(r"[A-Za-z_][A-Za-z_0-9+-]*", text)]
    old, new = chance.choice(words), chance.choice(words)
    return text[: old.start()] + new[0] + text[old.end() :]


def _sign(chance: random.Random, text: str) -> str:
    found = _match(chance, re.compile(r'"[+-](?=[a-z])'), text)
    return text[: found.start() + 1] + chance.choice("+- *") + text[found.end() :] if found else text


def _character(chance: random.Random, text: str) -> str:
    at = chance.randrange(len(text) + 1)
    letters = chance.choice(
        ("", "", '"', "[", "]", "{", "}", "=", ",", ".", "\n", "\0", "\x1b", "\u00e9", "\u202e", "0", "e")
    )
    return text[:at] + letters + text[at + chance.randrange(2) :]


def _cut(chance: random.Random, text: str) -> str:
    return text[: chance.randrange(len(text) + 1)]


def _many(chance: random.Random, text: str) -> str:
    """Very many of one thing: keys, entries, tables, sources."""
    count = chance.choice((20, 2_000, 40_000))
    found = _match(chance, re.compile(r"over = \[|pulleys = \[|tendons = \[|ripple = \["), text)
    match chance.randrange(4):
        case 0 if found:
            return text[: found.end()] + '"+mid",\n' * count + text[found.end() :]
        case 1:
            return text + "\n" + "".join(f"k{i} = 1\n" for i in range(count))
        case 2:
            return text + "\n[[fingers.jaw.links]]\nmass = 1\n" * min(count, 20_000)
    return text.replace(
        'source = "assumed"', "source.default = 'x'\n" + "".join(f"source.k{i} = 'x'\n" for i in range(count)), 1
    )


MUTATIONS: list[Callable[[random.Random, str], str]] = [
    _odd, _odd, _odd, _scaled, _scaled, _scaled, _other_unit, _other_unit, _copied, _copied, _word, _word, _sign,
    _character, _character, _cut,
    _lines(lambda chance, lines: lines.pop(chance.randrange(len(lines))) if lines else None),
    _lines(lambda chance, lines: lines.insert(chance.randrange(len(lines) + 1), chance.choice(LINES))),
    _lines(lambda chance, lines: lines.insert(chance.randrange(len(lines) + 1), chance.choice(lines or [""]))),
]  # fmt: skip


def mutants(count: int, seed: int) -> Iterator[str]:
    """Texts of mutated hand files; one in fifty is large."""
    chance = random.Random(seed)  # noqa: S311 no secrets here
    own = [(ROOT / base).read_text(encoding="utf-8") for base in BASES]
    texts = [re.sub(r"^gains = .*\n", "", text, flags=re.M) for text in own]  # without the file beside it
    for number in range(count):
        (text,) = chance.choices(texts, [*BASES.values()])
        yield _many(chance, text) if number % 50 == 49 else mutant(chance, text)


def outcome(file: Path) -> str:
    """ "loads", "refused", or what is wrong with the answer."""
    start = time.process_time()
    try:
        hand, warnings = Hand.review(file)
        left_out(hand)
        result, faults = "loads", tuple(warnings)
    except InputError as error:
        result, faults = "refused", error.faults
        if not faults or not all(line.isprintable() for line in str(error).splitlines()):
            result = "an error without faults, or not printable"
    except Exception as error:  # the bug that is looked for
        return f"{type(error).__name__}: {error}"[:300]
    if time.process_time() - start > MOST_CPU:
        return f"{result}, but took {time.process_time() - start:.1f} s"
    unplaced = [str(fault) for fault in faults if not _located(fault)]
    return f"no location: {unplaced[0]}" if unplaced else result


def _located(fault: Fault) -> bool:
    """Whether a fault names the file and a line or a key; some are of the file as a whole."""
    whole = fault.message.startswith(("is longer than", "nests its brackets", "cannot be read"))
    return bool(fault.file and (fault.line or fault.key or whole))


def main(count: int, seed: int) -> int:
    """Try so many mutants; the exit code is 1 if any of them fails."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "hand.toml"
        for number, text in enumerate(mutants(count, seed)):
            file.write_bytes(text.encode("utf-8", "surrogatepass"))
            result = outcome(file)
            found[result] += 1
            if result not in ("loads", "refused") and found[result] <= KEPT:
                Path(f"mutant-{seed}-{number}.toml").write_bytes(file.read_bytes())
    print(json.dumps({"seed": seed, "mutants": count, **found}, indent=1))
    return int(not found.keys() <= {"loads", "refused"})


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1))
