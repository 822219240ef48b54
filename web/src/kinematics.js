// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Where a robot's joints are: the same chain as cpp/src/model, for pages that let their reader turn a joint.
// A frame is twelve numbers, the rows of a 3 x 4 matrix. Lengths in m, angles in rad.

const X = 0, Y = 1, Z = 2;

export const identity = () => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

export function times(a, b) {
  const out = new Array(12);
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 4; j++) {
      out[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j] + (j === 3 ? a[4 * i + 3] : 0);
    }
  }
  return out;
}

function shift(axis, length) {
  const T = identity();
  T[4 * axis + 3] = length;
  return T;
}

const unit = axis => [X, Y, Z].map(k => (k === axis ? 1 : 0));

// Rodrigues' formula.
function turn(axis, angle) {
  const [x, y, z] = typeof axis === 'number' ? unit(axis) : axis;
  const c = Math.cos(angle), s = Math.sin(angle), v = 1 - c;
  return [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0,
    y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0,
    z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0];
}

const slide = (axis, length) => [1, 0, 0, axis[0] * length, 0, 1, 0, axis[1] * length, 0, 0, 1, axis[2] * length];

const product = frames => frames.reduce(times);
export const place = T => [T[3], T[7], T[11]];
export const column = (T, k) => [T[k], T[4 + k], T[8 + k]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const plus = (a, b, factor = 1) => [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
const along = (T, v) => [dot(T.slice(0, 3), v), dot(T.slice(4, 7), v), dot(T.slice(8, 11), v)];
export const moved = (T, p) => plus(along(T, p), place(T));

// Frames are changed by small rotations on top of them: Trans(x, y, z) Rz(rz) Ry(ry) Rx(rx) R0.
function changedFrame(T, name, added) {
  const change = key => added[`${name}.${key}`] ?? 0;
  if (!['x', 'y', 'z', 'rx', 'ry', 'rz'].some(change)) return T;
  const at = place(T), turned = [...T];
  turned[3] = turned[7] = turned[11] = 0;
  return product([[1, 0, 0, at[0] + change('x'), 0, 1, 0, at[1] + change('y'), 0, 0, 1, at[2] + change('z')],
    turn(Z, change('rz')), turn(Y, change('ry')), turn(X, change('rx')), turned]);
}

// Motions of all joints. A passive joint moves by the weighted sum of the corrected motions of those that drive it.
// As read: without gear ratios and zeros.
export function motions(robot, reading, added = {}, asRead = false) {
  const out = new Array(robot.joints.length).fill(null);
  const at = Object.fromEntries(robot.joints.map((joint, k) => [joint.name, k]));
  let next = 0;
  const readings = robot.joints.map(joint => (joint.driven_by.length ? null : reading[next++]));
  const motion = k => {
    if (out[k] !== null) return out[k];
    const joint = robot.joints[k], change = key => added[`${joint.name}.${key}`] ?? 0;
    const zero = asRead ? 0 : joint.offset + change('offset') + (added[joint.name] ?? 0);
    out[k] = readings[k] === null
      ? joint.driven_by.reduce((sum, [name, weight]) => sum + weight * motion(at[name]), zero)
      : (asRead ? 1 : joint.ratio + change('ratio')) * readings[k] + zero;
    return out[k];
  };
  robot.joints.forEach((_, k) => motion(k));
  return out;
}

// By how much joint i moves when joint j's zero grows by one.
export function coupling(robot) {
  const columns = robot.joints.map(joint => {
    const still = robot.joints.map(() => 0), zero = {...robot, joints: robot.joints.map(j => ({...j, offset: 0}))};
    return motions(zero, still, {[joint.name]: 1});
  });
  return robot.joints.map((_, i) => columns.map(column => column[i]));
}

// From the frame before a joint to the frame after its link, and where the link has its corner (DH: between d and a).
function jointFrame(robot, joint, motion, added) {
  const value = key => joint[key] + (added[`${joint.name}.${key}`] ?? 0);
  const turns = joint.type === 'revolute';
  if (robot.convention === 'urdf') {
    const T = times(changedFrame(joint.T_parent_joint, joint.name, added),
      turns ? turn(joint.axis, motion) : slide(joint.axis, motion));
    return [T, null];
  }
  const theta = turn(Z, value('theta') + (turns ? motion : 0)), d = shift(Z, value('d') + (turns ? 0 : motion));
  const a = shift(X, value('a')), alpha = turn(X, value('alpha')), beta = turn(Y, value('beta'));
  if (robot.convention === 'dh') return [product([theta, d, a, alpha, beta]), place(d)];
  return [product([alpha, a, beta, theta, d]), place(times(alpha, a))];
}

// Frames after every joint, then that of the tool, in the measurement frame; corners of the links; axes of the joints.
// `added`: what is added to a site: {"J2": 1e-3, "J2.a": 1e-4, "base.x": ...}.
export function chain(robot, reading, added = {}) {
  const motion = motions(robot, reading, added);
  let T = changedFrame(robot.T_measurement_base, 'base', added);
  const frames = [], corners = [], axes = [], base = T;
  robot.joints.forEach((joint, k) => {
    const before = T, [link, corner] = jointFrame(robot, joint, motion[k], added);
    T = times(before, link);
    frames.push(T);
    corners.push(corner && moved(before, corner));
    const from = robot.convention === 'dh' ? before : T;
    axes.push({point: place(from), direction: robot.convention === 'urdf' ? along(T, joint.axis) : column(from, Z)});
  });
  const {name, T_last_target} = robot.target;
  frames.push(times(T, changedFrame(T_last_target, name, added)));
  return {base, frames, corners, axes};
}
