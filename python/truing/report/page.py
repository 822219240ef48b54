# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An HTML report: one file, with plotly.js inside, that opens without a network.

The first screen of a report answers what its reader came to ask; what is below is for finding out why. A report is made from
the dictionary that is written as ``result.json`` and from tables of rows, so that it never knows more than what is on disk.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from truing.report.json_text import without_nan
from truing.report.words import escaped


class Page:
    """Collects markup and charts; charts are drawn by plotly.js once the page is there. `style`: more of it,
    after the common one.
    """

    def __init__(self, title: str, style: str = "") -> None:
        self._title = title
        self._style = _STYLE + style
        self._body: list[str] = []
        self._charts: list[dict[str, Any]] = []

    def add(self, markup: str) -> None:
        self._body.append(markup)

    def chart(self, name: str, data: list[dict[str, Any]], layout: dict[str, Any], size: str) -> None:
        self._body.append(f'<div class="chart {size}" id="{name}"></div>')
        self._charts.append({"id": name, "data": data, "layout": layout})

    def html(self) -> str:
        from plotly.offline import (
            get_plotlyjs,
        )  # late: it is the slowest import of all, and most commands need none

        charts = json.dumps(without_nan(self._charts), separators=(",", ":"), allow_nan=False).replace(
            "</", "<\\/"
        )
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport"'
            ' content="width=device-width, initial-scale=1">'
            f"<title>{escaped(self._title)}</title><style>{self._style}</style></head>\n<body><main>\n"
            + "\n".join(self._body)
            + f'\n</main>\n<script>{get_plotlyjs()}</script>\n<script type="application/json"'
            f' id="charts">{charts}</script>\n<script>{_SCRIPT}</script>\n</body></html>\n'
        )


def table_cell(value: float, text: str) -> str:
    return f'<td data-v="{value:.9g}">{text}</td>'


def warnings_card(result: Mapping[str, Any]) -> str:
    items = "".join(f"<li>{escaped(w)}</li>" for w in result.get("warnings", []))
    return (
        f'<section class="card" id="warnings"><h2>Warnings</h2><ul class="plain">{items}</ul></section>'
        if items
        else ""
    )


def footer(result: Mapping[str, Any]) -> str:
    parts = [f"truing {escaped(result.get('version', ''))}", escaped(result["format"])]
    if "solver" in result:
        parts.append(f"{escaped(result['solver']['name'])}: {escaped(result['solver']['stopped_because'])}")
    if "seed" in result:
        parts.append(f"seed {result['seed']}")
    return f"<footer>{' · '.join(parts)}</footer>"


