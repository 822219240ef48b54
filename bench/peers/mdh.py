# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Plain NumPy kinematics of a modified-DH (Craig + Hayati) arm, shared by the peers.

T_i = Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d), all poses at once. Lengths in
metres, angles in radians. This file needs NumPy only (1 or 2): it runs in every
peer's environment and shares no code with the library under test.
"""

import numpy as np

ALPHA, A, BETA, THETA, D = range(5)
JOINTS = [f"joint{i + 1}" for i in range(6)]


def chain(dh, q):
    """Frames of the arm in its own base.

    Args:
        dh: shape=(k, 5) [alpha, a, beta, theta, d].
        q: shape=(n, k) joint angles.

    Returns:
        R, shape=(k + 1, n, 3, 3), and o, shape=(k + 1, n, 3): frame i after i joints.
    """
    n, k = q.shape
    R = np.empty((k + 1, n, 3, 3))
    o = np.empty((k + 1, n, 3))
    R[0], o[0] = np.eye(3), 0.0
    for i, (alpha, a, beta, theta, d) in enumerate(dh):
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
        # Rx(alpha) Ry(beta) does not depend on the pose
        fixed = np.array([[cb, 0, sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]])
        H = R[i] @ fixed
        c, s = np.cos(theta + q[:, i])[:, None], np.sin(theta + q[:, i])[:, None]
        R[i + 1, :, :, 0] = H[:, :, 0] * c + H[:, :, 1] * s
        R[i + 1, :, :, 1] = H[:, :, 1] * c - H[:, :, 0] * s
        R[i + 1, :, :, 2] = H[:, :, 2]
        o[i + 1] = o[i] + a * R[i, :, :, 0] + d * H[:, :, 2]
    return R, o


def positions(dh, base, tool, q):
    """Tool point in the measurement frame, shape=(n, 3)."""
    R, o = chain(dh, q)
    return (o[-1] + R[-1] @ tool) @ base[:3, :3].T + base[:3, 3]


def positions_and_jacobian(dh, base, tool, q):
    """Tool points and their analytic Jacobian, shape=(n, 3, 6 + 5 k + 3).

    Columns: base (rotation vector on the left, about the origin of the base;
    translation), then alpha, a, beta, theta, d of each link, then the tool.
    """
    R, o = chain(dh, q)
    Rb = base[:3, :3]
    local = o[-1] + R[-1] @ tool
    R, o = Rb @ R, o @ Rb.T  # axes in the measurement frame, origin at the base
    p = local @ Rb.T
    n, k = q.shape
    J = np.empty((9 + 5 * k, 3, n))  # columns outermost: every write below is contiguous
    pt = p.T
    for j, axis in enumerate(np.eye(3)):
        J[j] = np.cross(axis[:, None], pt, axis=0)
        J[3 + j] = axis[:, None]
    for i in range(k):
        column = 6 + 5 * i
        alpha, a = dh[i, ALPHA], dh[i, A]
        x, z = R[i, :, :, 0].T, R[i + 1, :, :, 2].T
        y = (np.cos(alpha) * R[i, :, :, 1] + np.sin(alpha) * R[i, :, :, 2]).T
        lever = (p - o[i]).T
        beyond_a = lever - a * x
        J[column + ALPHA] = _cross(x, lever)
        J[column + A] = x
        J[column + BETA] = _cross(y, beyond_a)
        J[column + THETA] = _cross(z, beyond_a)
        J[column + D] = z
    J[6 + 5 * k :] = R[-1].transpose(2, 1, 0)
    return p + base[:3, 3], J.transpose(2, 1, 0)


def _cross(u, v):
    """Cross product along the first axis; np.cross is three times slower."""
    return np.stack((u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]))


def align(source, target):
    """Rigid transform (4, 4) that maps source points to target points (Kabsch)."""
    cs, ct = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((target - ct).T @ (source - cs))
    R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, ct - R @ cs
    return T


def rotation(w):
    """Rotation matrix of a rotation vector."""
    angle = np.linalg.norm(w)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def urdf(dh, tool=(0.0, 0.0, 0.0)):
    """URDF of the arm: the fixed part of each link as xyz and rpy, then q about z; the tool is a fixed joint.

    Numbers are written in full, so that the URDF is the same arm to 1e-15.
    """
    inertia = (
        "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    )
    limit = "<axis xyz='0 0 1'/><limit lower='-3.2' upper='3.2' effort='1' velocity='1'/>"
    parts = ["<robot name='arm'><link name='link0'/>"]

    def joint(name, kind, parent, child, xyz, rpy, rest=""):
        xyz, rpy = (" ".join(repr(float(v)) for v in values) for values in (xyz, rpy))
        parts.append(
            f"<link name='{child}'>{inertia}</link><joint name='{name}' type='{kind}'><parent"
            f" link='{parent}'/><child link='{child}'/><origin xyz='{xyz}' rpy='{rpy}'/>{rest}</joint>"
        )

    for i, row in enumerate(dh):
        R, o = chain(row[None], np.zeros((1, 1)))
        R, o = R[1, 0], o[1, 0]
        # URDF: R = Rz(yaw) Ry(pitch) Rx(roll)
        yaw, pitch = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
        roll = np.arctan2(R[2, 1], R[2, 2])
        joint(JOINTS[i], "revolute", f"link{i}", f"link{i + 1}", o, (roll, pitch, yaw), limit)
    joint("tool_joint", "fixed", f"link{len(dh)}", "tool", tool, np.zeros(3))
    return "".join(parts) + "</robot>"
