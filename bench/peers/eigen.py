"""Where Eigen is: CasADi's wheel ships its headers, which Pinocchio's need."""

from __future__ import annotations

from pathlib import Path

import casadi


def eigen_include() -> Path:
    """The folder that has Eigen/Core. Raises FileNotFoundError."""
    for folder in (Path(casadi.__file__).parent / "include" / "eigen3", Path("/usr/include/eigen3")):
        if (folder / "Eigen" / "Core").exists():
            return folder
    raise FileNotFoundError("no Eigen headers, neither in CasADi's wheel nor in the system")
