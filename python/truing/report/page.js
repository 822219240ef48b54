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
