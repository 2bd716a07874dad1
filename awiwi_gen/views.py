"""Views of a library: the kernels of one finger, or of another part such as the wrist, without its name before theirs."""

from __future__ import annotations

import operator
import re
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.errors import InputError, unknown

if TYPE_CHECKING:
    from awiwi_gen.library import KernelFunction, Library

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Names:
    """The names of a finger's joints that move independently, and of the tendons that motors pull, in their order."""

    joints: tuple[str, ...]
    tendons: tuple[str, ...]


def names_in(header: str, prefix: str) -> dict[str, Names]:
    """The fingers of a hand with their names, from the text of its hand.h; nothing where it lists none."""

    def listed(kind: str) -> tuple[str, ...]:
        found = re.findall(rf"^ +{prefix.upper()}_{kind}_(\w+),?$", header, re.MULTILINE)
        return tuple(name.lower() for name in found)

    tables = {name: (f"JOINT_{name.upper()}", f"TENDON_{name.upper()}") for name in listed("FINGER")}
    return {finger: Names(listed(joints), listed(tendons)) for finger, (joints, tendons) in tables.items()}


class OnDemand(Mapping[str, "KernelFunction"]):
    """Kernels by their names, each made when it is first asked for: to make hundreds takes longer than to load NumPy."""

    def __init__(self, makers: Mapping[str, Callable[[], KernelFunction]]) -> None:
        self._makers, self._made = makers, dict[str, "KernelFunction"]()

    def __getitem__(self, name: str) -> KernelFunction:
        return self._made.get(name) or self._made.setdefault(name, self._makers[name]())

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


class Kernels(Mapping[str, "KernelFunction"]):
    """Kernels by their names, as attributes or items; what has them says in ``_unknown`` that one is missing."""

    _kernels: Mapping[str, KernelFunction]

    def __getattr__(self, name: str) -> KernelFunction:
        try:
            return self.__dict__["_kernels"][name]  # type: ignore[no-any-return]
        except KeyError:
            raise AttributeError(self._unknown(name)) from None

    def __getitem__(self, name: str) -> KernelFunction:
        try:
            return self._kernels[name]
        except KeyError:
            raise KeyError(self._unknown(name)) from None

    @abstractmethod
    def _unknown(self, name: str) -> str:
        """The message for a name that is none."""

    def __iter__(self) -> Iterator[str]:
        return iter(self._kernels)

    def __len__(self) -> int:
        return len(self._kernels)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._kernels]


class PartView(Kernels):
    """The kernels of a library whose names begin with that of a part, by the rest of their names: attributes or items."""

    def __init__(self, library: Library, name: str) -> None:
        self.library, self.name = library, name
        before = f"{name}_"
        own = (key for key in library if key.startswith(before))
        self._kernels = OnDemand({key.removeprefix(before): partial(library.__getitem__, key) for key in own})

    def __repr__(self) -> str:
        return f"<part {self.name}: {len(self)} kernels>"

    def __reduce__(self) -> tuple[Any, ...]:
        return operator.methodcaller("part", self.name), (self.library,)

    def _unknown(self, name: str) -> str:
        known = self.__dict__.get("_kernels", ())
        return str(unknown(f"kernel of {self.__dict__.get('name')}", name, known, "see its keys()"))


class FingerView(PartView):
    """One finger: its kernels, the names of its joints and tendons, and their limits.

    ``finger.mass_matrix(q)`` is ``lib.index_mass_matrix(q)``. Arrays of joints and tendons have the order of the names.
    """

    def __init__(self, library: Library, name: str) -> None:
        super().__init__(library, name)
        self.joints = library.names[name].joints
        self.tendons = library.names[name].tendons

    def __repr__(self) -> str:
        return (
            f"<finger {self.name}: joints {', '.join(self.joints)}; {len(self.tendons)} tendons; {len(self)} kernels>"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return operator.methodcaller("finger", self.name), (self.library,)

    @property
    def joint_limits(self) -> tuple[Array, Array]:
        """The lowest and highest angles (joints,) of the joints in rad, of slides in m."""
        return self.limits("q")

    @property
    def velocity_limits(self) -> tuple[Array, Array]:
        """The lowest and highest velocities (joints,) of the joints in rad/s, of slides in m/s."""
        return self.limits("qd")

    @property
    def torque_limits(self) -> tuple[Array, Array]:
        """The lowest and highest torques (joints,) of the joints in N m, forces of slides in N."""
        return self.limits("tau")

    @property
    def force_limits(self) -> tuple[Array, Array]:
        """The lowest and highest forces (tendons,) of the tendons in N."""
        return self.limits("f")

    def limits(self, port: str) -> tuple[Array, Array]:
        """The ends of the range of an input, as the kernels of the finger state it. Raises InputError where none has it."""
        for kernel in self._kernels.values():
            for found in kernel.inputs:
                if found["name"] == port:
                    low, high = (np.reshape(found[end], found["shape"]) for end in ("low", "high"))
                    return low, high
        raise InputError(f"finger {self.name}: no kernel of this library has an input {port}; generate more of them")

    def by_joint(self, values: Any) -> dict[str, Array]:
        """An array (..., joints) as one array (...) for each joint, by its name."""
        return self._labelled(values, self.joints, "joints")

    def by_tendon(self, values: Any) -> dict[str, Array]:
        """An array (..., tendons) as one array (...) for each tendon, by its name."""
        return self._labelled(values, self.tendons, "tendons")

    def _labelled(self, values: Any, names: tuple[str, ...], kind: str) -> dict[str, Array]:
        array = np.asarray(values)
        if array.shape[-1:] != (len(names),):
            raise InputError(f"finger {self.name}: shape {array.shape}; expected (..., {len(names)}), its {kind}")
        return {name: array[..., place] for place, name in enumerate(names)}
