// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What a calibrated robot's effects add to the values of its chain: the laws of cpp/src/model/effects, for a load and
// a temperature that the reader of a page chooses. docs/reference/effects.md has them in words.

import {chain, column, coupling, cross, dot, motions, moved, place, plus, times} from './kinematics.js';

const revolute = joint => joint.type === 'revolute';

// What the laws look at, at one configuration: of the robot without its effects.
export function inputsAt(robot, reading, {payload = 0, temperature = 20, direction = []} = {}) {
  const {base, frames, axes} = chain(robot, reading);
  const C = coupling(robot), g = [0, 1, 2].map(k => dot(base.slice(4 * k, 4 * k + 3), robot.gravity));
  const torque = robot.joints.map(() => 0);
  // Virtual work of the weight, gathered from the tip down: axis . (sum of m (p - o)) x g.
  let mass = payload, moment = plus([0, 0, 0], place(frames[frames.length - 1]), payload);
  for (let i = robot.joints.length - 1; i >= 0; i--) {
    const joint = robot.joints[i];
    if (joint.mass !== null) {
      mass += joint.mass;
      moment = plus(moment, moved(frames[i], joint.center_of_mass), joint.mass);
    }
    const arm = plus(moment, axes[i].point, -mass);
    const own = revolute(joint) ? dot(axes[i].direction, cross(arm, g)) : mass * dot(axes[i].direction, g);
    const size = revolute(joint) ? (Math.hypot(...moment) + mass * Math.hypot(...axes[i].point)) : mass;
    if (Math.abs(own) <= 1e-12 * size * Math.hypot(...g)) continue;  // rounding has no sign to be taken for play
    C[i].forEach((weight, k) => { torque[k] += own * weight; });
  }
  return {robot, base, frames, axes, C, g, torque, payload, temperature, direction,
    joints: motions(robot, reading, {}, true), driven: robot.joints.filter(j => !j.driven_by.length).map(j => j.name)};
}

const waves = order => (at, into) => {
  into(`cos${order.name}`, at.name, Math.cos(order.times * at.motion));
  into(`sin${order.name}`, at.name, Math.sin(order.times * at.motion));
};

// Moment about `axis` through `point` of all that hangs beyond the link.
function momentBeyond(now, link, point, axis) {
  let sum = plus([0, 0, 0], plus(place(now.frames[now.frames.length - 1]), point, -1), now.payload);
  now.robot.joints.forEach((joint, k) => {
    if (k > link && joint.mass !== null) {
      sum = plus(sum, plus(moved(now.frames[k], joint.center_of_mass), point, -1), joint.mass);
    }
  });
  return dot(axis, cross(sum, now.g));
}

const still = (robot, frame) => ({...robot, T_measurement_base: frame, target: {name: '', T_last_target: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}});

// Where a link ends: where the next joint starts to turn, before it turns.
function linkEnd(robot, frames, link) {
  if (robot.convention === 'dh') return frames[link];
  const next = robot.joints[link + 1];
  if (robot.convention === 'urdf') {
    const [x, y, z] = place(next.T_parent_joint);
    return times(frames[link], [1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z]);
  }
  const unmoved = {...next, theta: 0, d: 0, offset: 0, driven_by: [], type: 'revolute'};
  return chain({...still(robot, frames[link]), joints: [unmoved]}, [0]).frames[0];
}

function linkStart(robot, frames, base, link, motion) {
  const joint = robot.joints[link];
  if (robot.convention === 'dh') return place(link === 0 ? base : frames[link - 1]);
  if (robot.convention === 'mdh') return moved(frames[link], [0, 0, -joint.d - (revolute(joint) ? 0 : motion)]);
  return place(frames[link]);
}

// The axes of the elementary rotations about the link's start, and their names.
function aboutStart(now, link) {
  const {robot, frames, base} = now, name = robot.joints[link].name;
  const before = link === 0 ? base : frames[link - 1];
  const axes = T => [0, 1, 2].map(k => column(T, k));
  if (robot.convention === 'urdf') return [['rx', 'ry', 'rz'].map(k => `${name}.${k}`), axes(before)];
  if (robot.convention === 'mdh') {
    const turned = {name: 'turned', type: 'revolute', theta: 0, d: 0, a: 0, alpha: robot.joints[link].alpha, beta: 0,
      ratio: 1, offset: 0, driven_by: []};
    const T = chain({...still(robot, before), joints: [turned]}, [0]).frames[0];
    return [['alpha', 'beta', 'theta'].map(k => `${name}.${k}`), axes(T)];
  }
  if (link === 0) return [['base.rx', 'base.ry', 'base.rz'], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]];
  const last = robot.joints[link - 1].name;
  return [[`${last}.alpha`, `${last}.beta`, `${name}.theta`], axes(before)];
}

