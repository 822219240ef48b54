// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The script of every report. What it draws stands in the page as JSON; where it does not run, the page's tables and
// static pictures remain.

import {drawCharts} from './charts.js';
import {forward} from './effects.js';
import {chain} from './kinematics.js';
import {makeTablesSortable} from './tables.js';
import {showScenes} from './scene.js';

const read = id => JSON.parse(document.getElementById(id)?.textContent ?? '[]');
const narrow = matchMedia('(max-width: 640px)').matches;

drawCharts(read('charts'), narrow);
makeTablesSortable();
showScenes(read('scenes'), narrow);
window.truing = {forward, chain};  // for tests that hold it against the core
