"""The comparison with the peers: build every contender for both hands, check, measure, print."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from bench import hands, objects, ours, tables
from bench.counts import count
from bench.measure import TOLERANCE, Driver
from bench.quantities import QUANTITIES

ROOT = Path(__file__).resolve().parent.parent
PEERS = ("casadi", "sympy", "symengine", "symforce", "wrenfold", "cppadcodegen", "mujoco", "pinocchio")
PYTHON = ROOT / ".venv-bench" / "bin" / "python"
MARKS = ("/* -- counted from here */", "/* -- to here */")


def run(directory: Path, rounds: int, peers: tuple[str, ...] = PEERS) -> tuple[dict[str, Any], bool]:
    """Everything as plain data, and whether all results agree."""
    found: dict[str, Any] = {}
    agreed = True
    (directory / "random").mkdir(parents=True, exist_ok=True)
    both = {"index": hands.packaged(), "random": hands.random_hand(directory / "random" / "hand.toml")}
    for name, hand in both.items():
        place = directory / name
        place.mkdir(parents=True, exist_ok=True)
        finger = hands.spec(hand)
        (place / "finger.json").write_text(json.dumps(finger), encoding="utf-8")
        print(f"{name}: generating ...", flush=True)
        contenders = ours.contenders(hand, place)
        for peer in peers:
            contenders += _peer(peer, place)
        found[name] = _measure(contenders, place, finger, rounds)
        agreed = agreed and found[name]["agreed"]
        tables.print_hand(name, found[name])
    return found, agreed


def _peer(peer: str, place: Path) -> list[dict[str, Any]]:
    """A peer's contender, or none and the reason."""
    directory = place / peer
    directory.mkdir(parents=True, exist_ok=True)
    command = [str(PYTHON), "-m", "bench.peers", peer, str(place / "finger.json"), str(directory)]
    environment = dict(os.environ) | {"PYTHONPATH": str(ROOT)}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, cwd=ROOT, env=environment, timeout=300, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        print(f"  {peer}: left out, {error}", flush=True)
        return []
    if done.returncode:
        print(f"  {peer}: left out, {(done.stderr.strip().splitlines() or ['it failed'])[-1]}", flush=True)
        return []
    contender: dict[str, Any] = json.loads((directory / "contender.json").read_text(encoding="utf-8"))
    contender["directory"] = str(directory)
    for name, kernel in contender["kernels"].items():
        quantity = QUANTITIES[name]
        kernel["sources"] = [kernel["source"]]
        kernel["calls"] = [[kernel["symbol"], list(quantity.inputs), list(quantity.outputs)]]
    return [contender]


def _measure(contenders: list[dict[str, Any]], place: Path, finger: dict[str, Any], rounds: int) -> dict[str, Any]:
    print("  compiling ...", flush=True)
    built = objects.build_all(contenders)
    for one in built:
        if one.problem:
            print(f"  {one.contender}, {one.variant}: left out, {one.problem}", flush=True)
    driver = Driver(place, [one for one in built if not one.problem], finger["ranges"])
    print("  comparing results ...", flush=True)
    checks = driver.disagreements()
    for check in checks:
        if not check["agrees"]:
            where = "{contender} ({variant}), {quantity}, output {port}".format(**check)
            print(f"  DISAGREEMENT: {where}: {check['worst']:.1e} from the median of all, allowed {TOLERANCE:.0e}")
    print("  measuring ...", flush=True)
    times, instructions = driver.times(rounds), driver.instructions()
    sizes = {(one.contender, one.variant): one.bytes for one in built}
    rows = []
    for quantity, name, variant in times:
        contender = next(c for c in contenders if c["name"] == name)
        ns, low, high = times[quantity, name, variant]
        row = {"quantity": quantity, "contender": name, "variant": variant, "ns": ns, "quartiles": [low, high]}
        row["instructions"] = instructions.get((quantity, name, variant))
        row["bytes"] = sizes[name, variant][quantity] if contender.get("counted", True) else None
        rows.append(row)
    return {
        "agreed": all(check["agrees"] for check in checks),
        "worst": max(check["worst"] for check in checks),
        "contenders": {c["name"]: {"version": c["version"], "note": c.get("note", "")} for c in contenders},
        "operations": {c["name"]: _operations(c, contenders) for c in contenders},
        "rows": rows,
        "checks": checks,
    }


def _operations(contender: dict[str, Any], contenders: list[dict[str, Any]]) -> dict[str, Any]:
    """Operations per quantity; for ours with its own sine those of the text that calls the library's."""
    if contender["name"].startswith("ours"):
        return {name: ours.operations(contenders[0], name) for name in contender["kernels"]}
    if not contender["counted"]:
        return {}
    counts = {}
    for name, kernel in contender["kernels"].items():
        text = (Path(contender["directory"]) / kernel["source"]).read_text(encoding="utf-8")
        counted = count(text.split(MARKS[0])[1].split(MARKS[1])[0])
        counts[name] = {**vars(counted), "operations": counted.operations}
    return counts