function aboutEnd(robot, link) {
  const name = robot.joints[link].name, next = robot.joints[link + 1].name;
  if (robot.convention === 'dh') return [`${name}.alpha`, `${name}.beta`, `${next}.theta`];
  if (robot.convention === 'mdh') return ['alpha', 'beta', 'theta'].map(k => `${next}.${k}`);
  return ['rx', 'ry', 'rz'].map(k => `${next}.${k}`);
}

// The turn that brings z to `axis` by the shortest way, as its first two columns.
function acrossOf([x, y, z]) {
  if (z < -1 + 1e-12) return [[1, 0, 0], [0, -1, 0]];
  const f = 1 / (1 + z);
  return [[1 - x * x * f, -x * y * f, -x], [-x * y * f, 1 - y * y * f, -y]];
}

function wobble(times) {
  return (at, into) => {
    const {robot, now, joint} = at;
    let sites = [`${joint.name}.alpha`, `${joint.name}.beta`], tilts = [[1, 0], [0, 1]];
    const anyAxis = (name, T, axis) => {
      sites = ['rx', 'ry', 'rz'].map(k => `${name}.${k}`);
      tilts = acrossOf(axis).map(v => [0, 1, 2].map(k => dot(T.slice(4 * k, 4 * k + 3), v)));
    };
    if (robot.convention === 'urdf') anyAxis(joint.name, joint.T_parent_joint, joint.axis);
    else if (robot.convention === 'dh' && at.index === 0) anyAxis('base', now.base, [0, 0, 1]);
    else if (robot.convention === 'dh') sites = ['alpha', 'beta'].map(k => `${robot.joints[at.index - 1].name}.${k}`);
    tilts.forEach((tilt, k) => tilt.forEach((share, site) => {
      into(`cos_${'xy'[k]}`, sites[site], share * Math.cos(times * at.motion));
      into(`sin_${'xy'[k]}`, sites[site], share * Math.sin(times * at.motion));
    }));
  };
}

function thermal(at, into) {
  const origin = at.robot.convention === 'urdf' ? place(at.joint.T_parent_joint) : [];
  const lengths = at.robot.convention === 'urdf'
    ? [['x', origin[0]], ['y', origin[1]], ['z', origin[2]]] : [['a', at.joint.a], ['d', at.joint.d]];
  for (const [value, length] of lengths) {
    if (Math.abs(length) >= 1e-3) into('', `${at.name}.${value}`, at.warm * length);
  }
}

function linkCompliance(at, into) {
  const {robot, now, index} = at, atZero = chain(robot, now.driven.map(() => 0));
  const straight = linkEnd(robot, atZero.frames, index), start = linkStart(robot, atZero.frames, atZero.base, index, 0);
  const inEnd = [0, 1, 2].map(k => Math.abs(dot(column(straight, k), plus(place(straight), start, -1))));
  const lengthwise = inEnd.indexOf(Math.max(...inEnd));
  const end = linkEnd(robot, now.frames, index), [names, axes] = aboutStart(now, index);
  const from = linkStart(robot, now.frames, now.base, index, at.motion);
  for (let axis = 0; axis < 3; axis++) {
    if (axis === lengthwise) continue;
    const across = column(end, axis);
    const Ms = momentBeyond(now, index, from, across), Me = momentBeyond(now, index, place(end), across);
    into(`r${'xyz'[axis]}`, aboutEnd(robot, index)[axis], (Ms + 2 * Me) / 6);
    names.forEach((name, k) => into(`r${'xyz'[axis]}`, name, dot(axes[k], across) * (2 * Ms + Me) / 6));
  }
}

function gravityMoment(at, into) {
  const {robot, now} = at;
  const torque = (link, arm) => robot.joints.slice(0, link + 1).reduce((sum, joint, m) => sum + (revolute(joint)
    ? now.C[m][at.index] * dot(now.axes[m].direction, cross(arm, now.g)) : 0), 0);
  for (let link = at.index; link < robot.joints.length; link++) {
    const name = robot.joints[link].name;
    for (let k = 0; k < 3; k++) into(`${name}.${'xyz'[k]}`, at.name, torque(link, column(now.frames[link], k)));
    if (!revolute(robot.joints[link])) {
      into(`${name}.mass`, at.name, torque(link, plus([0, 0, 0], now.axes[link].direction, now.joints[link])));
    }
  }
}

// A parallelogram's crank comes no nearer to its dead centres [rad].
const DEAD_CENTRE = 0.2;

