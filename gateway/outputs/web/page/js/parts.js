// SPDX-License-Identifier: Apache-2.0
import {h, mark, setMark, setText, svg} from './dom.js';
import {hourShare, inWords} from './format.js';
import {recall, remember} from './memory.js';

/** A list of named figures; paint([[title, text], …]) updates it. */
export class Facts {
  constructor() {
    this.element = h('dl', {class: 'facts'});
    this.texts = new Map();
  }

  paint(facts) {
    for (const [title, text] of facts) {
      if (!this.texts.has(title)) {
        const value = h('dd');
        this.texts.set(title, value);
        this.element.append(h('div', {}, h('dt', {}, title), value));
      }
      const value = this.texts.get(title);
      if (text instanceof Node) {
        if (value.firstChild !== text) value.replaceChildren(text);
      } else {
        setText(value, String(text));
      }
    }
  }
}

/** The gateway's sentences about something; hidden while there are none. */
export class Sentences {
  constructor() {
    this.element = h('ul', {class: 'sentences', hidden: true});
  }

  /** list: [{kind, text, href?, from?}, …] or texts. */
  paint(list) {
    const items = list.map((one) => (typeof one === 'string' ? {kind: 'warn', text: one} : one));
    const signature = JSON.stringify(items.map(({kind, from}) => [kind, from]));
    if (signature !== this.signature) {
      this.signature = signature;
      this.texts = items.map(() => h('span'));
      this.element.replaceChildren(...items.map(({kind, from, href}, i) => h('li', {}, mark(kind),
          h('span', {}, from ? h(href ? 'a' : 'strong', {href}, from) : null, from ? ': ' : null, this.texts[i]))));
    }
    for (const [i, item] of items.entries()) setText(this.texts[i], inWords(item.text));
    this.element.hidden = !items.length;
  }
}

/** The reasons why a view cannot show its data: the gateway's sentences, each once. */
export class Problem {
  constructor() {
    this.element = h('p', {class: 'problem', role: 'alert', hidden: true});
    this.texts = new Map();
  }

  /** `from` names the request that failed, or works again. */
  paint(error, from = '') {
    // If the gateway cannot be reached, the banner on top reports that.
    this.texts.set(from, error && error.status !== 0 && error.status !== 401 ? error.message : '');
    const text = [...new Set(this.texts.values())].filter(Boolean).join('\n');
    setText(this.element, text);
    this.element.hidden = !text;
  }
}

/** A headline. paint(kind, text) adds a shape that shows the state of the headline's subject. */
export class Headline {
  constructor(text) {
    this.shape = mark('fine');
    this.shape.style.display = 'none';
    this.text = h('span', {}, text);
    this.element = h('h1', {tabindex: '-1'}, this.shape, this.text);
  }

  name(text) {
    setText(this.text, text);
  }

  paint(kind, text) {
    this.shape.style.display = '';
    setMark(this.shape, kind);
    setText(this.text, text);
  }
}

export const crumbs = (...links) => h('nav', {class: 'crumbs', 'aria-label': 'You are here'},
    links.map(([text, href], i) => [i ? ' › ' : '', h('a', {href}, text)]));

export const section = (title, ...content) => h('section', {'aria-label': title}, h('h2', {}, title), content);

/** A part that is folded until the user opens it; the browser remembers that. */
export function folded(title, ...content) {
  const element = h('details', {class: 'folded', open: recall(`open ${title}`, false), ontoggle: () => remember(`open ${title}`, element.open)},
      h('summary', {}, h('h2', {}, title)), content);
  return element;
}

export function select(label, options, value, change) {
  const element = h('select', {onchange: () => change(element.value)},
      options.map(([key, text]) => h('option', {value: key, selected: key === value}, text)));
  return h('label', {class: 'field'}, h('span', {}, label), element);
}

/**
 * The last hour of a device, one column per minute: the part of the polls that was answered is drawn below, the rest above.
 * Minutes without a poll are empty. A text beside the strip shows the share of answered polls in the hour.
 */
export class HourStrip {
  constructor() {
    this.up = svg('path', {class: 'up'});
    this.down = svg('path', {class: 'down'});
    this.text = h('span', {class: 'bar-text'});
    this.element = h('span', {class: 'hour'}, svg('svg', {'viewBox': '0 0 60 10', 'preserveAspectRatio': 'none',
      'aria-hidden': 'true'}, this.up, this.down), this.text);
  }

  paint(hour) {
    setText(this.text, hourShare(hour));
    const minutes = hour.minutes.join();
    if (minutes === this.minutes) return;
    this.minutes = minutes;
    const columns = hour.minutes.map((share, i) => [i, share * 10, share === null]).filter(([, , empty]) => !empty);
    this.up.setAttribute('d', columns.map(([i, high]) => `M${i} 10h1v${-high}h-1z`).join(''));
    this.down.setAttribute('d', columns.filter(([, high]) => high < 10).map(([i, high]) =>
      `M${i} 0h1v${10 - high}h-1z`).join(''));
  }
}

/** A share as a bar; a text beside it shows the number. */
export class Bar {
  constructor() {
    this.fill = h('span', {class: 'bar-fill'});
    this.text = h('span', {class: 'bar-text'});
    this.element = h('span', {class: 'share'}, h('span', {class: 'bar-box', 'aria-hidden': 'true'}, this.fill), this.text);
  }

  paint(share, text) {
    const width = `${Math.min(100, Math.max(0, share * 100)).toFixed(1)}%`;
    if (this.fill.style.width !== width) this.fill.style.width = width;
    setText(this.text, text);
  }
}
