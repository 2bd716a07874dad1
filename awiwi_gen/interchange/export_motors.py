"""Motors in MJCF: forces on tendons, or shafts that wind tendons up through their elastic elements.

A shaft is a slide joint, the length of tendon that the motor has wound up; its actuator counts in angles and torques of
the motor. The tendon's length has the shaft's position in it, so that its spring is between motor and finger. At zero
the spring is at the slack end of its travel while all joints of the finger are at zero.
"""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.interchange.export import text
from awiwi_gen.interchange.fits import Fit, elongation_curve, spring_fit
from awiwi_gen.interchange.mjcf_elements import least_inertia
from awiwi_gen.interchange.model import LEAST_MASS, TRAVEL
from awiwi_gen.units import Quantity

__all__ = ["FORCE", "MOTORS", "POSITION", "TIMESTEP", "TORQUE", "Drives", "Lost", "Sections", "one_sided"]

FORCE, TORQUE, POSITION = MOTORS = ("force", "torque", "position")
TIMESTEP = "0.0001"  # [s]: springs of tendons on links of grams swing with kilohertz
Lost = dict[str, list[str]]
Sections = dict[str, Element]

_MOST = 10.0  # [m] below its rest length, a spring of MuJoCo would push
_LEG = 1.0  # [m] of a tendon through points between its shaft and the world, longer than any travel
_SHARE = 0.01  # of a motor's travel, or of 10 rad of a joint: the error at which a servo gives its full torque


def one_sided(rest: float) -> str:
    """The springlength of a spring that pulls beyond a length [m] and never pushes."""
    return text((rest - _MOST, rest))


