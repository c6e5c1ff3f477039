// SPDX-License-Identifier: Apache-2.0
// The gateway's clock as far as the page knows it, and ages that count on by it.
import {ageText} from './format.js';
import {h, setText} from './dom.js';

let ahead = 0;

/** The gateway has just said what time it is (milliseconds since 1970). */
export function heardTime(ms) {
  ahead = ms - Date.now();
}

export const now = () => Date.now() + ahead;

const moments = new WeakMap();

/** An element that shows how long ago something was, and counts on by itself. */
export function age(at = null) {
  const element = h('span', {class: 'age', 'data-age': ''});
  setAge(element, at);
  return element;
}

export function setAge(element, at) {
  moments.set(element, at);
  setText(element, at === null || at === undefined ? 'never' : ageText(now() - at));
}

setInterval(() => {
  if (document.hidden) return;
  for (const element of document.querySelectorAll('[data-age]')) setAge(element, moments.get(element));
}, 500);
