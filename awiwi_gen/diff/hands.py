"""The two hands that are compared: hand files, or revisions of one file that git keeps."""

from __future__ import annotations

import shutil
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.resources import gains_beside

_SECONDS = 60  # for git to answer


def both(old: str, new: str, file: Path | None) -> tuple[tuple[str, Hand], tuple[str, Hand]]:
    """The old and the new hand, each with what messages call it.

    With ``file``, the texts are revisions of it: an empty new one is the file as it is, an empty old one HEAD. Without,
    they are hand files. Raises InputError where one of them is missing, unreadable or has faults.
    """
    if file is None:
        if not old or not new:
            raise InputError("diff compares two hand files; for revisions of one, name it with --hand FILE")
        return _of_file(old), _of_file(new)
    first = _at_revision(old or "HEAD", file)
    return first, _at_revision(new, file) if new else (str(file), Hand.load(file))


def _of_file(name: str) -> tuple[str, Hand]:
    if not Path(name).exists():
        raise InputError(f"{name} is no file; if it is a revision, name the hand file with --hand FILE")
    return name, Hand.load(name)


def _at_revision(revision: str, file: Path) -> tuple[str, Hand]:
    """The hand of a file as git has it in a revision, and its name, with the file of gains of then."""
    shown = f"{revision}:{file.name}"
    folder = file.parent
    commit = _git(folder, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    if commit is None:
        inside = _git(folder, "rev-parse", "--git-dir") is not None
        where = f"the git repository of {file} has no such revision" if inside else f"{file} is in no git repository"
        files = "; to compare two files, leave out --hand" if Path(revision).is_file() else ""
        raise InputError(f"{revision}: {where}{files}")
    text = _git(folder, "show", f"{commit.decode().strip()}:./{file.name}")
    if text is None:
        raise InputError(f"{revision} has no file {file}")
    with TemporaryDirectory() as scratch:
        copy = Path(scratch) / file.name
        copy.write_bytes(text)
        name = _included(text) or gains_beside(copy).name
        if gains := _git(folder, "show", f"{commit.decode().strip()}:./{name}"):
            beside = copy.parent / name
            beside.parent.mkdir(parents=True, exist_ok=True)
            beside.write_bytes(gains)
        try:
            return shown, Hand.load(copy)
        except InputError as error:
            named = [
                replace(fault, file=fault.file and fault.file.replace(f"{scratch}/", f"{revision}:"))
                for fault in error.faults
            ]
            raise InputError(named, error.hidden) from None


def _included(text: bytes) -> str:
    """The name of the file of gains that a hand file names, if it is below the hand file's folder."""
    try:
        name = tomllib.loads(text.decode("utf-8-sig")).get("gains")
    except (ValueError, RecursionError):
        return ""  # reading the hand says it better
    inside = isinstance(name, str) and not Path(name).is_absolute() and ".." not in Path(name).parts
    return str(name) if inside else ""


def _git(folder: Path, *words: str) -> bytes | None:
    """What git prints, or None where it fails. Raises InputError where there is no git, or no such folder."""
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder")
    program = shutil.which("git")
    if program is None:
        raise InputError("git is not installed; without it, compare two files: awiwi-gen diff OLD.toml NEW.toml")
    try:
        done = subprocess.run([program, *words], cwd=folder, capture_output=True, check=False, timeout=_SECONDS)
    except subprocess.TimeoutExpired:
        raise InputError(f"git {words[0]} does not answer") from None
    return done.stdout if done.returncode == 0 else None