class Drives:
    """Writes what pulls the tendons and turns the joints without tendons of a hand. Raises `InputError`."""

    def __init__(self, hand: Hand, motors: str, world: Element, sections: Sections, lost: Lost) -> None:
        if motors not in MOTORS:
            raise InputError(
                f"--motors {motors} is none of the export; expected {', '.join(MOTORS[:-1])} or {MOTORS[-1]}"
            )
        if motors == TORQUE and hand.motor is None and hand.tendons:
            fix = f"use --motors {FORCE} or {POSITION}"
            raise InputError(f"--motors {TORQUE}: the hand has no [motor] whose torque could pull its tendons; {fix}")
        self.hand, self.motors, self.world, self.sections, self.lost = hand, motors, world, sections, lost
        self.fits: dict[int | None, Fit] = {}  # by the number of the calibrated tendon, None for the design
        self._report()

    def _lose(self, what: str, place: str) -> None:
        self.lost.setdefault(what, []).append(place)

    def _report(self) -> None:
        motor, fibre = self.hand.motor, self.hand.tendon
        if self.motors == FORCE:
            for key in ("motor", "spring", "tendon"):
                if getattr(self.hand, key) is not None:
                    self._lose("mechanisms between motor and tendon: friction, ripple, lever springs, fibres", key)
            return
        if motor is not None and motor.ripple:
            self._lose("ripple of the motors' torque", "motor")
        if motor is not None:
            self._lose("dry friction of motors: a constraint, where the hand has a smooth curve", "motor")
        if fibre is not None:
            self._lose("friction of the fibres' guidings", "tendon")
        if self.motors == POSITION:
            self._lose("gains of servos: the hand has none, and the export chose stiff ones", "all motors")

    # -- joints ------------------------------------------------------------------------------------------------------

    def move(self, joint: str, effort: Quantity | None, slides: bool) -> None:
        """A motor in a joint of a finger without tendons; without an effort of its own, up to the hand's limit."""
        limits = self.hand.limits
        torque, range_ = (float(limits.slide_force or 0), TRAVEL) if slides else (float(limits.joint_torque), 10.0)
        torque = float(effort or torque)
        if self.motors == POSITION:
            SubElement(self.sections["actuator"], "position", name=f"{joint}.motor", joint=joint,
                       kp=text(torque / (range_ * _SHARE)), forcerange=text((-torque, torque)))  # fmt: skip
            return
        SubElement(self.sections["actuator"], "motor", name=f"{joint}.motor", joint=joint,
                   ctrlrange=text((-torque, torque)))  # fmt: skip

    # -- tendons -----------------------------------------------------------------------------------------------------

    def pull(self, written: list[Element], index: int, slack: float, two_way: bool = False) -> None:
        """What pulls a tendon of the hand, number `index`, which may be several of MuJoCo.

        `slack` is the length [m] without the finger's rest, joints at zero. A motor that pulls both ways also pushes.
        """
        fit = None if two_way else self._fit(index)
        if two_way and self.motors != FORCE and (self.hand.spring or self.hand.tendon):
            self._lose("springs of motors that pull both ways: they pull without", written[0].get("name", ""))
        if self.motors != FORCE and fit is not None and self.hand.motor is not None:
            if len(written) == 1:
                self._shaft(written[0], fit, slack)
                return
            self._lose("springs of tendons of arcs and lines: the motor pulls without", written[0].get("name", ""))
        for each in written:
            self._direct(each, two_way)

    def _fit(self, index: int) -> Fit | None:
        """Force over elongation of a tendon's spring and fibre; None where the hand has neither."""
        if self.motors == FORCE or (self.hand.spring is None and self.hand.tendon is None):
            return None
        calibrated = self.hand.spring.calibrated if self.hand.spring else {}
        key = index if index in calibrated else None
        if key not in self.fits:
            fibre, spring = self.hand.tendon, calibrated.get(index, self.hand.spring)
            own = None if fibre is None else float(fibre.modulus) * float(fibre.section) / float(fibre.length)
            if spring is None:
                self.fits[key] = Fit((0.0, own or 0.0), 0.0, 0.0)
            else:
                self.fits[key] = spring_fit(*elongation_curve(Lever(spring), own))
                name = "the design" if key is None else f"tendon {key}"
                what = "lever springs: the force is a polynomial of degree 3 over the elongation, and differs at most"
                self._lose(what, f"{name} by {self.fits[key].error:.2g} N")
        return self.fits[key]

    def _direct(self, element: Element, two_way: bool) -> None:
        """An actuator on the tendon itself: it pulls, and pushes only if it pulls both ways."""
        name, limits, back = element.get("name", ""), self.hand.limits, float(two_way)
        most = float(limits.tendon_force)
        if self.motors == POSITION:
            SubElement(self.sections["actuator"], "position", name=f"{name}.motor", tendon=name,
                       kp=text(float(limits.tendon_stiffness_high)), forcerange=text((-most, back * most)))  # fmt: skip
        elif self.motors == TORQUE and self.hand.motor is not None:
            SubElement(self.sections["actuator"], "motor", name=f"{name}.motor", tendon=name,
                       gear=text(-1 / float(self.hand.motor.pulley)),
                       ctrlrange=text(np.array([-back, 1]) * float(self.hand.motor.torque)))  # fmt: skip
        else:
            SubElement(self.sections["actuator"], "motor", name=f"{name}.motor", tendon=name, gear="-1",
                       ctrlrange=text((-back * most, most)))  # fmt: skip

    def _shaft(self, element: Element, fit: Fit, slack: float) -> None:
        """The motor's shaft winds up the tendon, which is a spring."""
        motor, name = self.hand.motor, element.get("name", "")
        if motor is None:
            raise ValueError("a shaft needs a motor")
        radius, torque, inertia = float(motor.pulley), float(motor.torque), motor.inertia
        friction = motor.friction
        body = SubElement(self.world, "body", name=f"{name}.rotor")
        least_inertia(body, {})
        SubElement(body, "joint", name=f"{name}.shaft", type="slide", axis="1 0 0",
                   armature=text(inertia / radius**2 - LEAST_MASS), damping=text(float(friction.viscosity) / radius**2),
                   frictionloss=text(float(friction.level) * math.pi / 2 / radius))  # fmt: skip
        if element.tag == "fixed":
            SubElement(element, "joint", joint=f"{name}.shaft", coef="1")
        else:
            SubElement(self.world, "site", name=f"{name}.anchor", pos=text((-_LEG, 0, 0)))
            SubElement(body, "site", name=f"{name}.end")
            leg = [Element("site", site=f"{name}.anchor"), Element("site", site=f"{name}.end")]
            if element[0].tag != "pulley":
                leg.append(Element("pulley", divisor="1"))
            for place, each in enumerate(leg):
                element.insert(place, each)
            slack += _LEG
        element.set("stiffness", text(np.array(fit.coefficients[1:])))
        element.set("springlength", one_sided(slack + fit.origin))
        gain = torque / (_SHARE * float(motor.travel))
        if self.motors == TORQUE:
            actuator = SubElement(self.sections["actuator"], "motor", ctrlrange=text((-torque, torque)))
        else:
            actuator = SubElement(self.sections["actuator"], "position", kp=text(gain),
                                  kv=text(2 * math.sqrt(gain * inertia)), forcerange=text((-torque, torque)))  # fmt: skip
        for key, word in (("name", f"{name}.motor"), ("joint", f"{name}.shaft"), ("gear", text(1 / radius))):
            actuator.set(key, word)
