// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The 3-D pictures of a page. Where WebGL is missing, the static picture stays; on a phone it stays until it is asked
// for, because a picture that is turned by a finger would swallow scrolling.

import {button, element, toggle} from './controls.js';
import {addRobot} from './robot.js';
import {View} from './view.js';

function addBar(view, {unit, shades, limit}) {
  const bar = element('div', 'colours'), strip = element('i');
  strip.style.background = `linear-gradient(to top, ${shades.join(',')})`;
  bar.append(element('span', '', `${Number(limit.toPrecision(2))} ${unit}`), strip, element('span', '', '0'));
  view.div.append(bar);
  return bar;
}

function show(div, spec) {
  const picture = div.querySelector('.picture'), view = new View(picture, spec);
  const shown = [];  // what buttons switch
  const keep = (group, object) => { if (group) shown.push([group, on => { object.visible = on; }]); };
  for (const lines of spec.lines) keep(lines.group, view.addLines(lines));
  for (const arrows of spec.arrows) keep(arrows.group, view.addArrows(arrows));
  for (const points of spec.points) {
    keep(points.group, view.addPoints(points));
    if (points.values) {
      const bar = addBar(view, points);
      if (points.group) shown.push([points.group, on => { bar.style.display = on ? '' : 'none'; }]);
    }
  }
  const panel = element('div', 'controls');
  const select = name => { shown.forEach(([group, set]) => set(group === name)); view.draw(); };
  if (spec.groups.length) {
    toggle(panel, spec.groups, select);
    select(spec.groups[0]);
  }
  if (spec.robot) addRobot(view, spec.robot, panel);
  if (panel.children.length) div.append(panel);
  div.classList.add('drawn');
  view.draw();
}

export function showScenes(scenes, narrow) {
  for (const spec of scenes) {
    const div = document.getElementById(spec.id);
    const start = () => {
      try {
        show(div, spec);
      } catch (error) {
        console.warn(`no 3-D picture: ${error.message}`);
      }
    };
    if (!narrow) start();
    else button(div, 'turn it in 3-D', self => { self.remove(); start(); });
  }
}
