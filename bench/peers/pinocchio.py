"""Pinocchio: its C++ headers, out of the wheel, compiled here with each variant's flags; a model at run time."""

from __future__ import annotations

import sysconfig
from pathlib import Path
from typing import Any

from bench.peers.eigen import eigen_include
from bench.peers.kit import Contender

DEFINES = (
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
)


def include_flags() -> list[str]:
    """Where the headers of Pinocchio, Boost and Eigen are. Raises FileNotFoundError."""
    prefix = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include"
    if not (prefix / "pinocchio" / "algorithm" / "rnea.hpp").exists():
        raise FileNotFoundError("the wheel of Pinocchio has no headers here")
    return [f"-I{prefix}", f"-I{eigen_include()}", *DEFINES]


def numbers(finger: dict[str, Any]) -> str:
    """The finger as lines of numbers, one per link: turn, offset, mass, com, inertia about it."""
    rows = []
    for link in finger["links"]:
        turn, inertia = ([x for row in link[key] for x in row] for key in ("turn", "inertia"))
        rows.append(" ".join(map(repr, [*turn, *link["offset"], link["mass"], *link["com"], *inertia])))
    return "\n".join(rows) + "\n"


PRELUDE = """#include <pinocchio/fwd.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/frames.hpp>
"""

GLOBALS = """#include <cstdlib>
#include <fstream>
enum { N = 4 };
static pinocchio::Model build()
{
    using namespace pinocchio;
    Model model;
    std::ifstream file(std::getenv("BENCH_FINGER"));
    double x[25];
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < N; i++) {
        for (double &number : x) file >> number;
        const Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(x), inertia(x + 16);
        const Eigen::Map<Eigen::Vector3d> com(x + 13);
        model.addJoint(i, JointModelRZ(), SE3(turn, offset), "j" + std::to_string(i));
        model.appendBodyToJoint(i + 1, Inertia(x[12], com, inertia), SE3::Identity());
        offset = Eigen::Map<Eigen::Vector3d>(x + 9);
    }
    model.addFrame(Frame("tip", N, SE3(Eigen::Matrix3d::Identity(), offset), OP_FRAME));
    return model;
}
static pinocchio::Model model = build();
static pinocchio::Data data(model);
static const pinocchio::FrameIndex tip = model.getFrameId("tip");
typedef Eigen::Map<const Eigen::Matrix<double, N, 1>> In;
typedef Eigen::Map<Eigen::Matrix<double, N, 1>> Out;
typedef Eigen::Map<Eigen::Matrix<double, N, N, Eigen::RowMajor>> Square;
static void mass(const double *q, double *M)
{
    pinocchio::crba(model, data, In(q), pinocchio::Convention::LOCAL);
    for (int i = 0; i < N; i++) for (int j = i; j < N; j++) M[N*i + j] = M[N*j + i] = data.M(i, j);
}
static void fall(const double *g) { model.gravity.linear() << g[0], g[1], g[2]; }
"""

BODIES = {
    "mass_matrix": "    mass(q, M);",
    "inverse_dynamics": "    fall(g); Out(tau) = pinocchio::rnea(model, data, In(q), In(qd), In(qdd));",
    "bias": "    fall(g); Out(bias) = pinocchio::nonLinearEffects(model, data, In(q), In(qd));",
    "forward_dynamics": "    fall(g); Out(qdd) = pinocchio::aba(model, data, In(q), In(qd), In(tau), "
    "pinocchio::Convention::LOCAL);",
    "pose_jacobian": """    Eigen::Matrix<double, 6, N> columns;
    columns.setZero();
    pinocchio::computeJointJacobians(model, data, In(q));
    const auto &pose = pinocchio::updateFramePlacement(model, data, tip);
    pinocchio::getFrameJacobian(model, data, tip, pinocchio::LOCAL_WORLD_ALIGNED, columns);
    Eigen::Map<Eigen::Matrix<double, 6, N, Eigen::RowMajor>>(J) = columns;
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(T) = pose.toHomogeneousMatrix();""",
    "dynamics": """    fall(g); mass(q, M);
    Square(C) = pinocchio::computeCoriolisMatrix(model, data, In(q), In(qd));
    Out(gravity) = pinocchio::computeGeneralizedGravity(model, data, In(q));""",
}


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities but our tendons' stiffness, which it does not compute."""
    import pinocchio

    contender = Contender("pinocchio", pinocchio.__version__, directory, language="c++", counted=False)
    contender.flags, contender.variants = include_flags(), ["portable", "avx2+fma"]
    contender.note = "C++ headers of its wheel, compiled here; a model at run time"
    (directory / "finger.txt").write_text(numbers(finger), encoding="utf-8")
    contender.environment, contender.kept = {"BENCH_FINGER": str((directory / "finger.txt").resolve())}, True
    contender.adapt(PRELUDE + GLOBALS, BODIES)
