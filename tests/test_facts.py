"""What commands know of a hand file without reading it: as fresh as the file, and no other than the hand itself says."""

import subprocess
import sys

import pytest

from awiwi_gen.cache import Cache
from awiwi_gen.errors import InputError
from awiwi_gen.facts import facts
from awiwi_gen.hand import Hand
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job
from tests.samples import ONE_FINGER as TEXT


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "hand.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_the_facts_are_those_of_the_hand(file, tmp_path):
    hand, known = Hand.load(file), facts(file, Cache(tmp_path / "cache"))

    assert known.digest == hand.digest()
    assert list(known.kernels) == [kernel.name for kernel in catalog(hand)]
    assert Job(hand, facts=known).inputs == Job(hand).inputs


def test_facts_that_were_kept_are_equal_and_need_no_schema(file, tmp_path):
    store = Cache(tmp_path / "cache")
    first = facts(file, store)
    code = (
        "import sys; from pathlib import Path; from awiwi_gen.cache import Cache; from awiwi_gen.facts import facts\n"
        f"print(facts(Path({str(file)!r}), Cache(Path({str(store.directory)!r}))).digest, 'pydantic' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert facts(file, store) == first
    assert done.stdout.split() == [first.digest, "False"]


def test_facts_follow_the_file_and_the_gains_beside_it(file, tmp_path):
    store = Cache(tmp_path / "cache")
    before = facts(file, store)
    file.write_text(TEXT.replace("name = ", "name = 'other' # ", 1), encoding="utf-8")

    assert facts(file, store) != before

    file.with_suffix(".gains.toml").write_text("no table", encoding="utf-8")

    with pytest.raises(InputError, match=r"gains\.toml"):
        facts(file, store)


def test_a_faulty_file_is_refused_each_time(file, tmp_path):
    file.write_text("prefix = 3", encoding="utf-8")
    for _ in range(2):
        with pytest.raises(InputError):
            facts(file, Cache(tmp_path / "cache"))


def test_a_job_refuses_a_hand_that_is_not_the_one_of_its_facts(file, tmp_path):
    known = facts(file, Cache(tmp_path / "cache"))
    with pytest.raises(InputError, match="changed during the run"):
        _ = Job(Hand.load, facts=known).hand
