"""Random legal hand files, by seed: fingers of one to eight links with every kind of part present or absent.

    hand(7)                            # text of a hand file; equal seeds give equal texts
    hand(7, links=8, features={"wrist"})

A seed chooses the features; `kinds` names those that a file has. What hand files refuse is drawn again.
"""

from __future__ import annotations

import json

import numpy as np
from random_links import Links

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand

FEATURES = (
    "wrist", "motor", "ripple", "spring", "units", "fibre", "gains",  # of the hand
    "four-bar", "four-bar without zero", "spans", "tensegrity", "couplings", "alike", "fewest", "crossed",  # of a finger
    "narrow range", "range without zero", "axial mass", "second finger", "skew axes", "references", "massless links",
    "rotors", "passive joints", "arms", "paths", "return strings", "ratios", "few tendons", "base", "palm",
)  # fmt: skip
SLIDES = "slides"  # drawn apart from the other features, so that hands without are what they were before there were any
TURNS = ("none", "none", "x+90", "x-90", "y+90", "y-90", "z+90", "z-90")
LINKS = (1, 2, 1, 3, 2, 4, 3, 5, 2, 4, 6, 8)  # most hands are small: eight links take a minute to derive
QUARTER = np.pi / 2


def hand(seed: int, links: int | None = None, features: set[str] | None = None) -> str:
    """The text of a legal hand file."""
    for attempt in range(200):
        random = np.random.default_rng([seed, attempt])
        chosen = {f for f in FEATURES if random.random() < 0.35} if features is None else features
        if features is None and np.random.default_rng([seed, attempt, 1]).random() < 0.2:
            chosen.add(SLIDES)
        text = _Writer(random, chosen).hand(LINKS[seed % len(LINKS)] if links is None else links)
        try:
            Hand.parse(text)
        except InputError:
            continue
        return text
    raise ValueError(f"no legal hand for seed {seed}")


def kinds(text: str) -> set[str]:
    """The features that a hand file has."""
    told = text.partition("\n")[0].removeprefix("# ")
    return set(told.split(", ")) if told else set()


