// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Makes the script of the reports: one file, with the licences of all that is in it at its end.

import {readFileSync, readdirSync, writeFileSync} from 'node:fs';
import path from 'node:path';

import {build} from 'esbuild';

const out = process.argv[2];

// plotly.js imports the style of its maps, which no page has.
const noStyle = {name: 'no-style', setup: b => b.onLoad({filter: /\.css$/}, () => ({contents: '', loader: 'js'}))};

const made = await build({
  entryPoints: ['src/main.js'],
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2020',
  charset: 'ascii',
  legalComments: 'none',
  define: {global: 'window'},
  plugins: [noStyle],
  metafile: true,
  write: false,
});

function packages(metafile) {
  const [output] = Object.values(metafile.outputs), found = new Map();
  for (const [file, {bytesInOutput}] of Object.entries(output.inputs)) {
    const parts = /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(file);
    if (parts && bytesInOutput) found.set(parts[1], JSON.parse(readFileSync(`${parts[1]}/package.json`)));
  }
  return [...found].sort(([a], [b]) => (a < b ? -1 : 1));
}

// Packages whose archive has no licence file: the text that their package.json names, with their authors.
const TEXTS = {MIT: './licences/MIT.txt'};
const authorOf = ({author}) => (typeof author === 'string' ? author : author?.name ?? '').replace(/ *[<(].*/, '');

function licenceOf(folder, about) {
  const file = readdirSync(folder).find(name => /^(licen[sc]e|copying)/i.test(name));
  if (file) return readFileSync(path.join(folder, file), 'utf8');
  const text = TEXTS[about.license];
  if (!text) throw new Error(`${about.name}: no licence file, and "${about.license}" is not known`);
  return `Copyright (c) ${authorOf(about) || `the authors of ${about.name}`}\n\n${readFileSync(text, 'utf8')}`;
}

const tidy = text => text.replace(/\r/g, '').split('\n').map(line => line.trimEnd()).join('\n').replace(/\n{3,}/g, '\n\n').trim();

const ALLOWED = new Set(['MIT', 'ISC', 'BSD-3-Clause', 'BSD-2-Clause', 'Zlib', '0BSD', 'Unlicense', 'Apache-2.0']);
const byText = new Map();
for (const [folder, about] of packages(made.metafile)) {
  if (!ALLOWED.has(about.license)) throw new Error(`${about.name}: licence "${about.license}" is not one that reports may carry`);
  const text = tidy(licenceOf(folder, about));
  byText.set(text, [...(byText.get(text) ?? []), `${about.name} ${about.version} (${about.license})`]);
}
const licences = [...byText].map(([text, names]) => `${names.join('\n')}\n\n${text}`).join(`\n\n${'-'.repeat(78)}\n\n`);
const heading = 'This script contains parts of the packages named below, under their licences.';

const script = made.outputFiles[0].text.trimEnd();
const all = `${script}\n/*\n${heading}\n\n${licences.replaceAll('*/', '* /')}\n*/\n`;
writeFileSync(out, all);
writeFileSync(path.join(path.dirname(out), 'licences.txt'), `${heading.replace('This script', 'report.js')}\n\n${licences}\n`);
console.log(`${out}: ${(all.length / 1e6).toFixed(2)} MB, ${byText.size} licence texts`);
