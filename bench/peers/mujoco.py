"""MuJoCo: its C library, out of the wheel, driven by a small C program; it computes with a model at run time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco

from bench.peers.kit import Contender
from bench.quantities import JOINTS


def model_xml(finger: dict[str, Any]) -> str:
    """The finger in MuJoCo's format: nested bodies, hinges about z, full inertias, a site at the tip."""
    opened, offset = "", [0.0, 0.0, 0.0]
    for number, link in enumerate(finger["links"]):
        turn, i = link["turn"], link["inertia"]
        axes = [turn[row][0] for row in range(3)] + [turn[row][1] for row in range(3)]
        entries = [i[0][0], i[1][1], i[2][2], i[0][1], i[0][2], i[1][2]]
        opened += (
            f'<body pos="{_text(offset)}" xyaxes="{_text(axes)}"><joint name="j{number}" type="hinge" axis="0 0 1"/>'
        )
        opened += f'<inertial pos="{_text(link["com"])}" mass="{link["mass"]!r}" fullinertia="{_text(entries)}"/>'
        offset = link["offset"]
    closed = "</body>" * len(finger["links"])
    return f'<mujoco><worldbody>{opened}<site name="tip" pos="{_text(offset)}"/>{closed}</worldbody></mujoco>'


def _text(numbers: list[float]) -> str:
    return " ".join(map(repr, numbers))


PRELUDE = """#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
enum {{ N = {n} }};
static mjModel *m;
static mjData *d;
__attribute__((constructor)) static void setup(void)
{{
    char error[1000] = "";
    m = mj_loadXML("{xml}", 0, error, sizeof error);
    if (!m) {{ fprintf(stderr, "mujoco: %s\\n", error); exit(1); }}
    d = mj_makeData(m);
}}
static void position(const double *q) {{ memcpy(d->qpos, q, N*sizeof *q); mj_kinematics(m, d); mj_comPos(m, d); }}
static void velocity(const double *qd) {{ memcpy(d->qvel, qd, N*sizeof *qd); mj_comVel(m, d); }}
static void fall(const double *g) {{ memcpy(m->opt.gravity, g, 3*sizeof *g); }}
"""

BODIES = {
    "mass_matrix": "    position(q); mj_crb(m, d); mj_fullM(m, d, M);",
    "inverse_dynamics": """    fall(g); position(q); velocity(qd);
    memcpy(d->qacc, qdd, N*sizeof *qdd);
    mj_rne(m, d, 1, tau);""",
    "bias": "    fall(g); position(q); velocity(qd); mj_rne(m, d, 0, bias);",
    "forward_dynamics": """    double load[N];
    fall(g); position(q); mj_crb(m, d); mj_factorM(m, d); velocity(qd); mj_rne(m, d, 0, load);
    for (int i = 0; i < N; i++) load[i] = tau[i] - load[i];
    mj_solveM(m, d, qdd, load, 1);""",
    "pose_jacobian": """    position(q);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) T[4*i + j] = d->site_xmat[3*i + j];
        T[4*i + 3] = d->site_xpos[i];
        T[12 + i] = 0;
    }
    T[15] = 1;
    mj_jacSite(m, d, J, J + 3*N, 0);""",
}


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities but the Coriolis matrix and our tendons' stiffness, which it does not compute."""
    package = Path(mujoco.__file__).parent
    (library,) = package.glob("libmujoco.so.*")
    xml = directory.resolve() / "finger.xml"
    xml.write_text(model_xml(finger), encoding="utf-8")
    contender = Contender("mujoco", mujoco.__version__, directory, counted=False, variants=["portable"])
    contender.flags = [f"-I{package / 'include'}"]
    contender.libraries = [str(library), f"-Wl,-rpath,{package}"]
    contender.note = "C library as in its wheel; a model at run time"
    contender.adapt(PRELUDE.format(n=JOINTS, xml=xml), BODIES)
