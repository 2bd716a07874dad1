"""The comparison with the peers can be trusted: it counts by its rule, compares the same, finds faults."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import awiwi_gen
from awiwi_gen.hand import Hand
from bench import hands, skew
from bench.counts import count
from bench.generation import STAGES
from bench.measure import Driver, called_costs
from bench.objects import build, code_bytes
from bench.ours import kernels_of
from bench.peers.formulas import outputs
from bench.peers.recursion import Algebra
from bench.quantities import QUANTITIES, SIZES

ROOT = Path(__file__).resolve().parent.parent
PLAIN = Algebra(math.cos, math.sin)


@pytest.mark.parametrize(
    ("text", "operations"),
    [
        ("x = a*b + c;", 2),
        ("x = -a - -b;", 1),
        ("x[2*i + 1] = q[1 + 2];", 0),
        ("const double *x, double *restrict y;", 0),
        ("x = 1e-05*a + 2.5E+3;", 2),
        ("x = std::pow(a + b, Scalar(3)) / c;", 4),
        ("x = pow(y, -1);", 1),
        ("a0 = casadi_sq(a1); /* a*b */ // a + b", 1),
        ("x = static_cast<Scalar>(0.5) * std::cos(v1);", 1),
    ],
)
def test_operations_are_counted_by_the_stated_rule(text, operations):
    assert count(text).operations == operations


def test_a_sine_and_a_cosine_are_one_sincos():
    assert count("c = cos(q); s = sin(q); d = sin(2.0*q);").sincos == 2


@pytest.mark.parametrize("kernel", ["mass_matrix", "inverse_dynamics", "forward_dynamics", "joint_stiffness"])
def test_the_rule_counts_what_the_generator_says_of_its_own_code(kernel):
    text = (ROOT / "generated" / f"index_{kernel}.c").read_text(encoding="utf-8")
    said = {name: int(number) for number, name in re.findall(r"(\d+) (add|mul|div)", text.split("Cost:")[1][:80])}
    counted = count(text[text.index("\n{") :])

    assert {name: getattr(counted, name) for name in said} == said
    assert counted.operations == sum(said.values())


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_our_side_links_with_our_sine_alone(quantity):
    present = {path.stem for path in (ROOT / "generated").glob("index_*.c")}
    chosen = kernels_of(quantity, present)
    texts = "".join((ROOT / "generated" / f"{name}.c").read_text(encoding="utf-8") for name in chosen)
    called = set(re.findall(r"(awiwi_\w+)\(", texts)) - {f"awiwi_{name}" for name in chosen}

    assert all(name.startswith("awiwi_sincos") for name in called)


def ours(lib, quantity, x):
    """What our kernels give, as outputs by name."""
    if quantity == "tendons":  # by kernels of their own, whatever combined ones there are
        return {"tau": lib.index_joint_torque(x["q"], x["f"]), "K": lib.index_joint_stiffness(x["q"], x["f"], x["k"])}
    if quantity == "pose_jacobian":
        return {"T": lib.index_fingertip_pose(x["q"]), "J": lib.index_jacobian(x["q"])}
    found = lib[f"index_{quantity}"](*(x[port] for port in QUANTITIES[quantity].inputs))
    names = list(QUANTITIES[quantity].outputs)
    return {names[0]: found} if len(names) == 1 else {name: getattr(found, name) for name in names}


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_peers_are_given_the_same_finger(lib, quantity):
    finger = hands.spec(hands.packaged())
    draw = np.random.default_rng(3)
    x = {port: draw.uniform(*finger["ranges"][port], SIZES[port]) for port in QUANTITIES[quantity].inputs}
    theirs = outputs(quantity, finger, {port: list(map(float, values)) for port, values in x.items()}, PLAIN)

    for port, values in ours(lib, quantity, x).items():
        assert np.ravel(values) == pytest.approx(theirs[port], rel=1e-12, abs=1e-13 * np.abs(values).max()), port


def test_the_random_hand_is_the_same_every_time_and_has_no_zeros(tmp_path):
    first, second = (hands.spec(hands.random_hand(tmp_path / f"{n}.toml")) for n in (1, 2))

    assert first == second
    assert all(x for link in first["links"] for x in [*link["offset"], *link["com"], *np.ravel(link["inertia"])])


def contender(directory: Path, name: str, entry: str) -> dict:
    """A kernel whose mass matrix has 16 times the same entry."""
    (directory / name).mkdir()
    body = f"for (int i = 0; i < 16; i++) M[i] = {entry};"
    (directory / name / "m.c").write_text(f"void m_{name}(const double *q, double *M) {{ {body} }}")
    kernel = {"sources": ["m.c"], "calls": [[f"m_{name}", ["q"], ["M"]]]}
    table = {"name": name, "language": "c", "directory": str(directory / name), "flags": [], "libraries": []}
    return {**table, "kernels": {"mass_matrix": kernel}}


def test_who_disagrees_is_named(tmp_path):
    entries = {"one": "2*q[0]", "two": "q[0] + q[0]", "wrong": "2*q[0]*(1 + 1e-11)", "absent": "0/(q[0] - q[0])"}
    built = [build(contender(tmp_path, name, entry), "portable") for name, entry in entries.items()]
    checks = Driver(tmp_path, built, hands.spec(hands.packaged())["ranges"]).disagreements()

    assert {check["contender"]: check["agrees"] for check in checks} == {
        "one": True,
        "two": True,
        "wrong": False,
        "absent": False,
    }


def test_what_does_not_compile_is_told_not_raised(tmp_path):
    assert "error" in build(contender(tmp_path, "broken", "nonsense"), "portable").problem


def test_code_is_measured_by_its_symbol(tmp_path):
    built = build(contender(tmp_path, "one", "q[0]"), "portable")
    object_ = built.path.parent / "m.c.o"

    assert built.bytes["mass_matrix"] == code_bytes(object_, ["m_one"]) > 0
    assert code_bytes(object_, ["another"]) == 0


def test_costs_of_calls_are_read_from_the_profile():
    profile = (
        "ob=(1) /a.so|fn=(1) loop_bias|3 10|cob=(2) /b.so|cfn=(2) sin|calls=4 7|3 400|"
        "cfn=(3) kernel|calls=1 9|3 60|ob=(2)|fn=(2)|7 400||ob=(1)|fn=(1)|3 5"
    ).replace("|", "\n")

    assert called_costs(profile) == {("/a.so", "loop_bias"): 460}


def test_the_finger_given_to_peers_is_plain_data():
    finger = hands.spec(hands.packaged())

    assert json.loads(json.dumps(finger)) == finger


def test_peers_get_the_same_skew_finger_as_we():
    hand = Hand.parse(skew.skew_hand(2))
    lib, q = awiwi_gen.build(hand, only="index_mass_matrix"), [0.3, -0.2]
    theirs = outputs("mass_matrix", skew.plain_finger(hand), {"q": q}, PLAIN)["M"]

    np.testing.assert_allclose(np.reshape(theirs, (2, 2)), lib.index_mass_matrix(q), rtol=1e-13)


def test_the_stages_of_a_run_are_timed(root, tmp_path):
    words = [sys.executable, "-c", STAGES, str(root / "tests" / "one_finger.toml"), str(tmp_path / "made")]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    times = {stage: processors for stage, _, processors in json.loads(done.stdout)}

    assert len(times) == 8
    assert all(seconds >= 0 for seconds in times.values())
    assert times["compile, link, load"] > 0
