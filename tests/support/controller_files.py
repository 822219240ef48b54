# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files of controllers as tests need them."""

from __future__ import annotations

# A UR5 and a UR10 whose shoulder, elbow and wrist axes are so nearly parallel that d is far away. Both
# calibrations are public: ros-industrial-attic/ur_modern_driver #179, and the tests of ur_calibration.
UR5 = {
    "theta": "2.07750978653505926e-05 0.96821571555565844 -1.85685385014877657 0.88864790145037664 6e-05 0",
    "a": "0.000393621049984383038 0.184093300397451837 0.14493953300732923 -6.43297403642304e-05 7.767e-06 0",
    "d": "4.00263e-05 278.244144925623573 -183.695513914913732 -94.5471513669751289 0.000304783 0.000123738",
    "alpha": "-0.000271625 0.00125856505456124258 -0.00322052070697146503 0.000651530165303837 -0.000587 0",
}
UR10 = {
    "theta": "-2.414780689e-07 1.60233952386694556 -1.68607190752171299 0.08373311477001187 -1e-07 4e-08",
    "a": "2.12234865571205891e-05 0.632017132627700651 0.00229833638891230319 -4.61409e-05 -6.3928e-05 0",
    "d": "-0.00016018828 439.140974079900957 -446.027059806332147 6.88618689642360149 -3.8e-05 -0.00088",
    "alpha": "-0.0006502465575 0.00139416666825590402 0.00693818880325995126 -0.0008116416 0.0004111205 0",
}


def conf(values: dict[str, str], more: str = "calibration_status = 2 # 2 == Linearised\n") -> str:
    lines = [f"delta_{key} = [ {', '.join(text.split())}]" for key, text in values.items()]
    return "[mounting]\n" + "\n".join(lines) + "\n" + more


KINEMATICS = """<Kinematics status="{status}" validChecksum="{valid}">
  <deltaTheta value="-8.84E-8, -0.032582961261549755, -0.8772929446404238, 0.9098787703504071, 2.1E-6, 0"/>
  <a value="1.2280920183406098E-4, -0.6118328650166482, -0.35064142434212725, 6.353E-5, -8.491E-5, 0.0"/>
  <d value="{d1}, -11.986107840354439, 254.02185121292118, -241.86139249326118, 0.119787, 0.115693"/>
  <alpha value="1.5705736146, 0.0016638537326948237, -0.0018631164519257151, 1.57066073817, -1.57044735, 0"/>
  <jointChecksum value="-1858852621, -1856465696, 659529794, -1323325273, -1859399821, -1861357583"/>
</Kinematics>"""


def urp(*kinematics: str, tool: str = "0.0, 0.0, 0.1, 0.0, 0.0, 0.0") -> str:
    points = "".join(
        f'<Waypoint type="Fixed" name="Point_{k}"><position><JointAngles angles="0,0,0,0,0,0"/>'
        f'<TCPOffset pose="{tool}"/>{text}</position></Waypoint>'
        for k, text in enumerate(kinematics, 1)
    )
    return f'<URProgram name="p"><children><MainProgram>{points}</MainProgram></children></URProgram>'


def kinematics(status: str = "LINEARIZED", valid: str = "true", d1: str = "0.18107019996630838") -> str:
    return KINEMATICS.format(status=status, valid=valid, d1=d1)


LIMITS = ((-2.9, 2.9), (-1.9, 1.9), (-1.9, 1.2), (-2.8, 2.8), (-2.1, 2.1), (-6.9, 6.9))
HEAD = """MOC:CFG_1.0:6:0::
#
MOTION_PLANNER:

      -name "motion_planner_1" -use_for_jogging  -repos_installed \\
      -restricted_circlepoint
#
ROBOT:

      -name "ROB_1" -use_robot_serial_number "rob_1"\\
      -use_robot_type "{type}" -use_robot_calib "{calib}"\\
      -use_joint_0 "rob1_1" -use_joint_1 "rob1_2" -use_joint_2 "rob1_3"\\
      -use_joint_3 "rob1_4" -use_joint_4 "rob1_5" -use_joint_5 "rob1_6"{more}
#
ROBOT_SERIAL_NUMBER:

      -name "rob_1" -robot_serial_number_high_part " 120" -robot_serial_number_low_part 502362
#
"""


def moc(
    type: str = "ROB1_120_0.58_3", calib: str = "r1_uncalib", more: str = "", after: str = "", load: str = ""
) -> str:
    arms = "".join(
        f'      -name "rob1_{k}" -use_arm_type "ROB1_{k}"{load if k == 3 else ""}\\\n'
        f"      -upper_joint_bound {high} -lower_joint_bound {low}\n\n"
        for k, (low, high) in enumerate(LIMITS, 1)
    )
    motors = "".join(
        f'      -name "rob1_{k}" -valid_com_offset  -cal_offset {k}.5 -valid_cal_offset \n\n'
        for k in range(1, 7)
    )
    return (
        HEAD.format(type=type, calib=calib, more=more)
        + f"ARM:\n\n{arms}#\nMOTOR_CALIB:\n\n{motors}#\n{after}"
    )


ARM_URDF = """<robot name="so"><link name="base"/>{links}</robot>"""
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex")
MOTORS = {
    "shoulder_pan": {"id": 1, "drive_mode": 0, "homing_offset": -46, "range_min": 758, "range_max": 3292},
    "shoulder_lift": {"id": 2, "drive_mode": 0, "homing_offset": 214, "range_min": 862, "range_max": 3128},
    "elbow_flex": {"id": 3, "drive_mode": 0, "homing_offset": -1103, "range_min": 921, "range_max": 3100},
    "gripper": {"id": 6, "drive_mode": 0, "homing_offset": 1407, "range_min": 2031, "range_max": 3476},
}


def small_urdf(names: tuple[str, ...] = JOINTS, low: float = -1.5) -> str:
    links, parent = "", "base"
    for name in names:
        links += (
            f'<link name="l_{name}"/><joint name="{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="l_{name}"/><origin xyz="0.1 0 0.05"/><axis xyz="0 0 1"/>'
            f'<limit lower="{low}" upper="1.5" effort="1" velocity="1"/></joint>'
        )
        parent = f"l_{name}"
    return ARM_URDF.format(links=links)
