// SPDX-License-Identifier: Apache-2.0
// A table of points with live values. A short table contains all its rows; a long table only the rows that are visible.
import {on} from './bus.js';
import {age, setAge} from './clock.js';
import {h, mark, setClass, setMark, setText} from './dom.js';
import {star} from './favourites.js';
import {qualityMark} from './format.js';
import {deviceLink, trendsLink} from './links.js';
import {may, write} from './operate.js';
import {session} from './session.js';
import {Spark, lastHour} from './spark.js';
import {beyond, beyondText, kindOf, limitsOf, resting, shownOf, valueOf, writable} from './store.js';

/**
 * Up to this number of points all rows exist, so that the points of a device can be printed. The limit for all points is
 * smaller, because search results change with every letter.
 */
const plainLimit = {device: 400, all: 40};

/** True if trends can show the point: the gateway keeps it; or no history is kept, and the browser records it. */
const hasTrend = (point) => point.kept || (!session.history && !point.write_only && !point.type.startsWith('string'));

class Row {
  constructor(watch) {
    this.star = star();
    this.name = h('a', {class: 'point-name'});
    this.description = h('span');
    this.whole = document.createTextNode('');
    this.part = h('span', {class: 'fraction'});
    this.limit = h('span', {class: 'beyond'});
    this.unit = document.createTextNode('');
    this.spark = new Spark();
    this.trend = h('a', {class: 'trend'}, this.spark.element);
    this.shape = mark('fine');
    this.quality = document.createTextNode('');
    this.age = age();
    this.act = h('button', {type: 'button', class: 'small', onclick: () => write(this.point)}, 'Write');
    this.cell = (name, ...content) => h('div', {role: 'cell', class: name}, content);
    this.value = this.cell('p-value', this.whole, this.part);
    this.cells = [this.cell('p-star', this.star.element), this.cell('p-name', this.name), this.cell('p-text', this.description), this.value,
      this.cell('p-unit', this.unit), this.cell('p-spark', this.trend), this.cell('p-quality', this.shape, h('span', {}, this.quality, this.limit)),
      this.cell('p-age', this.age), this.cell('p-act', this.act)];
    this.element = h('div', {role: 'row', class: 'point-row'}, this.cells);
    this.point = null;
    this.index = -1;
    this.visible = false;
    watch.observe(this.element);
  }

  show(point, index, full) {
    if (this.point !== point) this.take(point, full);
    if (this.index !== index) {
      this.index = index;
      this.element.setAttribute('aria-rowindex', index + 2);
    }
    this.paint();
  }

  take(point, full) {
    this.point = point;
    this.element.removeAttribute('aria-current');
    if (point.heading) {
      setText(this.name, point.heading);
      this.name.removeAttribute('href');
      setClass(this.element, 'point-row heading');
      this.element.replaceChildren(this.cells[1]);
      return;
    }
    if (this.element.children.length === 1) this.element.replaceChildren(...this.cells);
    this.star.paint(point.name);
    setText(this.name, full ? point.name : point.point);
    this.name.href = full ? deviceLink(point, point.point) : trendsLink({points: point.name, range: '1h'});
    if (!full && !hasTrend(point)) this.name.removeAttribute('href');
    setText(this.description, point.description || '');
    this.description.title = point.description || '';
    this.unit.data = point.unit || '';
    this.limits = limitsOf(point);
    this.trend.hidden = !point.kept;
    this.trend.href = trendsLink({points: point.name, range: '1h'});
    this.trend.title = ['Last hour', ...this.limits.map((limit) => limit.text)].join('\n');
    this.trend.setAttribute('aria-label', `Trend of ${point.name}`);
    this.act.setAttribute('aria-label', `Write ${point.name}`);
    this.spark.clear();
    this.look();
  }

  /** Requests the small curve while the row is visible. */
  look() {
    const {point} = this;
    if (!this.visible || !point?.kept || !session.history) return;
    lastHour(point.name, (hour) => this.point === point && this.spark.paint(hour, this.limits), () => this.visible && this.point === point);
  }

