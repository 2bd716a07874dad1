"""A palm on joints in series by its definition: transformations multiplied from the forearm to the palm."""

import sympy
from sympy import Matrix

from awiwi_gen.definitions.kinematics import Frame, axial, fixed_rotation, frames
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.structure import Palm


def pose(palm: Palm, q: Matrix) -> Matrix:
    """Pose (4 x 4) of the palm in the forearm."""
    return _palm(palm, q, Derivation()).matrix()


def jacobian(palm: Palm, q: Matrix) -> Matrix:
    """J (6 x n), in forearm axes: velocity [m/rad], then angular velocity [rad/rad] of the palm's frame."""
    derivation = Derivation()
    frame = _palm(palm, q, derivation)
    columns = []
    for angle in q:
        skew = frame.axes.applyfunc(lambda entry, angle=angle: derivation.partial(entry, angle)) * frame.axes.T
        columns.append([derivation.partial(x, angle) for x in frame.origin] + axial(skew))
    return Matrix(columns).T


def gravity(palm: Palm, q: Matrix, g_forearm: Matrix) -> Matrix:
    """A vector (3) of forearm axes in the palm's axes."""
    return _palm(palm, q, Derivation()).axes.T * g_forearm


def _palm(palm: Palm, q: Matrix, derivation: Derivation) -> Frame:
    """The palm's frame in the forearm."""
    base = Frame(sympy.eye(3), sympy.zeros(3, 1))
    if palm.base is not None:
        base = Frame(fixed_rotation(palm.base), Matrix(palm.base.position))
    end = frames(palm, q, derivation)[-1]
    return Frame(base.axes * end.axes * fixed_rotation(palm), base.point(end.origin))
