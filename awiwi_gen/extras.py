"""The libraries that a small install lacks, and the error that says how to get them.

`pip install awiwi_gen` brings what loads and calls generated C. The extras in `pyproject.toml` bring the rest.
"""

from __future__ import annotations

from importlib.util import find_spec

from awiwi_gen.errors import MissingExtraError

ORDER = ("cli", "generate", "studies", "cluster")  # each includes those before it
INTERCHANGE = "interchange"  # beside studies, includes generate
BROWSER = "browser"  # beside cluster, includes studies
LEARN = "learn"  # beside all others
# The module, the package that has it, and the extra that installs it.
EXTRAS = {
    "casadi": ("casadi", "generate"),
    "flint": ("python-flint", "generate"),
    "fmpy": ("fmpy", INTERCHANGE),
    "gymnasium": ("gymnasium", LEARN),
    "jinja2": ("jinja2", "generate"),
    "pydantic": ("pydantic", "cli"),
    "sympy": ("sympy", "generate"),
    "tree_sitter": ("tree-sitter", "generate"),
    "tree_sitter_toml": ("tree-sitter-toml", "generate"),
    "typer": ("typer", "cli"),
    "ziglang": ("ziglang", BROWSER),
    "distributed": ("distributed", "cluster"),
    "matplotlib": ("matplotlib", "studies"),
    "mujoco": ("mujoco", INTERCHANGE),
    "scipy": ("scipy", "studies"),
}
COMMAND_LINE = ("typer", "pydantic")
HAND = ("pydantic", "tree_sitter", "tree_sitter_toml")  # to read a hand file
GENERATE = ("casadi", "flint", "jinja2", "sympy", *HAND)  # to derive, emit and prove


def require(purpose: str, *modules: str) -> None:
    """Raise MissingExtraError, naming every package that is missing, unless all modules are installed."""
    if absent := missing(purpose, *modules):
        raise MissingExtraError(absent)


def missing(purpose: str, *modules: str) -> str:
    """The sentence about those modules that are not installed, or nothing."""
    absent = [EXTRAS[module] for module in modules if find_spec(module) is None]
    packages = [package for package, _ in absent]
    extra = max((extra for _, extra in absent), key=(*ORDER, INTERCHANGE, BROWSER, LEARN).index, default="")
    listed = " and ".join([", ".join(packages[:-1])] * (len(packages) > 1) + packages[-1:])
    them = "it" if len(packages) == 1 else "them"
    return f"{purpose} needs {listed}; install {them}: pip install 'awiwi_gen[{extra}]'" if absent else ""
