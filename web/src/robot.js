// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The robot of a scene: turned by sliders, beside the robot as it was found, with what is wrong enlarged.

import {Arm} from './arm.js';
import {button, choice, element, slider} from './controls.js';
import {addEffect, inputsAt, isKnown} from './effects.js';
import {chain, place, plus} from './kinematics.js';
import {lengthText, rowsOf, roundedDown, unpacked} from './numbers.js';

const MODEL = '#8b95a1', FOUND = '#566270', RECORDED = '#1c2530', SIMULATED = '#d98324';
const DRAWN = 0.12;  // of the reach: how far an error is drawn at first
const MOST_LABELS = 3;  // joints with their names beside them
const LARGEST = 1e6;  // times that it is enlarged

// What a curve says at the inputs of now: straight between its points, level beyond them.
function valueOn(points, x) {
  if (x <= points[0][0]) return points[0][1];
  for (let k = 1; k < points.length; k++) {
    const [[x0, y0], [x1, y1]] = [points[k - 1], points[k]];
    if (x <= x1) return y0 + (y1 - y0) * (x - x0) / (x1 - x0 || 1);
  }
  return points[points.length - 1][1];
}

function inputOf(name, now) {
  const parts = /^([a-z]+?)(\d*)$/.exec(name), number = Number(parts?.[2] ?? 0) - 1;
  const read = {q: now.joints[number], torque: now.torque[number], dir: now.direction[number], payload: now.payload,
    temp: now.temperature};
  return read[parts?.[1]];
}

function addCurve({site, input, second, points}, now, added, factor) {
  const x = inputOf(input, now);
  if (x === undefined || !points.length) return;
  if (second) {
    const other = inputOf(second.input, now);
    if (other === undefined || other < second.range[0] || other > second.range[1]) return;
  }
  added[site] = (added[site] ?? 0) + factor * valueOn(points, x);
}

// The chain with what a cause adds, `factor` times.
function withCause(robot, reading, now, cause, factor) {
  const added = {};
  for (const effect of robot.effects) addEffect(effect, now, added);
  for (const [site, value] of Object.entries(cause?.added ?? {})) added[site] = (added[site] ?? 0) + factor * value;
  for (const effect of cause?.effects ?? []) addEffect(effect, now, added, factor);
  for (const curve of cause?.curves ?? []) addCurve(curve, now, added, factor);
  return chain(robot, reading, added);
}

const tipOf = ({frames}) => place(frames[frames.length - 1]);
const between = (a, b) => Math.hypot(...plus(tipOf(b), tipOf(a), -1));

function readingText({unit}) {
  return unit === 'rad' ? v => `${(v * 180 / Math.PI).toFixed(1)}°` : v => `${(1e3 * v).toFixed(1)} mm`;
}

// A slider over powers of ten.
function factorSlider(parent, name, start, changed) {
  return slider(parent, {name, low: 0, high: Math.log10(LARGEST), value: Math.log10(start), step: 0.01,
    text: v => `${Number((10 ** v).toPrecision(2))} ×`}, v => changed(10 ** v));
}

// Effects that a page cannot draw: of the instrument, or of inputs that have no slider.
function leftOut(cause) {
  const names = cause.effects.map(e => e.effect).filter(name => !isKnown(name)).map(name => name.replaceAll('_', ' '));
  return names.length ? ` Not drawn: ${[...new Set(names)].join(', ')}.` : '';
}

class RobotInScene {
  constructor(view, spec, panel) {
    Object.assign(this, {view, spec, panel, model: spec.model, reading: [...spec.value], causes: spec.causes});
    this.inputs = {payload: spec.payload?.value ?? 0, temperature: spec.temperature?.value ?? 20,
      direction: spec.value.map(() => 1)};
    this.chosen = 0;
    const radius = 0.022 * spec.reach, {meshes} = spec;
    this.arm = new Arm(view, this.model, {radius, meshes, colour: MODEL, opacity: this.causes.length ? 0.45 : 1});
    if (this.causes.length) this.found = new Arm(view, this.model, {radius: 0.98 * radius, meshes, colour: FOUND, opacity: 1});
    this.note = element('p', 'note');
    this.controls();
    panel.append(this.note);
    this.show();
  }

  controls() {
    const {spec, panel} = this;
    if (this.causes.length > 1) {
      choice(panel, 'shown', this.causes.map(c => c.name), k => { this.chosen = k; this.enlarge(); this.show(); });
    }
    if (this.causes.length) {
      this.factor = this.usualFactor();
      this.factorSlider = factorSlider(panel, 'enlarged', this.factor, f => { this.factor = f; this.show(); });
    }
    if (spec.poses) this.poseSlider();
    this.jointSliders = spec.joints.map((joint, k) => slider(panel, {name: joint.name, low: joint.lower, high: joint.upper,
      value: spec.value[k], text: readingText(joint)}, v => { this.reading[k] = v; this.show(); }));
    const input = (range, name, text, key) => range && slider(panel, {name, ...range, text},
      v => { this.inputs[key] = v; this.show(); });
    input(spec.payload, 'load', v => `${Number(v.toPrecision(3))} kg`, 'payload');
    input(spec.temperature, 'temperature', v => `${v.toFixed(1)} °C`, 'temperature');
    if (spec.directions) {
      choice(panel, 'joints came', ['from below', 'from above'],
        k => { this.inputs.direction = spec.value.map(() => (k ? -1 : 1)); this.show(); });
    }
  }

  poseSlider() {
    const {names, readings} = this.spec.poses, rows = rowsOf(unpacked(readings), this.spec.value.length);
    slider(this.panel, {name: 'pose', low: 0, high: rows.length - 1, value: 0, step: 1, text: k => names[k]}, k => {
      this.reading = [...rows[k]];
      this.reading.forEach((v, j) => this.jointSliders[j].set(v));
      this.show();
    });
  }

