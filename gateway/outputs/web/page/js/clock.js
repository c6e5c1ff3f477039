// SPDX-License-Identifier: Apache-2.0
// An estimate of the gateway's clock, from the times that the gateway sends, and ages that advance with this clock.
import {ageText} from './format.js';
import {h, setText} from './dom.js';

let ahead = 0;

/** Must be called when a time of the gateway's clock arrives (milliseconds since 1970). */
export function heardTime(ms) {
  ahead = ms - Date.now();
}

export const now = () => Date.now() + ahead;

const moments = new WeakMap();

/** Returns an element that shows the age of a time, and advances by itself. */
export function age(at = null) {
  const element = h('span', {class: 'age', 'data-age': 'never'});
  setAge(element, at);
  return element;
}

/** `never` is shown if there is no time. */
export function setAge(element, at, never = element.dataset.age) {
  moments.set(element, at);
  element.dataset.age = never;
  setText(element, at === null || at === undefined ? never : ageText(now() - at));
}

setInterval(() => {
  if (document.hidden) return;
  for (const element of document.querySelectorAll('[data-age]')) setAge(element, moments.get(element));
}, 500);
