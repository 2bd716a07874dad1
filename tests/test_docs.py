"""What the documents say is so: the tests they name, the files, the code, the keys, the messages."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from actuators import AWIWI
from pydantic import BaseModel
from typer.testing import CliRunner

from awiwi_gen.__main__ import app
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.ir import passes
from awiwi_gen.verify import physics

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def names_in(path: Path) -> set[str]:
    return set(re.findall(r"^\s*def (test_\w+)", path.read_text(encoding="utf-8"), re.MULTILINE))


def flat(text: str) -> str:
    """Without indents, empty lines and remarks."""
    lines = (line.partition("  #")[0].strip() for line in text.splitlines())
    return "\n".join(line for line in lines if line)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_test_that_is_named_exists(document):
    known = set().union(*(names_in(path) for path in ROOT.glob("tests/test_*.py")))
    known |= {path.name for path in ROOT.glob("tests/*.py")} | {path.stem for path in ROOT.glob("tests/*.py")}

    assert [name for name in re.findall(r"`(test_\w+)", document.read_text()) if name not in known] == []


def test_every_claim_of_the_conventions_is_tested_where_it_says():
    for named in re.findall(r"\(`(test_[^)]*)\)", text("docs/conventions.md"), re.DOTALL):
        for claim in named.split(";"):
            file = re.search(r"`(tests/\w+\.py)`", claim)
            here = names_in(ROOT / (file[1] if file else "tests/test_conventions.py"))
            assert re.search(r"test_\w+", claim)[0] in here


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_file_that_is_named_exists(document):
    content = document.read_text()
    links = re.findall(r"\]\((?!http)([^)#]+)\)", content)
    paths = re.findall(r"`((?:awiwi_gen|tests|csrc|docs|examples|templates|bench|generated)/[\w/.]*)`", content)

    assert [link for link in links if not (document.parent / link).exists()] == []
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_the_central_types_of_the_map_are_where_it_says():
    rows = re.findall(r"^\| `(\w+)` \| `(awiwi_gen/[\w/.]+)` \|", text("docs/architecture.md"), re.MULTILINE)

    assert len(rows) >= 8
    for name, place in rows:
        path = ROOT / place
        files = path.rglob("*.py") if path.is_dir() else [path]
        assert any(re.search(rf"^class {name}\b", file.read_text(), re.MULTILINE) for file in files), name


def test_the_code_of_the_walk_through_is_the_code_of_the_project():
    sources = [flat(path.read_text()) for path in (ROOT / "awiwi_gen").rglob("*.py")]
    blocks = re.findall(r"```python\n(.*?)```", text("docs/adding_a_kernel.md"), re.DOTALL)

    assert len(blocks) > 5
    assert [block for block in blocks if not any(flat(block) in source for source in sources)] == []


def test_the_passes_and_laws_are_those_of_the_documents():
    table = text("docs/compiler.md")
    names = {apply.__name__ for way in (*passes.ORDERS, passes.ONCE, passes.FINAL) for apply in way} | {"bind"}

    assert {name for name in names if f"`{name}`" not in table} == set()
    assert physics.LIMIT == 1e-40


def keys_of(schema: type[BaseModel], seen: dict[str, set[str]]) -> dict[str, set[str]]:
    """The keys of a table and of all tables below it, by the name of their model."""
    for name, definition in schema.model_json_schema(by_alias=True)["$defs"].items():
        seen[name] = set(definition.get("properties", {}))
    return seen | {schema.__name__: {field.alias or name for name, field in schema.model_fields.items()}}


def test_every_key_of_the_hand_file_is_explained():
    explained = set(re.findall(r"`(\w+)`", text("docs/hand_file.md")))
    missing = {model: sorted(keys - explained) for model, keys in keys_of(Hand, {}).items()}

    assert {model: keys for model, keys in missing.items() if keys} == {}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"9 mm"', '"9 N"'),
        ('"9 mm"', '"9 MM"'),
        ('radius = "9 mm"', 'raduis = "9 mm"'),
        ('low = "-20 deg"', 'low = "40 deg"'),
        ('"30 mm"', '"30 m"'),
        ('"405 g mm^2"', '"4050 g mm^2"'),
        ('over = ["-mid"]', 'over = ["-mid", "+end"]'),
    ],
)
def test_the_messages_of_the_hand_file_are_printed_like_this(old, new):
    spoilt = ONE_FINGER.replace(old, new, 1)
    with pytest.raises(InputError) as caught:
        Hand.parse(spoilt)

    assert str(caught.value) in text("docs/hand_file.md")


def test_the_tables_of_diff_are_printed_like_this(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("hand.toml", "wider.toml"):
        (tmp_path / name).write_text(AWIWI, encoding="utf-8")
    edit, compare = re.findall(r"^\$ awiwi-gen ((?:set|diff) .*wider.toml)$", text("docs/diff.md"), re.MULTILINE)
    assert CliRunner().invoke(app, shlex.split(edit)).exit_code == 0
    said = CliRunner().invoke(app, shlex.split(compare)).stdout.splitlines()
    (block,) = re.findall(r"```\n(hand.toml -> .*?)```", text("docs/diff.md"), re.DOTALL)

    assert [line for line in block.splitlines() if line not in (*said, "...")] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_command_that_is_printed_has_its_options(document):
    for line in re.findall(r"^\$ (?:\.venv/bin/)?awiwi-gen (.*?)(?:  +#.*)?$", document.read_text(), re.MULTILINE):
        command, *words = shlex.split(line)
        known = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200", "TERM": "dumb"})
        assert known.exit_code == 0, command
        assert [word for word in words if word.startswith("-") and word not in known.output] == [], line
