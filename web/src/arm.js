// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// A robot as capsules between its joint frames, with a short drum along every joint's axis.

import {Color, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Quaternion, SphereGeometry, Vector3} from 'three';

import {place} from './kinematics.js';

const UP = new Vector3(0, 1, 0);

function lay(mesh, from, to, radius) {
  const span = to.clone().sub(from), length = span.length();
  mesh.visible = length > 1e-9;
  mesh.position.copy(from).addScaledVector(span, 0.5);
  mesh.quaternion.copy(new Quaternion().setFromUnitVectors(UP, length > 1e-9 ? span.divideScalar(length) : UP));
  mesh.scale.set(radius, Math.max(length, 1e-9), radius);
}

export class Arm {
  constructor(view, robot, {radius, colour, opacity}) {
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
    view.scene.add(this.group);
  }

  // `marked`: {joint's name: colour}.
  show({base, frames, corners, axes}, marked = {}) {
    const r = this.radius, points = [place(base)];
    frames.forEach((T, k) => {
      if (corners[k]) points.push(corners[k]);
      points.push(place(T));
    });
    const at = points.map(p => new Vector3(...p));
    this.rods.forEach((mesh, k) => {
      if (k + 1 < at.length) lay(mesh, at[k], at[k + 1], r);
      else mesh.visible = false;
    });
    this.balls.forEach((mesh, k) => {
      mesh.visible = k < at.length;
      if (mesh.visible) mesh.position.copy(at[k]);
      mesh.scale.setScalar(r);
    });
    this.drums.forEach((mesh, k) => {
      const {point, direction} = axes[k], middle = new Vector3(...point), half = new Vector3(...direction).multiplyScalar(1.5 * r);
      const colour = marked[this.robot.joints[k].name];
      lay(mesh, middle.clone().sub(half), middle.clone().add(half), (colour ? 2.1 : 1.5) * r);
      mesh.material.color.set(colour ?? this.colour);
      mesh.material.transparent = colour ? false : mesh.material.opacity < 1;
    });
  }
}
