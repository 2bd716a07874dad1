"""Pinocchio: its C++ library, out of the wheel, called from C++; it computes with a model at run time.

Its templates can also be compiled here with other flags, and with CasADi's scalars to generate code. Either takes minutes
and gigabytes for one file, so it is not done.
"""

from __future__ import annotations

import sysconfig
from pathlib import Path
from typing import Any

from bench.peers.eigen import eigen_include
from bench.peers.kit import Contender

DEFINES = (
    "-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",  # the algorithms as the wheel has compiled them
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
// Arrays of the types that the library is compiled for.
static Eigen::VectorXd position(N), velocity(N), third(N);
static pinocchio::Data::Matrix6x columns = pinocchio::Data::Matrix6x::Zero(6, N);
static const Eigen::VectorXd &filled(Eigen::VectorXd &v, const double *x)
{
    for (int i = 0; i < N; i++) v[i] = x[i];
    return v;
}
static void store(const Eigen::VectorXd &v, double *x) { for (int i = 0; i < N; i++) x[i] = v[i]; }
static void mass(const Eigen::VectorXd &q, double *M)
{
    pinocchio::crba(model, data, q, pinocchio::Convention::LOCAL);
    for (int i = 0; i < N; i++) for (int j = i; j < N; j++) M[N*i + j] = M[N*j + i] = data.M(i, j);
}
static void fall(const double *g) { for (int i = 0; i < 3; i++) model.gravity.linear()[i] = g[i]; }
"""

Q, QD = "filled(position, q)", "filled(velocity, qd)"
BODIES = {
    "mass_matrix": f"    mass({Q}, M);",
    "inverse_dynamics": f"    fall(g); store(pinocchio::rnea(model, data, {Q}, {QD}, filled(third, qdd)), tau);",
    "bias": f"    fall(g); store(pinocchio::nonLinearEffects(model, data, {Q}, {QD}), bias);",
    "forward_dynamics": f"""    fall(g);
    const auto local = pinocchio::Convention::LOCAL;
    store(pinocchio::aba(model, data, {Q}, {QD}, filled(third, tau), local), qdd);""",
    "pose_jacobian": f"""    pinocchio::computeJointJacobians(model, data, {Q});
    const pinocchio::SE3 &pose = pinocchio::updateFramePlacement(model, data, tip);
    pinocchio::getFrameJacobian(model, data, tip, pinocchio::LOCAL_WORLD_ALIGNED, columns);
    for (int i = 0; i < 6; i++) for (int j = 0; j < N; j++) J[N*i + j] = columns(i, j);
    for (int i = 0; i < 3; i++) for (int j = 0; j < 3; j++) T[4*i + j] = pose.rotation()(i, j);
    for (int i = 0; i < 3; i++) T[4*i + 3] = pose.translation()[i], T[12 + i] = 0;
    T[15] = 1;""",
    "dynamics": f"""    fall(g); mass({Q}, M);
    const auto &coriolis = pinocchio::computeCoriolisMatrix(model, data, position, {QD});
    for (int i = 0; i < N; i++) for (int j = 0; j < N; j++) C[N*i + j] = coriolis(i, j);
    store(pinocchio::computeGeneralizedGravity(model, data, position), gravity);""",
}


def main(finger: dict[str, Any], directory: Path) -> None:
    """All quantities but our tendons' stiffness, which it does not compute."""
    import pinocchio

    contender = Contender("pinocchio", pinocchio.__version__, directory, language="c++", counted=False)
    contender.flags, contender.variants = include_flags(), ["portable"]
    folder = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "lib"
    contender.libraries = [str(folder / "libpinocchio_default.so"), f"-Wl,-rpath,{folder}"]
    contender.note = "C++ library as in its wheel; a model at run time"
    (directory / "finger.txt").write_text(numbers(finger), encoding="utf-8")
    contender.environment, contender.kept = {"BENCH_FINGER": str((directory / "finger.txt").resolve())}, True
    contender.adapt(PRELUDE + GLOBALS, BODIES)
