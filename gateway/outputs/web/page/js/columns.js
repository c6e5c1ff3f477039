// SPDX-License-Identifier: Apache-2.0
// Table columns that several views use.
import {age, setAge} from './clock.js';
import {h, markedText, setText} from './dom.js';
import {count, inWords} from './format.js';
import {Bar, HourStrip} from './parts.js';

/** A column with a shape and a word: of(item) returns [shape, word]. */
export const marked = (title, of) => ({
  title,
  class: 'state',
  make: (cell) => {
    const made = markedText();
    cell.append(made.element);
    return made;
  },
  paint: (made, item) => made.paint(...of(item)),
});

/** A column with a link to a view: of(item) returns [text, address]. */
export const linked = (title, of, name = 'name') => ({
  title,
  class: name,
  make: (cell) => cell.appendChild(h('a')),
  paint: (a, item) => {
    const [text, href] = of(item);
    setText(a, text);
    if (a.getAttribute('href') !== href) a.href = href;
  },
});

/** A column with an age that advances: of(item) returns the gateway's time in milliseconds, or null. */
export const aged = (title, of, name = 'num') => ({
  title,
  class: name,
  make: (cell) => cell.appendChild(age()),
  paint: (element, item) => setAge(element, of(item)),
});

/** A column with a share as a bar: of(item) returns [share, text]. */
export const barred = (title, of) => ({
  title,
  class: 'bar-cell',
  make: (cell) => {
    const bar = new Bar();
    cell.append(bar.element);
    return bar;
  },
  paint: (bar, item) => bar.paint(...of(item)),
});

/** A column with the last hour of a device, minute by minute. */
export const lastHour = (title) => ({
  title,
  class: 'hour-cell',
  make: (cell) => {
    const strip = new HourStrip();
    cell.append(strip.element);
    return strip;
  },
  paint: (strip, device) => strip.paint(device.hour),
});

/** A column with a button that calls press(value): of(item) returns {value, label, hidden?}. */
export const pressed = (title, text, press, of) => ({
  title,
  class: 'action no-print',
  make: (cell) => {
    const button = h('button', {type: 'button', class: 'small', onclick: () => press(button.value)}, text);
    cell.append(button);
    return button;
  },
  paint: (button, item) => {
    const {value, label, hidden = false} = of(item);
    button.value = value;
    button.hidden = hidden;
    button.setAttribute('aria-label', label);
  },
});

export const counted = (title, of, name = 'num') => ({title, class: name, text: (item) => count(of(item))});

/** A column with the gateway's sentences about the item, one per line. */
export const said = (title = 'Problem') =>
  ({title, class: 'said', text: (thing) => [...(thing.trouble ? [thing.trouble] : []), ...thing.advice].map(inWords).join('\n')});

/** Converts age_ms to a time of the gateway's clock; null: never. `heard`: the time when the status arrived. */
export const heardAgo = (one) => (one.age_ms === null ? null : one.heard - one.age_ms);
