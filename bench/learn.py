"""How fast fingers move for learning: `FingerVectorEnv` beside MuJoCo's `rollout`, one core each, and all cores.

python bench/learn.py [--envs 4096]

The index finger, driven by torques, at the clock's period, 60 steps of integration an action. MuJoCo gets the same
links, damping, places of (soft) stops and semi-implicit Euler, and computes in C: `mujoco.rollout`, one call an action;
ours is Python with one call of a kernel a step, and observations, rewards and resets besides. First both are asked for
the same motion between the stops. Runs alternate; medians of steps of one finger a second, of processor time on one
core, which others on the machine lengthen little, and of the wall's on all. Needs `make bench` once, for MuJoCo.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import load
from awiwi_gen.gym import Fingers, FingerVectorEnv, Physics
from awiwi_gen.hand import Hand
from bench.hands import FINGER, spec

ROOT = Path(__file__).resolve().parent.parent
AGREE = 1e-9  # rad
ROUNDS = 5

PEER = """
import json, sys, time
import mujoco, numpy as np
from mujoco import rollout
from bench.peers.mujoco import model_xml
task = json.loads(sys.stdin.readline())
xml = model_xml(task["finger"])
option = '<mujoco><option timestep="%r" gravity="%r %r %r"><flag eulerdamp="disable"/></option>'
xml = xml.replace("<mujoco>", option % (task["period"], *task["gravity"]))
for i, (low, high) in enumerate(task["stops"]):
    old = f'<joint name="j{i}" type="hinge" axis="0 0 1"/>'
    assert old in xml
    xml = xml.replace(old, old[:-2] + f' damping="{task["damping"]!r}" range="{low!r} {high!r}" limited="true"/>')
motors = "".join(f'<motor joint="j{i}"/>' for i in range(len(task["stops"])))
xml = xml.replace("<worldbody>", '<compiler angle="radian"/><worldbody>')
xml = xml.replace("</mujoco>", f"<actuator>{motors}</actuator></mujoco>")
model = mujoco.MjModel.from_xml_string(xml)
print(mujoco.__version__, flush=True)
for line in sys.stdin:
    ask = json.loads(line)
    q, qd, tau = (np.array(ask[name]) for name in ("q", "qd", "tau"))
    state = np.hstack([np.zeros((len(q), 1)), q, qd])
    control = np.repeat(tau[:, None], ask["steps"], axis=1)
    datas = [mujoco.MjData(model) for _ in range(ask["threads"])]
    cpu, wall = time.process_time(), time.perf_counter()
    end = rollout.rollout(model, datas, state, control)[0][:, -1] if len(datas) > 1 else \\
        rollout.rollout(model, datas[0], state, control)[0][:, -1]
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    n = q.shape[1]
    print(json.dumps({"cpu": cpu, "wall": wall, "q": end[:8, 1:1+n].tolist()}), flush=True)
"""


class Peer:
    """MuJoCo in a process of the peers' environment."""

    def __init__(self, python: str, fingers: Fingers) -> None:
        env = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
        self.process: Any = subprocess.Popen(
            [python, "-c", PEER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=env
        )
        self.stdin, self.stdout, physics = self.process.stdin, self.process.stdout, fingers.physics
        stops = np.hstack([fingers.low, fingers.high]).tolist()
        asked = {"period": physics.period, "gravity": list(physics.gravity), "damping": physics.damping}
        self._send(asked | {"finger": spec(Hand.load()), "stops": stops})
        self.version = self._line().strip()

    def run(self, q: Any, qd: Any, tau: Any, steps: int, threads: int) -> dict[str, Any]:
        """Move fingers (count, joints); processor's and wall's seconds, and where the first eight end."""
        self._send({"q": q.tolist(), "qd": qd.tolist(), "tau": tau.tolist(), "steps": steps, "threads": threads})
        answer: dict[str, Any] = json.loads(self._line())
        return answer

    def _send(self, message: Any) -> None:
        self.stdin.write(json.dumps(message) + "\n")
        self.stdin.flush()

    def _line(self) -> str:
        line = self.stdout.readline()
        if not line:
            raise SystemExit("MuJoCo's process ended; its message is above")
        return line


def require_agreement(library: Any, peer: Peer) -> float:
    """The largest difference of angles after five steps between the stops [rad]."""
    physics = Physics(substeps=5, effort=1e-4)
    fingers, random = Fingers(library.finger(FINGER), 8, physics), np.random.default_rng(1)
    q = ((fingers.low + fingers.high) / 2).T + random.uniform(-0.05, 0.05, (8, len(fingers.low)))
    actions, qd = random.uniform(-1, 1, q.shape), random.uniform(-0.5, 0.5, q.shape)
    fingers.q[:], fingers.qd[:] = q.T, qd.T
    fingers.drive(actions)
    theirs = peer.run(q, qd, physics.effort * actions * fingers.span[1], physics.substeps, 1)
    worst = float(np.abs(np.array(theirs["q"]) - fingers.q.T).max())
    if not worst < AGREE:
        raise SystemExit(f"MuJoCo's fingers end {worst:.1e} rad elsewhere")
    return worst


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser()
    options.add_argument("--envs", type=int, default=4096)
    options.add_argument(
        "--python", default=str(ROOT / ".venv-bench" / "bin" / "python"), help="an interpreter with MuJoCo"
    )
    given = options.parse_args()
    library = load(ROOT / "generated")
    library.vectorise_after = 0
    physics, random = Physics(), np.random.default_rng(2)
    envs = FingerVectorEnv(given.envs, library, FINGER, physics)
    fingers = envs._fingers[0]
    peer = Peer(given.python, fingers)
    print(f"the same motion: {require_agreement(library, peer):.1e} rad apart after 5 steps")
    count, cores = given.envs * physics.substeps, len(os.sched_getaffinity(0))
    envs.reset(seed=1)
    rows: dict[str, list[float]] = {}
    for turn in range(ROUNDS + 1):
        actions = random.uniform(-1, 1, (given.envs, len(fingers.low)))
        for threads in (1, cores):
            library.threads = threads
            q, qd = fingers.q.T.copy(), fingers.qd.T.copy()
            cpu, wall = time.process_time(), time.perf_counter()
            envs.step(actions)
            ours = {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall}
            theirs = peer.run(q, qd, physics.effort * actions * fingers.span[1], physics.substeps, threads)
            if turn:  # the first warms up
                kind = "cpu" if threads == 1 else "wall"
                for who, found in (("ours", ours), ("MuJoCo", theirs)):
                    rows.setdefault(f"{who}, {threads} threads", []).append(count / found[kind])
                rows.setdefault(f"ratio, {threads} threads", []).append(theirs[kind] / ours[kind])
    print(f"{given.envs} fingers, MuJoCo {peer.version}, load of the machine {os.getloadavg()[0]:.1f} on {cores} cores")
    for name, each in rows.items():
        print(f"{name:20} {statistics.median(each):14,.1f}   from {min(each):,.1f} to {max(each):,.1f}")
    peer.stdin.close()
    peer.process.wait()


if __name__ == "__main__":
    main()
