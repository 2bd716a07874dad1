"""The wrist of crossed bars in MJCF: four hinges in series, and two bars that are tendons of constant length.

The palm hangs from the forearm by bar BB0: q71 turns the plane of the side bars about B0C0, q73 turns the bar in that
plane, and two hinges at B turn the palm in the plane and about BC. The bars CC0 and AA0 leave two degrees of freedom.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from awiwi_gen.hand import Wrist
from awiwi_gen.interchange.export import text, vector
from awiwi_gen.interchange.export_motors import Lost, Sections
from awiwi_gen.interchange.mjcf_elements import least_inertia, place

SOLREF, SOLIMP = "0.004 1", "0.999 0.9999 0.0001"  # under the weight of the hand, bars of 5 cm give way by 2 um
SOFT = "bars of the wrist: soft constraints in MuJoCo"
RUNS = "runs of tendons through the wrist: tendons of their own, for MuJoCo has none of arcs and lines"
PULLED = f"{RUNS}; their motors need the fingers' forces"
LOOSE = f"{RUNS}; no motor pulls them"


def wrist_of_bars(forearm: Element, wrist: Wrist, sections: Sections, lost: Lost, force: float | None) -> Element:
    """The palm in its neutral pose, in the forearm's frame {0}.

    Motors of the largest `force` [N] pull the tendons' runs through the wrist, if given.
    """
    b, origin = vector(wrist.b), vector(wrist.palm)
    palm = SubElement(forearm, "body", name="palm")
    place(palm, origin, np.eye(3))
    least_inertia(palm, lost)
    (q71, q73), (low, high) = wrist.neutral, wrist.range
    normal = np.array([-np.sin(q71), 0.0, np.cos(q71)])
    across, b0, (c0, c) = np.array([0.0, 1.0, 0.0]), np.zeros(3), map(np.array, wrist.far_bar)
    hinges = [("q71", -across, b0, q71, (low[0], high[0])), ("q73", -normal, b0, q73, (low[1], high[1])),
              ("b.normal", normal, b, 0.0, None), ("b.side", (b - c) / np.linalg.norm(b - c), b, 0.0, None)]  # fmt: skip
    for name, axis, anchor, angle, ends in hinges:
        joint = SubElement(palm, "joint", name=f"wrist_{name}", axis=text(axis), pos=text(anchor - origin))
        if angle:
            joint.set("ref", text(angle))
        if ends is not None:
            joint.set("range", text(ends))
    for name, start, end in (("cc0", c0, c), ("aa0", vector(wrist.a0), vector(wrist.a))):
        SubElement(forearm, "site", name=f"wrist.{name}.forearm", pos=text(start))
        SubElement(palm, "site", name=f"wrist.{name}.palm", pos=text(end - origin))
        bar = SubElement(sections["tendon"], "spatial", name=f"wrist.{name}")
        for end_of in ("forearm", "palm"):
            SubElement(bar, "site", site=f"wrist.{name}.{end_of}")
        SubElement(sections["equality"], "tendon", tendon1=f"wrist.{name}", solref=SOLREF, solimp=SOLIMP)
        lost.setdefault(SOFT, []).append(name)
    for number, tendon in enumerate(wrist.tendons):
        run = SubElement(sections["tendon"], "spatial", name=f"wrist.run{number}")
        for body, end in ((forearm, vector(tendon.forearm)), (palm, vector(tendon.palm))):
            site = f"wrist.run{number}.{body.get('name')}"
            SubElement(body, "site", name=site, pos=text(end))
            SubElement(run, "site", site=site)
        lost.setdefault(LOOSE if force is None else PULLED, []).append(f"wrist.run{number}")
    return palm


def pull_runs(wrist: Wrist, sections: Sections, force: float) -> None:
    """Motors for the tendons' runs through the wrist."""
    for number in range(len(wrist.tendons)):
        SubElement(sections["actuator"], "motor", name=f"wrist.run{number}.motor", tendon=f"wrist.run{number}", gear="-1",
                   ctrlrange=text((0.0, force)))  # fmt: skip
