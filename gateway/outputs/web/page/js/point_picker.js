// SPDX-License-Identifier: Apache-2.0
// Finds points by name and adds them to trends.
import {h, setText} from './dom.js';
import * as picked from './picked.js';
import {allPoints, matching} from './store.js';

const most = 8;

export function pointPicker() {
  const found = h('ul', {class: 'found'});
  const state = h('span', {class: 'about', role: 'status'});
  const input = h('input', {type: 'search', id: 'add', placeholder: 'Name of a point', autocomplete: 'off',
    oninput: () => paint()});
  async function paint() {
    const text = input.value;
    if (!text.trim()) {
      found.replaceChildren();
      setText(state, '');
      return;
    }
    const all = await allPoints().catch(() => []);
    if (text !== input.value) return;
    const list = matching(all, text).filter((p) => p.type !== 'string' && !picked.has(p.name));
    setText(state, list.length ? (list.length > most ? `${list.length} points: type more` : '') : 'No such point.');
    found.replaceChildren(...list.slice(0, most).map((point) => h('li', {}, h('button', {type: 'button', onclick: () => {
      picked.toggle(point.name);
      paint();
    }}, `+ ${point.name}`), h('span', {class: 'about'}, [point.unit, point.description].filter(Boolean).join(', ')))));
  }
  return h('div', {class: 'picker no-print'}, h('div', {class: 'controls'}, h('label', {for: 'add'}, 'Add a point'), input, state), found);
}
