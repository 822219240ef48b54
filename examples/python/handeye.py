# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where is the camera? It stands in the cell, the robot shows it a board, and three of the boards were read
wrongly.

Then two ways to get it wrong, and what is said of them: poses that are inverted, and a robot that turns about
one axis only.
"""

import numpy as np

import truing
from truing.hand_eye import HandEyePoses, handeye_plan
from truing.testing.scenes import one_rotation_axis, simulate_handeye


def main() -> None:
    scene = simulate_handeye("eye-to-hand", 30, outliers=0.1, seed=4)
    poses = HandEyePoses(scene.T_base_hand, scene.T_camera_board)
    found = truing.handeye(poses, setup="eye-to-hand", working_point=[0, 0, 0.9])
    print(found.message)
    for row in found.rejected:
        print(f"left out: pose {row}, {found.residuals[row].cause}")
    off = found.camera.T[:3, 3] - scene.T_parent_camera[:3, 3]
    print(f"the camera is {1e3 * np.linalg.norm(off):.2f} mm from where it was put")

    # Which poses would help most?
    for pose in handeye_plan(poses, found, setup="eye-to-hand", count=3):
        print(
            f"with the hand at {np.round(pose.T_base_hand[:3, 3], 2)} m as well:"
            f" {1e3 * pose.working_point_sigma:.2f} mm at the working point"
        )

    inverted = HandEyePoses(np.linalg.inv(scene.T_base_hand), scene.T_camera_board)
    print(truing.handeye(inverted, setup="eye-to-hand", raise_if_undecided=False).message)

    scara = one_rotation_axis("eye-to-hand", seed=4)
    flat = HandEyePoses(scara.T_base_hand, scara.T_camera_board)
    print(truing.handeye(flat, setup="eye-to-hand", raise_if_undecided=False).message)


if __name__ == "__main__":
    main()