function linkage(at, into) {
  const drivers = at.joint.driven_by.map(([name]) => at.robot.joints.findIndex(j => j.name === name));
  const first = at.now.joints[Math.min(...drivers)], last = at.now.joints[Math.max(...drivers)];
  const alone = Math.min(...drivers) === Math.max(...drivers);
  const cranks = alone ? [['', last]] : [['', last - first], ['_first', first], ['_sum', first + last]];
  for (const [suffix, angle] of cranks) {
    const phase = at.parameters[`linkage.${at.name}.phase${suffix}`];
    if (phase !== undefined) bars(at, angle + phase, suffix, 0, into);
  }
}

// Of a crank at theta; `zero`: what is taken off where the joint was set to zero.
function bars(at, theta, suffix, zero, into) {
  const sine = Math.sin(theta);
  const kept = Math.sign(sine) * Math.max(Math.abs(sine), Math.sin(DEAD_CENTRE));
  into(`rods${suffix}`, at.name, 1 / kept - zero);
  into(`arms${suffix}`, at.name, Math.cos(theta) / kept);
}

function elbowLinkage(at, into) {
  const phase = at.parameters[`elbow_linkage.${at.name}.phase`];
  if (phase !== undefined) bars(at, at.now.joints[at.index] + phase, '', 1, into);
}

function zones(at, into) {
  const edges = [0, at.parameters[`stiffness_zones.${at.name}.T1`], at.parameters[`stiffness_zones.${at.name}.T2`], Infinity];
  for (let zone = 0; zone < 3; zone++) {
    const size = Math.min(Math.max(Math.abs(at.torque), edges[zone]), edges[zone + 1]) - edges[zone];
    into(`c${zone + 1}`, at.name, Math.sign(at.torque) * size);
  }
}

// A law gives `into` the last part of a parameter's name, the site, and what one of the parameter adds there.
const LAWS = {
  backlash: (at, into) => into('', at.name, 0.5 * at.direction),
  gravity_backlash: (at, into) => into('', at.name, 0.5 * Math.sign(at.torque)),
  loaded_play: (at, into) => into('', at.name, at.direction * at.torque),
  joint_compliance: (at, into) => into('', at.name, at.torque),
  stiffness_zones: zones,
  gravity_moment: gravityMoment,
  link_compliance: linkCompliance,
  harmonic: (at, into) => [1, 2].forEach(order => waves({name: order, times: order})(at, into)),
  axis_wobble: wobble(1),
  axis_wobble_twice: wobble(2),
  thermal,
  thermal_zero: (at, into) => into('', at.name, at.warm),
  linkage,
  elbow_linkage: elbowLinkage,
  neighbour_coupling: (at, into) => at.robot.joints.forEach((other, k) => into(other.name, at.name, at.now.joints[k])),
  joint_coupling: (at, into) => at.robot.joints.forEach((other, k) => into(other.name, at.name, at.now.joints[k])),
};

function lawOf(effect) {
  const mesh = /^transmission_error@(.+)$/.exec(effect);
  return mesh ? waves({name: '', times: Number(mesh[1])}) : LAWS[effect];
}

export const isKnown = effect => lawOf(effect) !== undefined;

// What an effect's parameters add: {site: value}, on top of what `added` has. `factor` enlarges it.
export function addEffect(effect, now, added, factor = 1) {
  const law = lawOf(effect.effect), {robot} = now;
  if (!law) return added;
  robot.joints.forEach((joint, index) => {
    const prefix = `${effect.effect}.${joint.name}`, place = now.driven.indexOf(joint.name);
    const at = {robot, now, index, joint, name: joint.name, motion: now.joints[index], torque: now.torque[index],
      direction: now.direction[place] ?? 0, parameters: effect.parameters,
      warm: now.temperature - (effect.parameters[`${effect.effect}.reference_C`] ?? 20)};
    // Some effects have one parameter for the robot as a whole: no joint in its name.
    const owned = Object.keys(effect.parameters).some(name => name === prefix || name.startsWith(`${prefix}.`));
    const whole = effect.effect === 'thermal' && effect.parameters.thermal !== undefined;
    if (!owned && !whole) return;
    law(at, (part, site, value) => {
      const parameter = effect.parameters[whole ? 'thermal' : part ? `${prefix}.${part}` : prefix];
      if (parameter) added[site] = (added[site] ?? 0) + factor * parameter * value;
    });
  });
  return added;
}

// Frames of a robot with its effects, under a load, at a temperature, with joints that came from one side.
export function forward(robot, reading, inputs = {}) {
  if (!robot.effects.length) return chain(robot, reading);
  const now = inputsAt(robot, reading, inputs), added = {};
  for (const effect of robot.effects) addEffect(effect, now, added);
  return chain(robot, reading, added);
}
