// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What a reader moves: sliders, choices, buttons. Every text is set as text, never as markup.

export function element(kind, className = '', text = '') {
  const out = document.createElement(kind);
  if (className) out.className = className;
  if (text) out.textContent = text;
  return out;
}

// A slider with its name and value. Returns the element, and a function that sets it.
export function slider(parent, {name, low, high, value, step, text}, changed) {
  const label = element('label', 'slider'), shown = element('output'), input = element('input');
  Object.assign(input, {type: 'range', min: low, max: high, step: step ?? (high - low) / 500});
  label.append(element('span', '', name), input, shown);
  parent.append(label);
  const set = now => { input.value = now; shown.textContent = text(+now); };
  set(value);
  input.addEventListener('input', () => { shown.textContent = text(+input.value); changed(+input.value); });
  return {label, set};
}

export function choice(parent, name, texts, changed) {
  const label = element('label', 'slider'), select = element('select');
  texts.forEach((text, k) => {
    const option = element('option', '', text);
    option.value = k;
    select.append(option);
  });
  select.addEventListener('change', () => changed(+select.value));
  label.append(element('span', '', name), select);
  parent.append(label);
}

// Buttons of which one is on.
export function toggle(parent, names, changed) {
  const group = element('div', 'toggle');
  group.setAttribute('role', 'group');
  names.forEach((name, k) => {
    const button = element('button', k ? '' : 'on', name);
    button.type = 'button';
    button.addEventListener('click', () => {
      for (const other of group.children) other.classList.toggle('on', other === button);
      changed(name);
    });
    group.append(button);
  });
  parent.append(group);
}

export function button(parent, text, clicked) {
  const out = element('button', 'play', text);
  out.type = 'button';
  out.addEventListener('click', () => clicked(out));
  parent.append(out);
  return out;
}