class _Writer(Links):
    """Writes one hand."""

    # -- the hand ---------------------------------------------------------------------------------------------

    def hand(self, links: int) -> str:
        b = self.between
        fingers = [self.finger("one", links)]
        if self.wants("second finger"):
            fingers.append(self.finger("two", int(self.random.integers(1, 3))))
        tendons = sum(count for _, count in fingers)
        low = b(200, 2000)
        limits = f"""
[limits]
joint_velocity = "{b(5, 50):.3g} rad/s"
joint_acceleration = "{b(200, 5000):.4g} rad/s^2"
joint_torque = "{b(0.2, 5):.3g} N m"
tendon_force = "{b(20, 200):.4g} N"
tendon_stiffness_low = "{low:.4g} N/m"
tendon_stiffness_high = "{low * b(3, 60):.4g} N/m"
gravity = "{self.random.choice([9.81, 1.62])} m/s^2"
source = "assumed"
"""
        if SLIDES in self.used:
            most = f'slide_velocity = "{b(0.1, 1):.3g} m/s"\nslide_acceleration = "{b(5, 80):.3g} m/s^2"\n'
            limits = limits.replace("tendon_force", f'{most}slide_force = "{b(10, 200):.4g} N"\ntendon_force', 1)
        parts = "".join(text for text, _ in fingers) + (self.wrist(tendons) or self.palm()) + self.actuators(tendons)
        head = 'prefix = "claw"\nname = "Random hand"\n'
        return f"# {', '.join(sorted(self.used))}\n{head}{limits}{parts}"

    def wrist(self, tendons: int) -> str:
        if not self.wants("wrist"):
            return ""
        x, y, z = (self.scale * self.between(0.95, 1.05) * side for side in (50, 42, 36))
        rows = [
            f"    {{ forearm = {self.point((2, 6), (5, 36), (6, 30))}, "
            f"palm = {self.point((-6, -2), (-14, 18), (-12, 12))} }},\n"
            for _ in range(tendons)
        ]
        return f"""
[wrist]
a0 = ["0 mm", "{y / 2:.3f} mm", "{z:.3f} mm"]
a = ["{x:.3f} mm", "{round(y, 2) / 2:.3f} mm", "0 mm"]
b = ["{x:.3f} mm", "{round(y, 2):.3f} mm", "{z:.3f} mm"]
palm = ["{x:.3f} mm", "{y / 2:.3f} mm", "{z / 2:.3f} mm"]
q71 = {{ low = "-{self.between(5, 28):.3g} deg", high = "{self.between(5, 28):.3g} deg" }}
q73 = {{ low = "-{self.between(5, 18):.3g} deg", high = "{self.between(5, 18):.3g} deg" }}
source = "assumed"
tendons = [
{"".join(rows)}]
"""

    def palm(self) -> str:
        if not self.wants("palm"):
            return ""
        text = f'\n[palm]\nrpy = {self.turned()}\nsource = "assumed"\n'
        for number in range(int(self.random.integers(1, 4))):
            text += f"""
[[palm.joints]]
joint = "w{number}"
rpy = {self.turned()}
low = "{self.between(-60, -5):.4g} deg"
high = "{self.between(5, 60):.4g} deg"
offset = {self.point((5, 30), (-4, 4), (-4, 4))}
source = "assumed"
"""
        return text

    def actuators(self, tendons: int) -> str:
        b, text = self.between, ""
        motor, spring = self.wants("motor"), self.wants("spring")
        if motor:
            text += f"""
[motor]
rotor_inertia = "{b(1e-7, 5e-7):.3g} kg m^2"
gear_inertia = "{b(5e-7, 5e-6):.3g} kg m^2"
gear_ratio = "{b(10, 100):.4g}"
pulley = "4 mm"
friction.steepness = "{b(2, 30):.3g} s/rad"
friction.level = "{b(0.1, 1):.3g} N m"
friction.viscosity = "{b(0.01, 0.1):.3g} N m s/rad"
compensation = "{b(0.5, 0.95):.3g}"
travel = "{b(0.5, 3):.3g} rad"
velocity = "{b(5, 30):.3g} rad/s"
acceleration = "{b(100, 2000):.4g} rad/s^2"
torque = "{b(1, 5):.3g} N m"
source = "assumed"
"""
            lines = [(shaft, n) for shaft in ("input", "output") for n in (1, 2, 3)]
            for shaft, harmonic in lines[:: int(self.random.integers(1, 4))] if self.wants("ripple") else ():
                text += f"""
[[motor.ripple]]
shaft = "{shaft}"
harmonic = {harmonic}
amplitude = "{b(0.005, 0.08):.3g} N m"
phase = "{b(-180, 180):.4g} deg"
"""
        if spring:
            text += f"""
[spring]
motor = {{ centre = ["-10 mm", "0 mm"], radius = "4 mm", winding = 1 }}
roller = {{ radius = "{b(2.9, 3.1):.3f} mm", winding = -1 }}
fixed = {{ centre = ["10 mm", "0 mm"], radius = "3 mm", winding = 1 }}
pivot = ["18 mm", "8 mm"]
arm = "18 mm"
slack = "3.25 rad"
taut = "{b(3.55, 3.62):.3f} rad"
anchor = ["-6 mm", "40 mm"]
spring_arm = "30 mm"
spring_angle = "0 deg"
rate = "{b(2, 12):.3g} N/mm"
free_length = "{b(34.6, 35.1):.4g} mm"
sensor = {{ slack = "{int(b(0, 500))}", taut = "{int(b(3000, 4095))}" }}
source = "assumed"
"""
            for tendon in sorted(self.random.choice(tendons, min(2, tendons), False)) if self.wants("units") else ():
                text += f'\n[[spring.units]]\ntendon = {tendon}\nrate = "{b(2, 12):.3g} N/mm"\nsource = "bench"\n'
        if self.wants("fibre"):
            text += f"""
[tendon]
modulus = "{b(30, 120):.3g} GPa"
section = "{b(0.1, 0.5):.2g} mm^2"
length = "{b(100, 400):.4g} mm"
guiding = "{b(0.02, 0.2):.2g}"
bend = "{b(1, 7):.2g} rad"
source = "assumed"
"""
        gains = motor and spring and SLIDES not in self.used and self.wants("gains")
        for tendon in sorted(self.random.choice(tendons, min(2, tendons), False)) if gains else ():
            text += f"""
[[gains]]
tendon = {tendon}
K_p = "{b(0.1, 0.2):.3g} N m/rad"
K_d = "{b(5e-5, 1e-4):.3g} N m s/rad"
K_3 = "{b(50, 200):.4g} 1/s"
K_4 = "{b(50, 200):.4g} 1/s"
C_t = "{b(8, 12):.3g} rad/(N m)"
C_s = "{b(1e-3, 2e-3):.3g} rad s^2/(N m)"
source = "assumed"
"""
        return text

    # -- a finger ---------------------------------------------------------------------------------------------

    def finger(self, name: str, links: int) -> tuple[str, int]:
        """The text of a finger, and how many tendons it has."""
        joints = [f"j{i}" for i in range(links)]
        tensegrity = links >= 3 and self.wants("tensegrity")
        leaders = self.leaders(joints[2:] if tensegrity else joints)
        free = [joint for joint in joints if joint not in leaders]
        bar = self.random.choice(free[2:] if tensegrity else free) if len(free) > 2 * tensegrity else None
        turns = [str(self.random.choice(TURNS)) for _ in joints]
        alone = [joint for joint in free[2 * tensegrity :] if joint != bar and joint not in leaders.values()]
        self.sliding = set()
        if alone and self.wants(SLIDES):
            self.sliding = set(self.random.choice(alone, int(self.random.integers(1, len(alone) + 1)), False))
        if tensegrity:
            turns[:2] = ["none", "x+90"]
        rows = self.tendons(free[2:] if tensegrity else free, leaders)
        corners = [(y, z) for y in (1, -1) for z in (1, -1)] if tensegrity else []
        spans = [
            f'{{ rest = "0 mm", span = {{ from = ["{2 * self.scale:.3g} mm", "{30 * self.scale * y:.4g} mm", '
            f'"{25 * self.scale * z:.4g} mm"], to = ["2 mm", "{3 * self.scale * y:.3g} mm", '
            f'"{2.5 * self.scale * z:.3g} mm"], joint = "j2" }}, source = "assumed" }}'
            for y, z in corners
        ]
        if links >= 2 and not tensegrity and self.wants("spans"):
            for _ in range(int(self.random.integers(1, 3))):
                joint = self.random.choice(joints[1:])
                start, end = self.point((-60, -40), (-8, 8), (-8, 8)), self.point((-4, 4), (-6, 6), (-6, 6))
                over = f", {self.routed([f'+{self.random.choice(free)}'], {})}" if self.random.random() < 0.3 else ""
                spans.append(
                    f'{{ rest = "0 mm"{over}, span = {{ from = {start}, to = {end}, joint = "{joint}" }}, '
                    'source = "assumed" }'
                )
        spans += self.paths(joints)
        pulleys = [
            f'{{ joint = "{joint}", radius = {self.mm(4, 10)}, source = "drawing" }}'
            for joint in joints
            if joint not in self.sliding
        ]
        if self.wants("few tendons"):
            rows = rows[: int(self.random.integers(1, len(rows) + 1))]
        tendons = spans + [
            f'{{ rest = {self.mm(0, 50)}, {self.routed(row, self.arms(free))}, source = "assumed" }}' for row in rows
        ]
        strings = self.strings(joints)
        couplings = [f'{{ follower = "{one}", leader = "{other}"{self.ratio()} }}' for one, other in leaders.items()]
        text = f"\n[fingers.{name}]\npulleys = [{', '.join(pulleys)}]\ntendons = [\n    "
        text += ",\n    ".join(tendons + strings) + f"\n]\ncouplings = [{', '.join(couplings)}]\n"
        if self.wants("base"):
            text += f"base = {{ position = {self.point((-20, 20), (-40, 40), (-10, 10))}, rpy = {self.turned()}, "
            text += 'source = "assumed" }\n'
        for joint, turn in zip(joints, turns, strict=True):
            base = tensegrity and joint in joints[:2]
            text += self.link(name, joint, turn, joint in leaders, joint == bar, base, joint == joints[-1])
        return text, len(tendons)

    def routed(self, row: list[str], arms: dict[str, str]) -> str:
        """What a tendon runs over, and its arms: slides have no pulleys."""
        over = [each for each in row if each[1:] not in self.sliding]
        arms = {each[1:]: f'"{each[0]}1"' for each in row if each[1:] in self.sliding} | arms
        text = f"over = [{', '.join(json.dumps(each) for each in over)}]"
        return f"{text}, arms = {{ {', '.join(f'{joint} = {arm}' for joint, arm in arms.items())} }}" if arms else text

    def arms(self, joints: list[str]) -> dict[str, str]:
        if not self.wants("arms"):
            return {}
        joint, arm = str(self.random.choice(joints)), self.mm(-6, 6)
        return {joint: f'"{self.between(-1, 1):.3g}"' if joint in self.sliding else arm}

    def ratio(self) -> str:
        if not self.wants("ratios"):
            return ""
        offset = f', offset = "{self.between(-20, 20):.4g} deg"' if self.random.random() < 0.5 else ""
        return f', ratio = "{self.random.choice([-1, 1]) * self.between(0.3, 1.5):.4g}"{offset}'

    def path(self, joints: list[str]) -> str:
        """Points of the palm and of some links, with straight lines between."""
        count = int(self.random.integers(1, min(3, len(joints)) + 1))
        links = ["palm", *(joints[i] for i in sorted(self.random.choice(len(joints), count, False)))]
        points = [f'{{ link = "{x}", at = {self.point((3, 12), (-9, 9), (-9, 9))} }}' for x in links]
        return f"path = [{', '.join(points)}]"

    def paths(self, joints: list[str]) -> list[str]:
        if not self.wants("paths"):
            return []
        return [f'{{ rest = {self.mm(0, 5)}, {self.path(joints)}, source = "assumed" }}']

    def strings(self, joints: list[str]) -> list[str]:
        if not self.wants("return strings"):
            return []
        spring = f'spring = {{ stiffness = "{self.between(100, 3000):.4g} N/m", rest = {self.mm(1, 20)} }}'
        return [f'{{ rest = "0 mm", {self.path(joints)}, {spring}, source = "assumed" }}']

    def leaders(self, joints: list[str]) -> dict[str, str]:
        """Follower -> leader for some joints."""
        if len(joints) < 2 or not self.wants("couplings"):
            return {}
        first = int(self.random.integers(1, len(joints)))
        found = {joints[first]: joints[first - 1]}
        if first + 1 < len(joints) and self.random.random() < 0.3:
            found[joints[first + 1]] = joints[first - 1]
        return found

    def tendons(self, joints: list[str], leaders: dict[str, str]) -> list[list[str]]:
        """What each tendon runs over, so that every torque can be pulled."""
        followers = {leader: follower for follower, leader in leaders.items()}

        def name(joint: str, sense: int) -> str:
            pulley = followers.get(joint, joint) if self.random.random() < 0.3 else joint
            return f"{'+' if sense > 0 else '-'}{pulley}"

        if len(joints) > 1 and self.wants("fewest"):  # one tendon more than joints
            senses = np.tril(np.where(self.random.random((len(joints),) * 2) < 0.5, -1, 1))
            last = -np.sign(np.sum(senses, axis=0) - 0.5)  # both senses at every joint
            rows = [list(row) for row in senses.astype(int)] + [list(last.astype(int))]
        elif len(joints) > 1 and self.wants("crossed"):
            rows = [[a, b] + [0] * (len(joints) - 2) for a in (1, -1) for b in (1, -1)]
            rows += [[0] * i + [s] + [0] * (len(joints) - i - 1) for i in range(2, len(joints)) for s in (1, -1)]
        else:
            rows = [[0] * i + [s] + [0] * (len(joints) - i - 1) for i in range(len(joints)) for s in (1, -1)]
        if len(rows) < 12 and self.wants("alike"):
            rows += [rows[i] for i in self.random.choice(len(rows), int(self.random.integers(1, 3)), False)]
        return [[name(joint, sense) for joint, sense in zip(joints, row, strict=True) if sense] for row in rows]
