// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Tables that are sorted by a click on a heading.

function valueOf(row, column) {
  const cell = row.cells[Math.min(column, row.cells.length - 1)];
  return column && cell.dataset.v !== undefined ? +cell.dataset.v : cell.textContent;
}

function compare(x, y) {
  if (typeof x === 'number' && typeof y === 'number') return x - y;
  return String(x).localeCompare(String(y), undefined, {numeric: true});
}

export function makeTablesSortable() {
  for (const table of document.querySelectorAll('table.sortable')) {
    table.querySelectorAll('thead button').forEach((button, column) => {
      let direction = column ? -1 : 1;
      button.addEventListener('click', () => {
        const rows = [...table.tBodies[0].rows].sort((a, b) => direction * compare(valueOf(a, column), valueOf(b, column)));
        direction = -direction;
        table.tBodies[0].append(...rows);
      });
    });
  }
}
