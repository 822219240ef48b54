// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Numbers as the page holds them, and as its reader wants them.

// plotly.js's form of a typed array: little-endian floats in base64.
export function unpacked({bdata}) {
  const bytes = Uint8Array.from(atob(bdata), c => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

export const rowsOf = (values, width) =>
  Array.from({length: values.length / width}, (_, k) => Array.from(values.subarray(k * width, (k + 1) * width)));

export function lengthText(metres) {
  const size = Math.abs(metres);
  const [unit, scale] = size >= 1 ? ['m', 1] : size >= 1e-6 || size === 0 ? ['mm', 1e3] : ['µm', 1e6];
  return `${Number((metres * scale).toPrecision(3))} ${unit}`;
}

// To 1, 2 or 5 times a power of ten.
export function roundedDown(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Math.max(...[1, 2, 5].filter(f => f * power <= value * (1 + 1e-9))) * power;
}