_STYLE = """
:root{--before:#b5650f;--after:#1f5fa8;--ink:#1c2530;--muted:#5b6673;--line:#dfe3e8;--good:#1e7a46;--look:#9a6700;--bad:#b3261e}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:#f5f6f8;color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
main{max-width:1320px;margin:0 auto;padding:24px 28px 40px;display:grid;gap:18px;grid-template-columns:minmax(0,1fr)}
header h1{font-size:clamp(23px,2.7vw,36px);line-height:1.2;font-weight:650;letter-spacing:-.012em;margin:2px 0 4px;text-wrap:balance}
header h1 span{white-space:nowrap}
.kicker{margin:0;color:var(--muted);font-size:14px;letter-spacing:.02em}
.sub{margin:0;color:var(--muted);max-width:95ch}
span.before{color:var(--before)} .after{color:var(--after)}
.big{display:grid;grid-template-columns:repeat(3,minmax(0,1fr));gap:14px}
.number,.card{background:#fff;border:1px solid var(--line);border-radius:10px}
.number{padding:12px 18px 14px;line-height:1.15}
.number p{margin:0 0 4px;color:var(--muted);font-size:15px}
.number span.before{font-size:27px;font-weight:550}
.number .arrow{color:var(--muted);font-size:23px;margin:0 9px}
.number strong{font-size:44px;font-weight:700;letter-spacing:-.02em}
.number .unit{color:var(--muted);font-size:18px;margin-left:6px}
.number div{display:flex;flex-wrap:wrap;align-items:baseline}
.number em{margin-left:auto;align-self:center;font-style:normal;font-size:14px;color:var(--good);background:#e9f5ee;border-radius:20px;padding:4px 11px;white-space:nowrap}
.number em.bad{color:var(--bad);background:#fbeceb} .number em.same{color:var(--muted);background:#eef0f3}
.first{display:grid;grid-template-columns:minmax(0,1.35fr) minmax(0,1fr);gap:18px}
.card{padding:16px 20px;min-width:0}
.card h2{font-size:19px;line-height:1.3;margin:0 0 8px;font-weight:650}
.lead,.note{margin:0 0 8px;color:var(--muted);max-width:125ch} .note{font-size:14px;margin:6px 0 0}
.muted{color:var(--muted)}
.trust{border-top:5px solid var(--good)} .trust.t1{border-top-color:#d99a00} .trust.t2{border-top-color:var(--bad)}
.trust ul{list-style:none;margin:0;padding:0;display:grid;gap:8px}
.trust li{display:grid;grid-template-columns:26px minmax(0,1fr);gap:8px;line-height:1.35;overflow-wrap:anywhere}
.trust i{font-style:normal;font-weight:700;width:24px;height:24px;border-radius:50%;text-align:center;line-height:24px;font-size:14px;color:#fff;background:var(--good)}
.trust .g1 i{background:var(--look)} .trust .g2 i{background:var(--bad)}
.trust b{display:block;font-weight:600} .trust span{color:var(--muted);font-size:14.5px}
a{color:var(--after)}
.chart{width:100%} .chart.tall{height:350px} .chart.cloud{height:600px} .chart.wide{height:340px} .chart.small{height:240px}
.flat{display:grid;grid-template-columns:repeat(auto-fit,minmax(290px,1fr));gap:10px} .flat>div{height:360px;min-width:0}
.multiples{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,330px),1fr));gap:10px}
.multiples .chart{min-width:0}
.legend{margin:0 0 6px;color:var(--muted)} .legend i{display:inline-block;width:12px;height:12px;border-radius:50%;margin:0 5px 0 10px;vertical-align:-1px}
.legend i.before{background:#d98324;margin-left:0} .legend i.after{background:var(--after)}
.toggle{display:inline-flex;border:1px solid var(--line);border-radius:8px;overflow:hidden}
.toggle button{border:0;background:#fff;padding:7px 18px;font:inherit;color:var(--muted);cursor:pointer}
.toggle button.on{background:var(--after);color:#fff}
.scroll{overflow-x:auto;-webkit-overflow-scrolling:touch}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th,td{text-align:right;padding:5px 14px 5px 0;border-bottom:1px solid #eef0f3;white-space:nowrap;font-weight:400}
th:first-child,td:first-child{text-align:left;font-weight:550}
thead th{border-bottom:2px solid var(--line)} thead button{border:0;background:none;padding:0;font:inherit;font-weight:600;color:var(--muted);cursor:pointer}
.held{color:var(--muted)} td.held[colspan]{text-align:left;padding-left:24px} .strong{font-weight:600}
.bar{display:inline-block;height:9px;border-radius:2px;background:#9dbfe3;margin-right:8px}
.plain{margin:0;padding-left:20px;display:grid;gap:6px}
footer{color:var(--muted);font-size:13.5px;padding-top:4px;overflow-wrap:anywhere}
@media(max-width:900px){.first{grid-template-columns:minmax(0,1fr)}}
@media(max-width:640px){main{padding:14px 12px 30px;gap:12px}.card{padding:13px 13px}.big{grid-template-columns:minmax(0,1fr);gap:8px}
.number{padding:9px 14px}.number p{margin:0}.number span.before{font-size:21px}.number strong{font-size:32px}.number .arrow{margin:0 6px}
.chart.tall{height:280px}.chart.cloud{height:auto}}
@media print{body{background:#fff}.card,.number{break-inside:avoid}}
"""
_SCRIPT = """
(() => {
  const charts = JSON.parse(document.getElementById('charts').textContent);
  const narrow = matchMedia('(max-width: 640px)').matches;
  const font = {family: 'system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif', size: 13, color: '#1c2530'};
  const axis = {gridcolor: '#e6e9ed', zeroline: false, linecolor: '#c8ced6', ticks: 'outside', tickcolor: '#c8ced6', automargin: true};
  const config = {displaylogo: false, displayModeBar: false};
  const draw = (div, data, layout) => {
    const full = {font, paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', showlegend: false, hovermode: 'closest',
      margin: {l: narrow ? 44 : 56, r: 12, t: layout.title || layout.showlegend ? 34 : 12, b: 44}, dragmode: narrow ? false : 'zoom', ...layout};
    for (const key of ['xaxis', 'yaxis']) if (full[key]) full[key] = {...axis, ...full[key], ...(narrow ? {fixedrange: true} : {})};
    if (full.title) full.title = {...full.title, font: {size: 15}, x: 0.02, xanchor: 'left', y: 0.97, yanchor: 'top'};
    Plotly.newPlot(div, data, full, config);
    if (window.ResizeObserver) new ResizeObserver(() => Plotly.relayout(div, {autosize: true})).observe(div);  // at once; plotly.js itself waits for the window
  };
  const webgl = () => { try { const c = document.createElement('canvas'); return !!(c.getContext('webgl2') || c.getContext('webgl')); } catch { return false; } };
  let cloud = [];  // the plots that before / after switches
  for (const {id, data, layout} of charts) {
    const div = document.getElementById(id);
    if (id !== 'workspace') { draw(div, data, layout); continue; }
    const {fallback, ...rest} = layout;
    if (webgl() && !narrow) {
      draw(div, data, {...rest, margin: {l: 0, r: 0, t: 0, b: 0}, dragmode: 'turntable'});
      cloud = [div];
    } else {  // no WebGL, or a phone, where a 3-D plot would swallow scrolling: two views instead
      div.classList.add('flat'); div.style.height = 'auto';
      for (const [view, second] of [['top', 'y'], ['side', 'z']]) {
        const part = document.createElement('div');
        div.appendChild(part);
        draw(part, fallback[view], {title: {text: view === 'top' ? 'from above' : 'from the side'}, margin: {l: 44, r: 8, t: 34, b: 44},
          xaxis: {title: {text: 'x [m]'}}, yaxis: {title: {text: second + ' [m]'}, scaleanchor: 'x'}});
        cloud.push(part);
      }
    }
  }
  for (const button of document.querySelectorAll('.toggle button')) button.addEventListener('click', () => {
    for (const other of document.querySelectorAll('.toggle button')) other.classList.toggle('on', other === button);
    for (const div of cloud) Plotly.restyle(div, {visible: div.data.map(trace => trace.name === button.dataset.show)});
  });
  for (const table of document.querySelectorAll('table.sortable')) table.querySelectorAll('thead button').forEach((button, column) => {
    let direction = column ? -1 : 1;
    button.addEventListener('click', () => {
      const value = row => { const cell = row.cells[Math.min(column, row.cells.length - 1)]; return column && cell.dataset.v !== undefined ? +cell.dataset.v : cell.textContent; };
      const rows = [...table.tBodies[0].rows].sort((a, b) => { const x = value(a), y = value(b);
        return direction * (typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y), undefined, {numeric: true})); });
      direction = -direction;
      table.tBodies[0].append(...rows);
    });
  });
})();
"""
