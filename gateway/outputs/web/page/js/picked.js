// SPDX-License-Identifier: Apache-2.0
// The points that are chosen for trends: at most eight, stored in this browser.
import {emit} from './bus.js';
import {recall, remember} from './memory.js';

export const most = 8;
let names = recall('trends', []).filter((n) => typeof n === 'string').slice(0, most);

export const list = () => [...names];
export const has = (name) => names.includes(name);

export function set(given) {
  const next = [...new Set(given)].slice(0, most);
  if (next.join() === names.join()) return;
  names = next;
  remember('trends', names);
  emit('picked');
}

export function toggle(name) {
  if (has(name)) set(names.filter((n) => n !== name));
  else if (names.length < most) set([...names, name]);
  else emit('notice', `Trends show at most ${most} points: remove a point first.`);
}