  now() { return inputsAt(this.model, this.reading, this.inputs); }

  // What makes the largest error over a few poses seen well.
  usualFactor() {
    const cause = this.causes[this.chosen], {joints, value, reach} = this.spec;
    const off = reading => {
      const now = inputsAt(this.model, reading, this.inputs);
      return between(withCause(this.model, reading, now, null, 0), withCause(this.model, reading, now, cause, 1));
    };
    const ends = [0.25, 0.75].map(f => joints.map(({lower, upper}) => lower + f * (upper - lower)));
    const largest = Math.max(...[value, ...ends].map(off));
    return largest > 0 ? Math.min(Math.max(roundedDown(DRAWN * reach / largest), 1), LARGEST) : 1;
  }

  enlarge() {
    this.factor = this.usualFactor();
    this.factorSlider.set(Math.log10(this.factor));
  }

  show() {
    const now = this.now(), cause = this.causes[this.chosen];
    const model = withCause(this.model, this.reading, now, null, 0);
    const marked = Object.fromEntries((cause?.joints ?? []).map(name => [name, cause.colour]));
    this.arm.show(model, this.found ? {} : marked);
    if (this.found) {
      this.found.show(withCause(this.model, this.reading, now, cause, this.factor), marked);
      const off = between(model, withCause(this.model, this.reading, now, cause, 1));
      this.note.textContent = `Here it moves the tip by ${lengthText(off)}: the dark robot, drawn `
        + `${Number(this.factor.toPrecision(2))} times as large, against its model, the pale one.${leftOut(cause)}`;
    }
    this.label(model, cause);
    this.view.draw();
  }

  label({axes}, cause) {
    this.labels ??= {};
    for (const {note} of Object.values(this.labels)) note.style.display = 'none';
    const joints = cause?.joints ?? [];
    for (const name of joints.length <= MOST_LABELS ? joints : []) {
      const k = this.model.joints.findIndex(joint => joint.name === name);
      if (k < 0) continue;
      this.labels[name] ??= this.view.label(name, cause.colour);
      this.labels[name].note.style.display = '';
      this.labels[name].note.style.color = cause.colour;
      this.labels[name].point.set(...axes[k].point);
    }
  }
}

// Two motions over each other, played.
class RobotPlayed {
  constructor(view, spec, panel) {
    const {time, first, name, others} = spec.play, rows = values => rowsOf(unpacked(values), spec.value.length);
    Object.assign(this, {view, spec, name, factor: 1, time: unpacked(time), first: rows(first), chosen: 0,
      others: others.map(other => ({name: other.name, rows: rows(other.readings)}))});
    const radius = 0.022 * spec.reach, {meshes} = spec;
    this.arms = [
      new Arm(view, spec.model, {radius: 0.9 * radius, meshes, colour: RECORDED, opacity: 1}),
      new Arm(view, spec.model, {radius, meshes, colour: SIMULATED, opacity: 0.55}),
    ];
    const last = this.time.length - 1;
    if (others.length > 1) choice(panel, 'against', others.map(o => o.name), k => { this.chosen = k; this.show(); });
    button(panel, '▶ play', self => this.toggle(self));
    this.slider = slider(panel, {name: 'time', low: this.time[0], high: this.time[last], value: this.time[0],
      text: v => `${v.toFixed(2)} s`}, v => { this.at = v; this.show(); });
    factorSlider(panel, 'difference', 1, f => { this.factor = f; this.show(); });
    this.at = this.time[this.farthest()];
    this.slider.set(this.at);
    this.note = element('p', 'note');
    panel.append(this.note);
    this.show();
  }

  // The moment at which the two are farthest apart: what a reader is to see first.
  farthest() {
    const off = this.first.map((row, k) => Math.hypot(...row.map((v, j) => v - this.others[0].rows[k][j])));
    return off.indexOf(Math.max(...off));
  }

  toggle(self) {
    this.playing = !this.playing;
    self.textContent = this.playing ? '❚❚ pause' : '▶ play';
    if (!this.playing) return;
    let before = performance.now();
    const step = stamp => {
      if (!this.playing) return;
      this.at += (stamp - before) / 1e3;
      before = stamp;
      const end = this.time[this.time.length - 1];
      if (this.at > end) this.at = this.time[0];
      this.slider.set(this.at);
      this.show();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  // Between the two samples about now.
  readings() {
    let k = 1;
    while (k < this.time.length - 1 && this.time[k] < this.at) k++;
    const f = Math.min(Math.max((this.at - this.time[k - 1]) / (this.time[k] - this.time[k - 1] || 1), 0), 1);
    const between = rows => rows[k - 1].map((v, j) => v + f * (rows[k][j] - v));
    return [between(this.first), between(this.others[this.chosen].rows)];
  }

  show() {
    const [first, second] = this.readings(), {model} = this.spec;
    const shown = second.map((v, j) => first[j] + this.factor * (v - first[j]));
    const a = chain(model, first), b = chain(model, second);
    this.arms[0].show(a);
    this.arms[1].show(chain(model, shown));
    this.note.textContent = `${this.name}: dark, ${this.others[this.chosen].name}: orange; now their tips are ${lengthText(between(a, b))} apart, `
      + (this.factor === 1 ? 'drawn as it is.' : `drawn ${Number(this.factor.toPrecision(2))} times as far.`);
    this.view.draw();
  }
}

export function addRobot(view, spec, panel) {
  return spec.play ? new RobotPlayed(view, spec, panel) : new RobotInScene(view, spec, panel);
}
