// SPDX-License-Identifier: Apache-2.0
// Builds elements. Texts become text nodes and are never parsed as HTML.

/** Example: h('td', {class: 'num', onclick: f}, 'text', node). False, null and undefined children are left out. */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat(Infinity).filter((c) => c !== null && c !== undefined && c !== false));
  return element;
}

/** Writes a text only if it differs, so that no layout and no screen reader runs needlessly. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export function setClass(element, name) {
  if (element.className !== name) element.className = name;
}

/** Makes an SVG element, as h makes an HTML element. */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

const shapes = {
  fine: 'M6 2.5a3.5 3.5 0 1 0 .01 0z',
  info: 'M6 1.5a4.5 4.5 0 1 0 .01 0zM6 5v4M6 3v1',
  warn: 'M6 1 11.5 11H.5z',
  bad: 'M1 1h10v10H1z',
  off: 'M1.5 6h9',
  new: 'M6 1 11 6 6 11 1 6z',
};

/** Makes a small shape beside a word, so that states differ in shape as well as in colour. */
export function mark(kind) {
  const shape = svg('svg', {'viewBox': '0 0 12 12', 'aria-hidden': 'true'}, svg('path'));
  setMark(shape, kind);
  return shape;
}

export function setMark(shape, kind) {
  if (shape.dataset.kind === kind) return;
  shape.dataset.kind = kind;
  shape.setAttribute('class', `mark ${kind}`);
  shape.firstChild.setAttribute('d', shapes[kind]);
}

/** Returns a shape with a word; paint(kind, text) sets them. */
export function markedText() {
  const shape = mark('fine');
  const word = h('span');
  const element = h('span', {class: 'marked'}, shape, word);
  return {
    element,
    paint(kind, text) {
      setMark(shape, kind);
      setText(word, text);
    },
  };
}
