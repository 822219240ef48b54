// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Charts by plotly.js, in the place of the static pictures that the page has of them.

import Plotly from 'plotly.js/lib/core';
import bar from 'plotly.js/lib/bar';
import heatmap from 'plotly.js/lib/heatmap';

Plotly.register([bar, heatmap]);  // scatter is in the core

const FONT = {family: 'system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif', size: 13, color: '#1c2530'};
const AXIS = {gridcolor: '#e6e9ed', zeroline: false, linecolor: '#c8ced6', ticks: 'outside', tickcolor: '#c8ced6', automargin: true};
const CONFIG = {displaylogo: false, displayModeBar: false};

function drawChart(div, data, layout, narrow) {
  const full = {font: FONT, paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', showlegend: false, hovermode: 'closest',
    margin: {l: narrow ? 44 : 56, r: 12, t: layout.title || layout.showlegend ? 34 : 12, b: 44}, dragmode: narrow ? false : 'zoom', ...layout};
  for (const key of ['xaxis', 'yaxis']) if (full[key]) full[key] = {...AXIS, ...full[key], ...(narrow ? {fixedrange: true} : {})};
  if (full.title) full.title = {...full.title, font: {size: 15}, x: 0.02, xanchor: 'left', y: 0.97, yanchor: 'top'};
  div.replaceChildren();
  Plotly.newPlot(div, data, full, CONFIG);
  // At once; plotly.js itself waits for the window.
  if (window.ResizeObserver) new ResizeObserver(() => Plotly.relayout(div, {autosize: true})).observe(div);
}

export function drawCharts(charts, narrow) {
  for (const {id, data, layout} of charts) drawChart(document.getElementById(id), data, layout, narrow);
}
