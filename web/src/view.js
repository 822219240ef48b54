// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// A space that its reader turns: camera, light, floor; lines, points and arrows in it. z is up, lengths are metres.

import {
  AmbientLight, BufferGeometry, CanvasTexture, Color, ConeGeometry, DirectionalLight, Float32BufferAttribute, GridHelper,
  Group, InstancedMesh, Matrix4, MeshBasicMaterial, PerspectiveCamera, Points, PointsMaterial, Quaternion, Scene, Vector3,
  WebGLRenderer,
} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';

import {element} from './controls.js';
import {roundedDown, unpacked} from './numbers.js';

const FIT = 1.08;  // room around everything
const SHOWN_WITHIN = 10;  // [px] of a point, its text is shown
const UP = new Vector3(0, 1, 0);  // along which three.js makes its cones and cylinders

let disc = null;

function discTexture() {
  if (disc) return disc;
  const canvas = element('canvas'), size = 64;
  canvas.width = canvas.height = size;
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#fff';
  pen.arc(size / 2, size / 2, size / 2 - 1, 0, 2 * Math.PI);
  pen.fill();
  disc = new CanvasTexture(canvas);
  return disc;
}

// A colour between those of a scale, at a fraction of it.
function colourAt(scale, fraction) {
  const at = Math.min(Math.max(fraction, 0), 1) * (scale.length - 1), k = Math.min(Math.floor(at), scale.length - 2);
  return new Color(scale[k]).lerp(new Color(scale[k + 1]), at - k);
}

// Pairs of points, from a line with gaps.
function segments(xyz) {
  const out = [];
  for (let k = 3; k < xyz.length; k += 3) {
    const both = xyz.subarray(k - 3, k + 3);
    if (both.every(Number.isFinite)) out.push(...both);
  }
  return out;
}

