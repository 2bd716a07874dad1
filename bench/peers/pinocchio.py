"""Pinocchio: its C++ from the headers of the wheel, compiled with -DNDEBUG; it computes with a model at run time."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Any

import cmeel

from bench.peers.kit import Contender
from bench.quantities import JOINTS

PRELUDE = """#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/rnea.hpp>
using namespace pinocchio;
enum {{ N = {n} }};
typedef Eigen::Map<const Eigen::Matrix<double, N, 1>> In;
typedef Eigen::Map<Eigen::Matrix<double, N, 1>> Out;
typedef Eigen::Map<Eigen::Matrix<double, N, N, Eigen::RowMajor>> Square;
static Model finger()
{{
    Model m;
    Eigen::Matrix3d R, I;
    Eigen::Vector3d p, c;
    JointIndex last = 0;
{links}
    p << {tip};
    m.addFrame(Frame("tip", last, 0, SE3(Eigen::Matrix3d::Identity(), p), OP_FRAME));
    return m;
}}
static Model m = finger();
static Data d(m);
static const FrameIndex tip = m.getFrameId("tip");
static void fall(const double *g) {{ m.gravity.linear() << g[0], g[1], g[2]; }}
"""

BOOST = {  # as its CMake files say
    "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS": "1",
    "BOOST_MPL_LIMIT_LIST_SIZE": "30",
    "BOOST_MPL_LIMIT_VECTOR_SIZE": "30",
    "BOOST_FUSION_INVOKE_MAX_ARITY": "12",
}

BODIES = {
    "mass_matrix": """    crba(m, d, In(q), Convention::WORLD);
    Square{M} = d.M.selfadjointView<Eigen::Upper>();""",
    "inverse_dynamics": "    fall(g); Out{tau} = rnea(m, d, In(q), In(qd), In(qdd));",
    "bias": "    fall(g); Out{bias} = nonLinearEffects(m, d, In(q), In(qd));",
    "forward_dynamics": "    fall(g); Out{qdd} = aba(m, d, In(q), In(qd), In(tau), Convention::WORLD);",
    "pose_jacobian": """    computeJointJacobians(m, d, In(q));
    const SE3 &at = updateFramePlacement(m, d, tip);
    Eigen::Matrix<double, 6, N> whole = Eigen::Matrix<double, 6, N>::Zero();
    getFrameJacobian(m, d, tip, LOCAL_WORLD_ALIGNED, whole);
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{T} = at.toHomogeneousMatrix();
    Eigen::Map<Eigen::Matrix<double, 6, N, Eigen::RowMajor>>{J} = whole;""",
    "dynamics": """    const Eigen::Matrix<double, N, 1> x = In(q), v = In(qd);
    fall(g);
    crba(m, d, x, Convention::WORLD);
    Square{M} = d.M.selfadjointView<Eigen::Upper>();
    Square{C} = computeCoriolisMatrix(m, d, x, v);
    Out{gravity} = computeGeneralizedGravity(m, d, x);""",
}


def model(finger: dict[str, Any]) -> tuple[str, str]:
    """The statements that add all links, and the place of the tip after the last."""
    lines, offset = [], [0.0, 0.0, 0.0]
    for number, link in enumerate(finger["links"]):
        lines.append(f"    R << {_text(chain(*link['turn']))}; p << {_text(offset)};")
        lines.append(f"    c << {_text(link['com'])}; I << {_text(chain(*link['inertia']))};")
        lines.append(f'    last = m.addJoint(last, JointModelRZ(), SE3(R, p), "j{number}");')
        lines.append(f"    m.appendBodyToJoint(last, Inertia({link['mass']!r}, c, I), SE3::Identity());")
        offset = link["offset"]
    return "\n".join(lines), _text(offset)


def _text(numbers: Iterable[float]) -> str:
    return ", ".join(repr(float(each)) for each in numbers)


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities but our tendons' stiffness, which it does not compute."""
    prefix = Path(cmeel.__file__).parent.parent / "cmeel.prefix"
    links, tip = model(finger)
    contender = Contender("pinocchio", version("libpinocchio"), directory, "c++", counted=False, variants=["portable"])
    contender.flags = ["-DNDEBUG", *(f"-D{name}={value}" for name, value in BOOST.items())]
    contender.flags += [f"-I{prefix / 'include'}", f"-I{prefix / 'include' / 'eigen3'}"]
    contender.note = "C++ templates of its wheel, with -DNDEBUG; a model at run time"
    contender.adapt(PRELUDE.format(n=JOINTS, links=links, tip=tip), BODIES)
