// SPDX-License-Identifier: Apache-2.0
// The points that are chosen for trends: at most eight, stored in this browser.
import {emit} from './bus.js';

export const most = 8;
// The path is a part of the key, because a proxy may show several gateways, each below its own path.
const key = `trends ${location.pathname}`;
let names = [];
try {
  names = JSON.parse(localStorage.getItem(key) || '[]').filter((n) => typeof n === 'string').slice(0, most);
} catch {
  names = [];
}

export const list = () => [...names];
export const has = (name) => names.includes(name);

export function set(given) {
  const next = [...new Set(given)].slice(0, most);
  if (next.join() === names.join()) return;
  names = next;
  try {
    localStorage.setItem(key, JSON.stringify(names));
  } catch {
    // Without storage, the browser forgets the choice when the page is closed.
  }
  emit('picked');
}

export function toggle(name) {
  if (has(name)) set(names.filter((n) => n !== name));
  else if (names.length < most) set([...names, name]);
  else emit('notice', `Trends show at most ${most} points: remove a point first.`);
}
