// SPDX-License-Identifier: Apache-2.0
// A table of points with live values. A short table contains all its rows; a long table only the rows that are visible.
import {on} from './bus.js';
import {age, setAge} from './clock.js';
import {h, mark, setClass, setMark, setText} from './dom.js';
import {qualityKind, qualityMark, valueText} from './format.js';
import {deviceLink} from './links.js';
import * as picked from './picked.js';
import {valueOf} from './store.js';

/**
 * Up to this number of points all rows exist, so that the points of a device can be printed. The limit for all points is
 * smaller, because search results change with every letter.
 */
const plainLimit = {device: 400, all: 40};

class Row {
  constructor() {
    this.name = h('a', {class: 'point-name'});
    this.description = h('span', {class: 'point-text'});
    this.value = document.createTextNode('');
    this.unit = document.createTextNode('');
    this.shape = mark('fine');
    this.quality = document.createTextNode('');
    this.age = age();
    this.plus = h('button', {type: 'button', class: 'small', onclick: () => this.pick()});
    const cell = (name, ...content) => h('div', {role: 'cell', class: name}, content);
    this.element = h('div', {role: 'row', class: 'point-row'},
        cell('p-name', this.name), cell('p-text', this.description), cell('p-value', this.value),
        cell('p-unit', this.unit), cell('p-quality', this.shape, h('span', {}, this.quality)),
        cell('p-age', this.age), cell('p-plus', this.plus));
    this.point = null;
    this.index = -1;
  }

  pick() {
    picked.toggle(this.point.name);
    this.paintPick();
  }

  paintPick() {
    const is = picked.has(this.point.name);
    const text = is ? '− Trend' : '+ Trend';
    setText(this.plus, text);
    setClass(this.plus, is ? 'small on' : 'small');
    this.plus.setAttribute('aria-label', `${text}: ${this.point.name}`);
  }

  show(point, index, full) {
    if (this.point !== point) {
      this.point = point;
      this.element.removeAttribute('aria-current');
      setText(this.name, full ? point.name : point.point);
      if (full) this.name.href = deviceLink(point, point.point);
      setText(this.description, point.description || '');
      this.unit.data = point.unit || '';
      this.paintPick();
    }
    if (this.index !== index) {
      this.index = index;
      this.element.setAttribute('aria-rowindex', index + 2);
    }
    this.paint();
  }

  paint() {
    const live = valueOf(this.point.id);
    if (!live) return;
    const kind = qualityKind(live.quality);
    const value = valueText(live.value);
    if (this.value.data !== value) this.value.data = value;
    if (this.quality.data !== live.text) this.quality.data = live.text;
    setMark(this.shape, qualityMark[kind]);
    setClass(this.element, `point-row ${kind}`);
    setAge(this.age, live.at);
  }
}

export class PointTable {
  /** If `full` is true, rows show LINE.DEVICE.POINT, else POINT. */
  constructor({full, label}) {
    this.full = full;
    this.points = [];
    this.rows = [];
    this.places = new Map();
    this.spacer = h('div', {role: 'rowgroup', class: 'point-rows'});
    const head = ['Point', 'Description', 'Value', 'Unit', 'Quality', 'Age', 'Trend'];
    const names = ['name', 'text', 'value', 'unit', 'quality', 'age', 'plus'];
    this.table = h('div', {role: 'table', 'aria-label': label, class: `points${full ? ' full' : ''}`},
        h('div', {role: 'rowgroup', class: 'point-head'}, h('div', {role: 'row', class: 'point-row', 'aria-rowindex': 1},
            head.map((title, i) => h('div', {role: 'columnheader', class: `p-${names[i]}`}, title)))),
        this.spacer);
    this.element = h('div', {class: 'point-box', onscroll: () => this.soon()}, this.table);
    this.resized = new ResizeObserver(() => this.layout());
    this.resized.observe(this.element);
    this.ends = [on('values', (ids) => this.changed(ids)), () => this.resized.disconnect()];
  }

  end() {
    for (const end of this.ends) end();
  }

  paint(points) {
    this.points = points;
    this.table.setAttribute('aria-rowcount', points.length + 1);
    this.element.scrollTop = 0;
    this.layout();
  }

  many() {
    return this.points.length > (this.full ? plainLimit.all : plainLimit.device);
  }

  layout() {
    const many = this.many();
    this.height = parseFloat(getComputedStyle(this.table).getPropertyValue('--row')) || 28;
    this.element.classList.toggle('virtual', many);
    if (many) this.element.setAttribute('tabindex', '0');
    else this.element.removeAttribute('tabindex');
    this.spacer.style.height = many ? `${this.points.length * this.height}px` : '';
    const seen = Math.ceil((this.element.clientHeight || innerHeight) / this.height) + 4;
    const size = many ? Math.min(seen, this.points.length) : this.points.length;
    while (this.rows.length < size) {
      const row = new Row();
      this.rows.push(row);
      this.spacer.append(row.element);
    }
    while (this.rows.length > size) this.rows.pop().element.remove();
    this.place();
  }

  soon() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.place();
    });
  }

  /** Assigns points to the few rows that exist: of n rows, row i shows the visible point whose index modulo n is i. */
  place() {
    const size = this.rows.length;
    if (!size) return;
    const many = this.many();
    const top = many ? Math.floor(this.element.scrollTop / this.height) - 1 : 0;
    const first = Math.max(0, Math.min(top, this.points.length - size));
    this.places.clear();
    for (let index = first; index < first + size; ++index) {
      const row = this.rows[index % size];
      const moved = row.index !== index || !many;
      row.show(this.points[index], index, this.full);
      if (moved) row.element.style.transform = many ? `translateY(${index * this.height}px)` : '';
      this.places.set(this.points[index].id, row);
    }
  }

  /** Scrolls to the row of a point and marks it. */
  reveal(name) {
    const index = this.points.findIndex((p) => p.point === name);
    if (index < 0) return;
    if (this.many()) {
      this.element.scrollTop = Math.max(0, (index - 3) * this.height);
      this.place();
    }
    const row = this.places.get(this.points[index].id);
    row.element.setAttribute('aria-current', 'true');
    row.element.scrollIntoView({block: 'center'});
  }

  changed(ids) {
    if (ids.size < this.places.size) {
      for (const id of ids) this.places.get(id)?.paint();
    } else {
      for (const [id, row] of this.places) if (ids.has(id)) row.paint();
    }
  }
}
