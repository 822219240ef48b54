// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// A robot as its links' meshes where there are some, else as capsules between its joint frames, with a short drum along
// every joint's axis.

import {
  BufferGeometry, Color, CylinderGeometry, DoubleSide, Float32BufferAttribute, Group, Mesh, MeshLambertMaterial,
  Quaternion, SphereGeometry, Vector3,
} from 'three';

import {place} from './kinematics.js';
import {unpacked} from './numbers.js';

const UP = new Vector3(0, 1, 0);

function lay(mesh, from, to, radius) {
  const span = to.clone().sub(from), length = span.length();
  mesh.visible = length > 1e-9;
  mesh.position.copy(from).addScaledVector(span, 0.5);
  mesh.quaternion.copy(new Quaternion().setFromUnitVectors(UP, length > 1e-9 ? span.divideScalar(length) : UP));
  mesh.scale.set(radius, Math.max(length, 1e-9), radius);
}

// Sharp edges between its faces: without shared corners every face has a normal of its own.
function shapeOf({points, faces}) {
  const at = unpacked(points), corners = Array.from(unpacked(faces), k => [at[3 * k], at[3 * k + 1], at[3 * k + 2]]);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new Float32BufferAttribute(corners.flat(), 3));
  geometry.computeVertexNormals();
  return geometry;
}

export class Arm {
  // `meshes`: of links, by the joint that they move with (-1: the base); links that have one are no capsules.
  constructor(view, robot, {radius, colour, opacity, meshes = []}) {
    this.robot = robot;
    this.radius = radius;
    this.colour = colour;
    const material = () => new MeshLambertMaterial({color: new Color(colour), transparent: opacity < 1, opacity, depthWrite: opacity === 1});
    const rod = new CylinderGeometry(1, 1, 1, 20), ball = new SphereGeometry(1, 20, 14);
    this.group = new Group();
    const make = (count, shape, shared) => Array.from({length: count}, () => {
      const mesh = new Mesh(shape, shared ?? material());
      this.group.add(mesh);
      return mesh;
    });
    const skin = material(), links = robot.joints.length + 1;
    this.rods = make(2 * links, rod, skin);
    this.balls = make(2 * links + 1, ball, skin);
    this.drums = make(robot.joints.length, rod);
    if (meshes.length) skin.side = DoubleSide;
    this.shapes = meshes.map(({joint, ...mesh}) => ({joint, mesh: new Mesh(shapeOf(mesh), skin)}));
    this.shapes.forEach(({mesh}) => { mesh.matrixAutoUpdate = false; this.group.add(mesh); });
    this.meshed = new Set(meshes.map(({joint}) => joint));
    view.scene.add(this.group);
  }

  // `marked`: {joint's name: colour}.
  show({base, frames, corners, axes}, marked = {}) {
    const r = this.radius, points = [place(base)], last = frames.length - 2;
    const links = [];  // of the rods: link k is behind joint k, the last one carries the tool
    frames.forEach((T, k) => {
      if (corners[k]) points.push(corners[k]);
      points.push(place(T));
      while (links.length < points.length - 1) links.push(k - 1);
    });
    this.shapes.forEach(({joint, mesh}) => {
      mesh.matrix.set(...(joint < 0 ? base : frames[joint]), 0, 0, 0, 1);
      mesh.matrixWorldNeedsUpdate = true;
    });
    const meshed = link => link < last && this.meshed.has(link);
    const at = points.map(p => new Vector3(...p));
    this.rods.forEach((mesh, k) => {
      if (k + 1 < at.length && !meshed(links[k])) lay(mesh, at[k], at[k + 1], r);
      else mesh.visible = false;
    });
    this.balls.forEach((mesh, k) => {
      mesh.visible = k < at.length && !(meshed(links[k - 1] ?? links[k]) && meshed(links[k] ?? last));
      if (mesh.visible) mesh.position.copy(at[k]);
      mesh.scale.setScalar(r);
    });
    this.drums.forEach((mesh, k) => {
      const {point, direction} = axes[k], middle = new Vector3(...point), half = new Vector3(...direction).multiplyScalar(1.5 * r);
      const colour = marked[this.robot.joints[k].name];
      lay(mesh, middle.clone().sub(half), middle.clone().add(half), (colour ? 2.1 : 1.5) * r);
      mesh.visible &&= Boolean(colour) || !(this.meshed.has(k) || this.meshed.has(k - 1));
      mesh.material.color.set(colour ?? this.colour);
      mesh.material.transparent = colour ? false : mesh.material.opacity < 1;
    });
  }
}
