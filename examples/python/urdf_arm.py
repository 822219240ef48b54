# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A URDF arm, measured with full poses, and the same URDF with calibrated origins."""

import truing

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/> <link name="shoulder"/> <link name="upper"/> <link name="fore"/> <link name="wrist"/>
  <link name="flange"/>
  <joint name="pan" type="revolute"> <parent link="base"/> <child link="shoulder"/>
    <origin xyz="0 0 0.4" rpy="0 0 0"/> <axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/> </joint>
  <joint name="lift" type="revolute"> <parent link="shoulder"/> <child link="upper"/>
    <origin xyz="0.1 0 0" rpy="0 0 0"/> <axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="1.5" effort="1" velocity="1"/> </joint>
  <joint name="elbow" type="revolute"> <parent link="upper"/> <child link="fore"/>
    <origin xyz="0 0 0.5" rpy="0 0 0"/> <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/> </joint>
  <joint name="roll" type="revolute"> <parent link="fore"/> <child link="wrist"/>
    <origin xyz="0.3 0 0.05" rpy="0 0 0"/> <axis xyz="1 0 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/> </joint>
  <joint name="mount" type="fixed"> <parent link="wrist"/> <child link="flange"/>
    <origin xyz="0.1 0 0.03" rpy="0 1.5708 0"/> </joint>
</robot>
"""


def main() -> None:
    robot = truing.model.robot_from_urdf(ARM, "base", "flange")
    print("joints:", ", ".join(f"{joint.name} ({joint.type})" for joint in robot.joints))

    # 1 mm and 1 mrad of error in every joint origin and in the tool; poses measured to 0.05 mm and 0.1 mrad.
    simulated = truing.simulate(robot, poses=120, orientation=True, noise=5e-5, rotation_noise=1e-4, seed=3)
    found = truing.identify(robot, simulated.data, free="pan.*,lift.*,elbow.*,roll.*,tool.*")

    assert found.test is not None
    for name, errors in (("before", found.test.before), ("after", found.test.after)):
        print(f"held out, {name:6}: {1e3 * errors.rms:.3f} mm, {1e3 * errors.rotation_rms:.3f} mrad (rms)")
    # Every origin has six values, and an axis shows only where it is: what lies along or about it is frozen,
    # by name.
    print(f"{found.rank} of {found.columns} parameters found")

    calibrated = truing.model.urdf_with_calibration(ARM, found.robot, "base", "flange")
    print(
        "the elbow's origin is now",
        next(line.strip() for line in calibrated.split('name="elbow"')[1].splitlines() if "<origin" in line),
    )


if __name__ == "__main__":
    main()
