"""Operations of a C or C++ text by one small rule, the same for every tool's straight-line code.

Counted is `+ - * /` between two operands; a sign before an operand is not, nor is anything inside `[...]`, nor a `*`
behind a type's name. `pow(x, n)` with a whole n is what multiplications it takes, and a division if n < 0; CasADi's
`casadi_sq(x)` is one multiplication. A sine and a cosine of one angle are one sincos: the larger number of the two.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

TOKEN = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?[fL]?|[A-Za-z_]\w*|->|[^\s\w]")
TYPES = {"double", "float", "void", "int", "Scalar", "casadi_real", "casadi_int", "const", "restrict", "return"}
KINDS = {"+": "add", "-": "add", "*": "mul", "/": "div"}


@dataclass(frozen=True)
class Count:
    """Operations of one call."""

    add: int
    mul: int
    div: int
    sincos: int

    @property
    def operations(self) -> int:
        """All but sincos."""
        return self.add + self.mul + self.div


def count(text: str) -> Count:
    """Count a text without loops."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*|^\s*#[^\n]*", " ", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"\[[^\[\]]*\]", "", text)
    tokens = TOKEN.findall(text)
    found: Counter[str] = Counter()
    for place, word in enumerate(tokens):
        before = tokens[place - 1] if place else ""
        if word in KINDS and (before == ")" or re.match(r"[\w.]", before)) and before not in TYPES:
            found[KINDS[word]] += 1
        elif word in ("sin", "cos"):
            found[word] += 1
        elif word == "casadi_sq":
            found["mul"] += 1
        elif word == "pow":
            exponent = _exponent(tokens, place + 1)
            found["mul"] += max(abs(exponent) - 1, 0)
            found["div"] += exponent < 0
    return Count(found["add"], found["mul"], found["div"], max(found["sin"], found["cos"]))


def _exponent(tokens: list[str], start: int) -> int:
    """The whole number that is the last argument of a call whose bracket opens at ``start``."""
    depth, last = 0, start
    for place in range(start, len(tokens)):
        depth += {"(": 1, ")": -1}.get(tokens[place], 0)
        if tokens[place] == "," and depth == 1:
            last = place
        if depth == 0:
            words = [t for t in tokens[last + 1 : place] if t not in ("Scalar", "(", ")", "double")]
            return int(float("".join(words)))
    raise ValueError("a call of pow does not end")
