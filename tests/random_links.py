"""Links and joints of random hands, a four-bar among them, as text of a hand file."""

from __future__ import annotations

import numpy as np


class Links:
    """Writes links; `used` grows with the features that the hand got room for."""

    def __init__(self, random: np.random.Generator, features: set[str]) -> None:
        self.random, self.features = random, features
        self.used: set[str] = set()
        self.sliding: set[str] = set()  # joints of the finger that is written
        self.scale = random.uniform(0.4, 2.5)  # of all lengths: a child's hand to a giant's

    def wants(self, feature: str) -> bool:
        if feature in self.features:
            self.used.add(feature)
        return feature in self.features

    def between(self, low: float, high: float) -> float:
        return float(self.random.uniform(low, high))

    def mm(self, low: float, high: float) -> str:
        return f'"{self.scale * self.between(low, high):.4g} mm"'

    def point(self, *ranges: tuple[float, float]) -> str:
        return f"[{', '.join(self.mm(*each) for each in ranges)}]"

    def turned(self) -> str:
        """Roll, pitch and yaw; some are quarter turns."""
        angles = [90 * int(self.random.integers(-1, 3)) if self.random.random() < 0.3 else self.between(-170, 170)
                  for _ in range(3)]  # fmt: skip
        return "[" + ", ".join(f'"{angle:.6g} deg"' for angle in angles) + "]"

    def link(self, finger: str, joint: str, turn: str, follows: bool, bar: bool, base: bool, last: bool) -> str:
        low, high, four_bar = self.between(-80, -5), self.between(5, 90), ""
        if base:
            low, high = self.between(-35, -10), self.between(10, 35)
        elif bar and not follows and (found := self.four_bar()):
            low, high, four_bar = found
        elif self.random.random() < 0.5 and self.wants("narrow range"):
            low = self.between(-30, 30)
            high = low + 10 ** self.between(-1.5, 1)
        elif self.random.random() < 0.5 and self.wants("range without zero"):
            low, high = sorted(self.random.choice([-1, 1]) * x for x in (self.between(5, 20), self.between(40, 80)))
        limits = "" if follows else f'low = "{low:.4f} deg"\nhigh = "{high:.4f} deg"\n'
        if slides := joint in self.sliding:
            limits = f'kind = "slide"\nlow = {self.mm(-8, -1)}\nhigh = {self.mm(1, 20)}\n'
        axial = self.random.random() < 0.5 and self.wants("axial mass")
        com = '["0 mm", "0 mm", "0 mm"]' if axial else self.point((5, 20), (-2, 2), (-2, 2))
        offset = self.point((15, 40), (-4, 4), (-4, 4))
        body = f"""mass = "{self.scale**3 * self.between(1, 15):.4g} g"
com = {com}
inertia = {self.inertia()}
"""
        if not last and not four_bar and "massless links" in self.features and self.random.random() < 0.5:
            self.used.add("massless links")
            body = ""
        text = f"""
[[fingers.{finger}.links]]
joint = "{joint}"
turn = "{turn}"
{limits}offset = {offset}
{body}{self.joint(bool(four_bar) or base, slides)}source = "assumed"
"""
        return text + (f"\n[fingers.{finger}.links.four_bar]\n{four_bar}" if four_bar else "")

    def joint(self, planar: bool, slides: bool) -> str:
        """The optional keys of a joint; without rotations for a `planar` one."""
        b, text = self.between, ""
        if slides:
            return self.slide()
        if not planar and self.wants("skew axes"):
            text += f"rpy = {self.turned()}\n"
        if not planar and self.wants("references"):
            text += f'reference = "{b(-60, 60):.4g} deg"\n'
        if self.wants("rotors"):
            text += f'armature = "{b(1e-8, 1e-4):.3g} kg m^2"\n'
        for key in self.random.choice(3, 2, False) if self.wants("passive joints") else ():
            text += (
                f'damping = "{b(1e-4, 1e-2):.3g} N m s/rad"\n',
                f'friction = {{ torque = "{b(1e-3, 0.05):.3g} N m", velocity = "{b(0.02, 1):.3g} rad/s" }}\n',
                f'spring = {{ stiffness = "{b(0.01, 0.5):.3g} N m/rad", reference = "{b(-40, 40):.4g} deg" }}\n',
            )[key]
        return text

    def slide(self) -> str:
        """The optional keys of a slide."""
        b, text = self.between, ""
        if self.wants("skew axes"):
            text += f"rpy = {self.turned()}\n"
        if self.wants("references"):
            text += f"reference = {self.mm(-9, 9)}\n"
        if self.wants("rotors"):
            text += f'armature = "{b(0.5, 50):.3g} g"\n'
        if self.wants("passive joints"):
            text += f'damping = "{b(0.05, 2):.3g} N s/m"\n'
            text += f'friction = {{ force = "{b(0.05, 2):.3g} N", velocity = "{b(1, 20):.3g} mm/s" }}\n'
            text += f'spring = {{ stiffness = "{b(10, 500):.3g} N/m", reference = {self.mm(-9, 9)} }}\n'
        return text

    def inertia(self) -> str:
        """The inertia tensor of some body."""
        axes = np.linalg.qr(self.random.normal(size=(3, 3)))[0]
        second = axes @ np.diag(self.scale**5 * self.random.uniform(10, 300, 3)) @ axes.T
        tensor = np.trace(second) * np.eye(3) - second
        entries = {f"{'xyz'[i]}{'xyz'[j]}": tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))}
        return "{ " + ", ".join(f'{key} = "{value:.6g} g mm^2"' for key, value in entries.items()) + " }"

    def four_bar(self) -> tuple[float, float, str] | None:
        """A linkage and a range of its joint over which it closes; None if there is none."""
        without_zero = "four-bar without zero" in self.features
        if not (without_zero or "four-bar" in self.features):
            return None
        ground, crank, coupler, rocker = (self.between(*ends) for ends in ((9, 14), (7, 12), (6, 12), (9, 14)))
        angles = np.linspace(5, 175, 1701)
        gap = np.sqrt(ground**2 + crank**2 - 2 * ground * crank * np.cos(np.radians(angles)))
        closes = angles[(gap > 1.03 * abs(coupler - rocker)) & (gap < 0.97 * (coupler + rocker))]
        if not len(closes) or closes[-1] - closes[0] < 20:
            return None
        self.used.add("four-bar without zero" if without_zero else "four-bar")
        side = self.random.choice([-1, 1])
        start = closes[0] - 30 if side > 0 else closes[-1] + 30
        reference = start if without_zero else closes[0] + (closes[-1] - closes[0]) * self.between(0.2, 0.8)
        bars = zip(("ground", "crank", "coupler", "rocker"), (ground, crank, coupler, rocker), strict=True)
        text = "".join(f'{key} = "{length:.6f} mm"\n' for key, length in bars)
        text += f'reference = "{reference:.4f} deg"\nbranch = {self.random.choice([-1, 1])}\nsource = "assumed"\n'
        return closes[0] - reference, closes[-1] - reference, text