  paint() {
    const live = !this.point.heading && valueOf(this.point.id);
    if (!live) return;
    const kind = kindOf(this.point, live);
    const text = shownOf(live) || '–';
    const dot = typeof live.value === 'number' ? text.indexOf('.') : -1;
    const whole = dot < 0 ? text : text.slice(0, dot);
    const part = dot < 0 ? '' : text.slice(dot);
    if (this.whole.data !== whole) this.whole.data = whole;
    setText(this.part, part);
    setClass(this.value, `p-value${typeof live.value === 'number' && text !== '–' && !this.point.states ? '' : ' word'}`);
    const raw = live.value === null ? '' : `raw value ${live.value}`;
    if (this.value.title !== raw) this.value.title = raw;
    const passed = beyond(this.point, live);
    setText(this.limit, beyondText(passed));
    this.limit.title = passed?.text || '';
    if (this.quality.data !== live.text) this.quality.data = live.text;
    this.act.hidden = !writable(this.point) || !may('write') || resting(live);
    setMark(this.shape, passed ? 'warn' : resting(live) ? 'off' : qualityMark[kind]);
    setClass(this.element, `point-row ${kind}${resting(live) ? ' resting' : ''}`);
    setAge(this.age, live.at, this.point.write_only ? '–' : 'never');
  }
}

/** The number of characters from the decimal point on, of the longest value. */
function longestFraction(points) {
  return Math.max(3, ...points.map((point) => {
    const live = !point.heading && valueOf(point.id);
    const text = live && typeof live.value === 'number' && !point.states ? shownOf(live) : '';
    return text.includes('.') ? text.length - text.indexOf('.') : 0;
  }));
}

/** Columns of the table: [title, class, key of the order]. */
const columns = [['', 'star'], ['Point', 'name', 'name'], ['Description', 'text'], ['Value', 'value', 'value'], ['Unit', 'unit'],
  ['Last hour', 'spark'], ['Quality', 'quality', 'quality'], ['Age', 'age', 'age'], ['', 'act']];

export class PointTable {
  /** If `full` is true, rows show LINE.DEVICE.POINT, else POINT. sorted(key) is called when the user presses a header. */
  constructor({full, label, sorted = null}) {
    this.full = full;
    this.points = [];
    this.rows = [];
    this.places = new Map();
    this.heads = new Map();
    this.watch = new IntersectionObserver((entries) => {
      for (const {target, isIntersecting} of entries) {
        const row = this.rows.find((one) => one.element === target);
        if (!row) continue;
        row.visible = isIntersecting;
        row.look();
      }
    });
    this.spacer = h('div', {role: 'rowgroup', class: 'point-rows'});
    const head = ([title, name, key]) => {
      const content = sorted && key
        ? [h('button', {type: 'button', class: 'sort', onclick: () => sorted(key)}, title), h('span', {class: 'small-only'}, title)]
        : title || h('span', {class: 'hidden'}, name === 'star' ? 'Favourite' : 'Write');
      const cell = h('div', {role: 'columnheader', class: `p-${name}`}, content);
      if (key) this.heads.set(key, cell);
      return cell;
    };
    this.table = h('div', {role: 'table', 'aria-label': label, class: `points${full ? ' full' : ''}`},
        h('div', {role: 'rowgroup', class: 'point-head'}, h('div', {role: 'row', class: 'point-row', 'aria-rowindex': 1}, columns.map(head))),
        this.spacer);
    this.element = h('div', {class: 'point-box', onscroll: () => this.soon()}, this.table);
    this.resized = new ResizeObserver(() => this.layout());
    this.resized.observe(this.element);
    const timer = setInterval(() => document.hidden || this.rows.forEach((row) => row.look()), 60e3);
    this.ends = [on('values', (ids) => this.changed(ids)), () => this.resized.disconnect(), () => this.watch.disconnect(),
      () => clearInterval(timer)];
  }

  end() {
    for (const end of this.ends) end();
  }

  /** Marks the column by which the points are sorted. */
  order(by, down) {
    for (const [key, cell] of this.heads) {
      if (key === by) cell.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      else cell.removeAttribute('aria-sort');
    }
  }

  /** points may contain headings, {heading: text}. */
  paint(points) {
    this.points = points;
    this.table.setAttribute('aria-rowcount', points.length + 1);
    this.table.classList.toggle('acts', may('write') && points.some(writable));
    this.element.scrollTop = 0;
    if (points.length <= plainLimit.device) this.table.style.setProperty('--fraction', longestFraction(points));
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
      const row = new Row(this.watch);
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
      row.show(this.points[index], index, this.full);
      const shift = many ? `translateY(${index * this.height}px)` : '';  // the height changes with the width of the window
      if (row.shift !== shift) row.element.style.transform = row.shift = shift;
      if (!this.points[index].heading) this.places.set(this.points[index].id, row);
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