export class View {
  // Throws where there is no WebGL.
  constructor(div, {bounds, outermost, eye}) {
    this.div = div;
    this.renderer = new WebGLRenderer({antialias: true, alpha: true});
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 0.001, 1e4);
    this.hovered = [];  // points with texts
    this.labels = [];
    this.materials = [];  // whose lines have a width in pixels
    div.replaceChildren(this.renderer.domElement);
    this.tip = element('div', 'tip');
    div.append(this.tip);
    this.#look(bounds, outermost, eye);
    this.#light();
    this.#floor(bounds);
    this.#follow();
  }

  #look([low, high], outermost, eye) {
    const middle = low.map((v, k) => (v + high[k]) / 2), size = Math.hypot(...low.map((v, k) => high[k] - v)) || 1;
    this.size = size;
    this.camera.up.set(0, 0, 1);
    const direction = new Vector3(...eye).normalize();
    this.camera.position.set(...middle).addScaledVector(direction, this.#away(outermost, new Vector3(...middle), direction));
    this.camera.near = size / 200;
    this.camera.far = 30 * size;
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.target.set(...middle);
    this.controls.zoomSpeed = 0.6;
    this.controls.addEventListener('change', () => this.draw());
    this.controls.update();
    // A wheel scrolls the page until the picture was touched.
    this.controls.enableZoom = false;
    this.renderer.domElement.addEventListener('pointerdown', () => { this.controls.enableZoom = true; });
    this.div.addEventListener('pointerleave', () => { this.controls.enableZoom = false; });
  }

  // How far the camera is from the middle, so that the outermost points just fit.
  #away(outermost, middle, direction) {
    const {clientWidth, clientHeight} = this.div, upright = Math.tan(this.camera.fov * Math.PI / 360);
    const across = upright * Math.max(clientWidth, 1) / Math.max(clientHeight, 1);
    const right = new Vector3(0, 0, 1).cross(direction).normalize(), up = direction.clone().cross(right);
    let away = 1e-3;
    for (const point of outermost) {
      const at = new Vector3(...point).sub(middle);
      const room = Math.max(Math.abs(at.dot(up)) / upright, Math.abs(at.dot(right)) / across);
      away = Math.max(away, at.dot(direction) + FIT * room);
    }
    return away;
  }

  #light() {
    this.scene.add(new AmbientLight('#ffffff', 1.6));
    const sun = new DirectionalLight('#ffffff', 2.2);
    sun.position.set(1, -0.7, 2);
    this.scene.add(sun);
  }

  #floor([low, high]) {
    const wide = Math.max(high[0] - low[0], high[1] - low[1], 1e-3), step = roundedDown(wide / 5);
    const count = 2 * Math.ceil((0.65 * wide) / step);
    const grid = new GridHelper(count * step, count, '#c3cad3', '#e3e7ec');
    grid.rotation.x = Math.PI / 2;
    grid.position.set(...[0, 1].map(k => step * Math.round((low[k] + high[k]) / 2 / step)), low[2]);
    this.scene.add(grid);
    const scale = step >= 1 ? `${step} m` : step >= 1e-3 ? `${Number((1e3 * step).toPrecision(3))} mm` : `${step} m`;
    this.div.append(element('div', 'floor', `a square of the floor: ${scale} · drag to turn, click and scroll to zoom`));
    const length = 0.1 * wide;
    ['#c0392b', '#2e8b57', '#2f5fd0'].forEach((colour, axis) => {
      const end = [0, 0, 0];
      end[axis] = length;
      this.addSegments([0, 0, 0, ...end], colour, 3, 1);
    });
  }

  #follow() {
    const resize = () => {
      const {clientWidth, clientHeight} = this.div;
      if (!clientWidth || !clientHeight) return;
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      this.renderer.setSize(clientWidth, clientHeight);
      this.camera.aspect = clientWidth / clientHeight;
      this.camera.updateProjectionMatrix();
      for (const material of this.materials) material.resolution.set(clientWidth, clientHeight);
      this.draw();
    };
    resize();
    if (window.ResizeObserver) new ResizeObserver(resize).observe(this.div);
    this.renderer.domElement.addEventListener('pointermove', event => this.#hover(event));
  }

  // Once for all changes of a moment.
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.renderer.render(this.scene, this.camera);
      for (const {note, point} of this.labels) this.#put(note, point);
    });
  }

  #onScreen(point) {
    const at = point.clone().project(this.camera), {clientWidth, clientHeight} = this.div;
    return [(at.x + 1) / 2 * clientWidth, (1 - at.y) / 2 * clientHeight, at.z];
  }

  #put(note, point) {
    const [x, y, depth] = this.#onScreen(point);
    note.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
    note.hidden = depth > 1;
  }

  #hover(event) {
    const frame = this.renderer.domElement.getBoundingClientRect();
    const [x, y] = [event.clientX - frame.left, event.clientY - frame.top];
    let best = SHOWN_WITHIN, found = null;
    for (const {group, xyz, texts, name} of this.hovered) {
      if (!group.visible) continue;
      for (let k = 0; k < texts.length; k++) {
        const [px, py] = this.#onScreen(new Vector3(...xyz.subarray(3 * k, 3 * k + 3)));
        const off = Math.hypot(px - x, py - y);
        if (off < best) [best, found] = [off, {text: texts[k] || name, px, py}];
      }
    }
    this.tip.textContent = found ? found.text : '';
    this.tip.style.display = found ? 'block' : 'none';
    if (found) this.tip.style.transform = `translate(${Math.round(found.px) + 12}px, ${Math.round(found.py) + 8}px)`;
  }

  label(text, colour) {
    const note = element('div', 'label', text), label = {note, point: new Vector3()};
    note.style.color = colour;
    this.div.append(note);
    this.labels.push(label);
    return label;
  }

  addSegments(pairs, colour, width, opacity, parent = this.scene) {
    const geometry = new LineSegmentsGeometry(), {clientWidth, clientHeight} = this.div;
    geometry.setPositions(pairs);
    const material = new LineMaterial({color: new Color(colour), linewidth: width, transparent: opacity < 1, opacity});
    material.resolution.set(clientWidth || 1, clientHeight || 1);
    this.materials.push(material);
    const lines = new LineSegments2(geometry, material);
    parent.add(lines);
    return lines;
  }

  addLines({xyz, colour, width, opacity}) {
    const pairs = segments(unpacked(xyz)), group = new Group();
    if (pairs.length) this.addSegments(pairs, colour, width, opacity, group);
    this.scene.add(group);
    return group;
  }

  addPoints({xyz, name, size, opacity, colour, colours, values, shades, limit, texts}) {
    const places = unpacked(xyz), geometry = new BufferGeometry(), group = new Group();
    const each = values && Array.from(unpacked(values), v => colourAt(shades, v / limit));
    const paint = each ?? colours?.map(c => new Color(c));
    geometry.setAttribute('position', new Float32BufferAttribute(places, 3));
    if (paint) geometry.setAttribute('color', new Float32BufferAttribute(paint.flatMap(c => [c.r, c.g, c.b]), 3));
    const material = new PointsMaterial({size: size * 2 * Math.min(window.devicePixelRatio || 1, 2), sizeAttenuation: false,
      map: discTexture(), alphaTest: 0.4, transparent: true, opacity, ...(paint ? {vertexColors: true} : {color: new Color(colour)})});
    group.add(new Points(geometry, material));
    if (texts) this.hovered.push({group, xyz: places, texts, name});
    this.scene.add(group);
    return group;
  }

  // Strokes with heads, from `start` along `along`.
  addArrows({start, along, colour, width, opacity}) {
    const from = unpacked(start), by = unpacked(along), group = new Group(), pairs = [];
    const head = 0.012 * this.size, count = from.length / 3;
    const cone = new ConeGeometry(0.3, 1, 10).translate(0, -0.5, 0);
    const heads = new InstancedMesh(cone, new MeshBasicMaterial({color: new Color(colour), transparent: opacity < 1, opacity}), count);
    for (let k = 0; k < count; k++) {
      const a = new Vector3(...from.subarray(3 * k, 3 * k + 3)), v = new Vector3(...by.subarray(3 * k, 3 * k + 3));
      const b = a.clone().add(v), size = Math.min(head, 0.6 * v.length());
      pairs.push(...a.toArray(), ...b.toArray());
      const turned = new Quaternion().setFromUnitVectors(UP, v.length() ? v.clone().normalize() : UP);
      heads.setMatrixAt(k, new Matrix4().compose(b, turned, new Vector3(size, size, size)));
    }
    if (count) this.addSegments(pairs, colour, width, opacity, group);
    group.add(heads);
    this.scene.add(group);
    return group;
  }
}
