// SPDX-License-Identifier: Apache-2.0
// Finds points by name and adds them to trends.
import {on} from './bus.js';
import {h, setText} from './dom.js';
import * as picked from './picked.js';
import {allPoints, matching} from './store.js';

const most = 8;

export function pointPicker() {
  const found = h('ul', {class: 'found'});
  const state = h('span', {class: 'about', role: 'status'});
  const input = h('input', {type: 'search', id: 'add', placeholder: 'Name of a point', autocomplete: 'off',
    oninput: () => paint()});
  const end = on('picked', () => paint());
  paint();
  async function paint() {
    const text = input.value;
    const all = await allPoints().catch(() => []);
    if (text !== input.value) return;
    const [first] = picked.list();
    const near = (p) => first?.startsWith(`${p.line}.${p.device}.`);
    const list = matching(all, text).filter((p) => !p.type.startsWith('string') && !p.write_only && !picked.has(p.name)
      && (text.trim() || (p.kept && near(p))));
    setText(state, !text.trim() ? (list.length ? 'of the same device:' : '') : list.length ? (list.length > most ? `${list.length} points: type more` : '') : 'No such point.');
    found.replaceChildren(...list.slice(0, most).map((point) => h('li', {}, h('button', {type: 'button', onclick: () => picked.toggle(point.name)}, `+ ${point.name}`), h('span', {class: 'about'}, [point.unit, point.description].filter(Boolean).join(', ')))));
  }
  return {end, element: h('div', {class: 'picker no-print'},
      h('div', {class: 'controls'}, h('label', {for: 'add'}, 'Add a point'), input, state), found)};
}
