// SPDX-License-Identifier: Apache-2.0
// One chart of some curves over time on a canvas: means as lines, minima to maxima as bands, limits as dashed lines, and
// below the axis a strip for each curve with the times in which not every value was good.
import {h, setText} from './dom.js';
import {civil} from './format.js';
import {doubtful, rowAt, spread} from './series.js';
import {calendar, offset, shownTime} from './zone.js';

export const dashes = [[], [8, 3], [2, 2], [9, 3, 2, 3], [14, 4], [4, 4], [2, 5], [12, 3, 2, 3, 2, 3]];

const axisHeight = 20;
const stripHeight = 5;
const top = 14;
const right = 14;
const shortestDrag = 6;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const second = 1e3;
const minute = 60e3;
const hour = 3600e3;
const day = 24 * hour;
const steps = [second, 2 * second, 5 * second, 10 * second, 15 * second, 30 * second, minute, 2 * minute, 5 * minute,
  10 * minute, 15 * minute, 30 * minute, hour, 2 * hour, 3 * hour, 6 * hour, 12 * hour];
const days = [1, 2, 7, 14];
const months = [1, 2, 3, 6, 12];
const names = ['Jan', 'Feb', 'Mar', 'Apr', 'May', 'Jun', 'Jul', 'Aug', 'Sep', 'Oct', 'Nov', 'Dec'];

const dayText = (ms) => {
  const text = shownTime(ms);
  return `${Number(text.slice(8, 10))} ${names[Number(text.slice(5, 7)) - 1]}`;
};

/** The marks of the time axis, [[ms, text], …], at least `gap` milliseconds apart. */
function timeMarks(from, until, gap) {
  const step = steps.find((one) => one >= gap);
  const marks = [];
  if (step) {
    for (let t = Math.ceil((from + offset(from)) / step) * step - offset(from); t <= until; t += step) {
      const clock = shownTime(t).slice(11, step < minute ? 19 : 16);
      marks.push([t, step >= minute && clock === '00:00' ? dayText(t) : clock]);
    }
    return marks;
  }
  const some = days.find((n) => n * day >= gap);
  if (some) {
    for (let t = calendar(from, {days: 1}); t <= until; t = calendar(t, {days: some})) marks.push([t, dayText(t)]);
    return marks;
  }
  const many = months.find((n) => n * 30 * day >= gap) || 12;
  for (let t = calendar(from, {months: 1, month: true}); t <= until; t = calendar(t, {months: many, month: true})) {
    const text = shownTime(t);
    marks.push([t, `${names[Number(text.slice(5, 7)) - 1]} ${text.slice(0, 4)}`]);
  }
  return marks;
}

/** The marks of the value axis: numbers 1, 2 or 5 times a power of ten apart. */
function valueMarks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((n) => n * power >= rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const marks = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + step * 1e-9; ++n) marks.push([n * step, (n * step).toFixed(digits)]);
  return marks;
}

/** The marks of a value axis whose values have texts: [[value, text], …]. */
const stateMarks = (states, low, high) => Object.entries(states).map(([value, text]) => [Number(value), text])
    .filter(([value]) => value >= low && value <= high);

/** The lowest and highest value that the axis shows. Limits count while they are near the values. */
function extent(curves, limits) {
  let low = Infinity;
  let high = -Infinity;
  for (const {series} of curves) {
    for (const [, min, mean, max] of series.rows) {
      if (mean === null) continue;
      low = Math.min(low, min);
      high = Math.max(high, max);
    }
  }
  if (low > high) return null;
  const span = high - low || Math.abs(high) * 0.1 || 1;
  for (const {value} of limits) {
    if (value < low && low - value < span) low = value;
    if (value > high && value - high < span) high = value;
  }
  const room = (high - low || span) * 0.06;
  return [low - room, high + room];
}

export class Plot {
  /**
   * zoomed(from, until) is called after a drag, with null for the whole span; pointed(time or null) when the pointer moves,
   * so that all charts show the same time.
   */
  constructor({zoomed, pointed}) {
    this.zoomed = zoomed;
    this.pointed = pointed;
    this.canvas = h('canvas', {role: 'img'});
    this.over = h('canvas', {class: 'over', 'aria-hidden': 'true'});
    this.tip = h('div', {class: 'tip', hidden: true, 'aria-hidden': 'true'});
    this.none = h('p', {class: 'none', hidden: true});
    this.title = h('h2');
    this.box = h('div', {class: 'plot', tabindex: '0', role: 'group', 'aria-label': 'Chart: the arrow keys move the cursor',
      onkeydown: (event) => this.key(event), onblur: () => this.leave()}, this.canvas, this.over, this.tip, this.none);
    this.element = h('figure', {class: 'plot-figure'}, this.title, this.box);
    this.cursor = null;
    this.drag = null;
    this.repaint = () => this.curves && this.paint();
    addEventListener('theme', this.repaint);
    this.resized = new ResizeObserver(this.repaint);
    this.resized.observe(this.box);
    this.over.addEventListener('pointerdown', (event) => this.begin(event));
    this.over.addEventListener('pointermove', (event) => this.move(event));
    this.over.addEventListener('pointerup', (event) => this.release(event));
    this.over.addEventListener('pointercancel', () => this.leave());
    this.over.addEventListener('pointerleave', () => this.drag || this.leave());
    this.over.addEventListener('dblclick', () => this.zoomed(null, null));
  }

  /**
   * curves: [{number, name, series}], number selects colour and dash; limits: [{value, text}]; marks: [{time, kind, text}],
   * the events and alarms.
   */
  show({title, curves, limits, marks, from, until}) {
    Object.assign(this, {curves, limits, marks, from, until});
    this.title.replaceChildren(...title);
    this.paint();
  }

  paint() {
    const {curves, from, until} = this;
    const range = extent(curves, this.limits);
    this.none.hidden = Boolean(range);
    this.canvas.hidden = this.over.hidden = !range;
    this.range = range;
    const span = `from ${civil(from)} to ${civil(until)}`;
    if (!range) {
      setText(this.none, `No values ${span.replace(/\.\d+/g, '')}.`);
      this.tip.hidden = true;
      return;
    }
    this.canvas.setAttribute('aria-label', `Chart of ${curves.map((one) => one.name).join(', ')} ${span}; the table has the figures`);
    const {clientWidth: width, clientHeight: height} = this.box;
    const scale = devicePixelRatio || 1;
    for (const canvas of [this.canvas, this.over]) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
      canvas.getContext('2d').setTransform(scale, 0, 0, scale, 0, 0);
    }
    const context = this.canvas.getContext('2d');
    this.font = `12px ${getComputedStyle(this.box).fontFamily}`;
    context.font = this.font;
    const bottom = height - axisHeight - curves.length * (stripHeight + 2) - 3;
    const states = curves.every(({point}) => point?.states) ? Object.assign({}, ...curves.map(({point}) => point.states)) : null;
    const ticks = states ? stateMarks(states, ...range) : valueMarks(...range, Math.max(2, Math.floor((bottom - top) / 34)));
    const left = Math.ceil(Math.max(36, ...ticks.map(([, text]) => context.measureText(text).width)) + 12);
    this.area = {left, right: width - right, top, bottom, width: width - right - left, height: bottom - top};
    this.grid(context, ticks);
    context.save();
    context.beginPath();
    context.rect(left, 0, this.area.width, bottom + 1);
    context.clip();
    for (const curve of curves) this.draw(context, curve);
    context.restore();
    this.limitTexts(context);
    this.strips(context);
    this.flags(context);
    this.paintCursor();
  }

  x(time) {
    return this.area.left + (time - this.from) / (this.until - this.from) * this.area.width;
  }

  y(value) {
    const [low, high] = this.range;
    return this.area.bottom - (value - low) / (high - low) * this.area.height;
  }

  grid(context, ticks) {
    const {left, right: end, bottom, width} = this.area;
    context.strokeStyle = colour('--grid');
    context.fillStyle = colour('--soft');
    context.lineWidth = 1;
    context.textBaseline = 'middle';
    context.textAlign = 'right';
    context.beginPath();
    for (const [value, text] of ticks) {
      const y = Math.round(this.y(value)) + 0.5;
      context.moveTo(left, y);
      context.lineTo(end, y);
      context.fillText(text, left - 6, y);
    }
    context.textAlign = 'center';
    context.textBaseline = 'top';
    const times = timeMarks(this.from, this.until, (this.until - this.from) * 78 / width);
    for (const [time, text] of times) {
      const x = Math.round(this.x(time)) + 0.5;
      context.moveTo(x, top);
      context.lineTo(x, bottom);
      const half = context.measureText(text).width / 2;
      context.fillText(text, Math.min(Math.max(x, left + half - 8), end + right - half), bottom + 5);
    }
    context.stroke();
    context.textAlign = 'left';
    context.textBaseline = 'bottom';
    for (const {value, text} of this.limits) {
      if (value < this.range[0] || value > this.range[1]) continue;
      const y = Math.round(this.y(value)) + 0.5;
      context.strokeStyle = context.fillStyle = colour('--warn');
      context.setLineDash([6, 4]);
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(end, y);
      context.stroke();
      context.setLineDash([]);
    }
  }

  /** The texts of the limits, over the curves, with a ground that keeps them readable. */
  limitTexts(context) {
    context.textAlign = 'left';
    context.textBaseline = 'bottom';
    for (const {value, text} of this.limits) {
      const y = this.y(value);
      if (y < this.area.top || y > this.area.bottom) continue;
      const x = this.area.left + 4;
      context.fillStyle = colour('--panel');
      context.globalAlpha = 0.75;
      context.fillRect(x - 2, y - 15, context.measureText(text).width + 4, 14);
      context.globalAlpha = 1;
      context.fillStyle = colour('--soft');
      context.fillText(text, x, y - 1);
    }
  }

  draw(context, {number, series}) {
    const ink = colour(`--series-${number}`);
    for (const run of runs(series)) {
      context.fillStyle = ink;
      context.globalAlpha = 0.18;
      context.beginPath();
      for (const [t, , , max] of run) context.lineTo(this.x(t), this.y(max));
      for (let i = run.length - 1; i >= 0; --i) context.lineTo(this.x(run[i][0]), this.y(run[i][1]));
      context.fill();
      context.globalAlpha = 1;
      context.strokeStyle = ink;
      context.lineWidth = 1.6;
      context.setLineDash(dashes[number]);
      context.beginPath();
      for (const [t, , mean] of run) context.lineTo(this.x(t), this.y(mean));
      if (run.length === 1) context.arc(this.x(run[0][0]), this.y(run[0][2]), 2, 0, 7);
      context.stroke();
      context.setLineDash([]);
    }
  }

  strips(context) {
    const {left, right: end, bottom} = this.area;
    this.curves.forEach(({number, series}, i) => {
      const y = bottom + axisHeight + i * (stripHeight + 2);
      context.fillStyle = colour('--grid');
      context.fillRect(left, y + 2, end - left, 1);
      context.fillStyle = colour(`--series-${number}`);
      context.fillRect(left - 10, y, 8, stripHeight);
      context.fillStyle = colour('--warn');
      for (const [begin, stop] of doubtful(series, this.until)) {
        const x = Math.max(left, this.x(begin));
        context.fillRect(x, y, Math.max(2, Math.min(end, this.x(stop)) - x), stripHeight);
      }
    });
  }

  /** Events are short grey ticks above the curves, alarms are triangles. */
  flags(context) {
    const {left, right: end, bottom} = this.area;
    for (const {time, kind} of this.marks) {
      const x = this.x(time);
      if (x < left || x > end) continue;
      context.fillStyle = context.strokeStyle = colour(kind === 'event' ? '--calm' : `--${kind}`);
      context.beginPath();
      if (kind === 'event') {
        context.fillRect(x - 1, 3, 2, top - 5);
        continue;
      }
      context.moveTo(x - 5, 2);
      context.lineTo(x + 5, 2);
      context.lineTo(x, 11);
      context.fill();
      context.setLineDash([1, 3]);
      context.beginPath();
      context.moveTo(x, top);
      context.lineTo(x, bottom);
      context.stroke();
      context.setLineDash([]);
    }
  }

  timeAt(event) {
    const {left, width} = this.area;
    const x = Math.min(1, Math.max(0, (event.offsetX - left) / width));
    return this.from + x * (this.until - this.from);
  }

  begin(event) {
    if (event.button !== 0 || event.pointerType === 'touch') return this.pointed(this.timeAt(event));
    this.over.setPointerCapture(event.pointerId);
    this.drag = {x: event.offsetX, from: this.timeAt(event)};
  }

  move(event) {
    if (!this.range) return;
    this.height = event.offsetY;
    this.mine = true;
    this.pointed(this.timeAt(event));
  }

  release(event) {
    const {drag} = this;
    this.drag = null;
    if (!drag || Math.abs(event.offsetX - drag.x) < shortestDrag) return;
    const ends = [drag.from, this.timeAt(event)].sort((a, b) => a - b);
    this.zoomed(...ends);
  }

  /** The arrow keys move the cursor by a hundredth of the chart. */
  key(event) {
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (!step || !this.range) return;
    event.preventDefault();
    this.mine = true;
    const length = this.until - this.from;
    this.pointed(Math.min(this.until, Math.max(this.from, (this.cursor ?? this.until) + step * length / 100)));
  }

  leave() {
    this.drag = null;
    this.mine = false;
    this.pointed(null);
  }

  /** Shows the time at which the pointer is on this or another chart. */
  point(time) {
    this.cursor = time;
    if (this.range) this.paintCursor();
  }

  paintCursor() {
    const context = this.over.getContext('2d');
    context.clearRect(0, 0, this.over.width, this.over.height);
    const {cursor, area} = this;
    this.tip.hidden = cursor === null || !this.mine;
    if (cursor === null) return;
    const x = Math.round(this.x(cursor)) + 0.5;
    if (this.drag) {
      const begin = this.x(this.drag.from);
      context.fillStyle = colour('--calm');
      context.globalAlpha = 0.3;
      context.fillRect(Math.min(begin, x), area.top, Math.abs(x - begin), area.height);
      context.globalAlpha = 1;
    }
    context.strokeStyle = colour('--soft');
    context.beginPath();
    context.moveTo(x, area.top);
    context.lineTo(x, area.bottom);
    context.stroke();
    const found = this.curves.map((curve) => ({...curve, row: rowAt(curve.series, cursor)}));
    for (const {number, row} of found) {
      if (!row) continue;
      context.fillStyle = colour(`--series-${number}`);
      context.beginPath();
      context.arc(x, this.y(row[2]), 3.5, 0, 7);
      context.fill();
    }
    if (!this.tip.hidden) this.paintTip(found, x);
  }

  paintTip(found, x) {
    const near = (this.until - this.from) / this.area.width * 6;
    const marks = this.marks.filter((mark) => Math.abs(mark.time - this.cursor) < near).slice(0, this.box.clientWidth < 500 ? 1 : 4);
    this.tip.replaceChildren(h('strong', {}, civil(Math.round(this.cursor)).replace(/\.\d+$/, '')),
        ...found.map(({number, name, series, row, point}) => h('div', {}, h('i', {class: `ink-${number}`}), `${name}: `,
            h('b', {}, row ? `${spread(point, row)} ${series.unit}` : 'no value'),
            row && row[4] < 0.995 ? ', not always good' : '')),
        ...marks.map((mark) => h('div', {class: `flag ${mark.kind}`}, mark.text)));
    this.tip.style.left = '0';
    const {offsetWidth: width, offsetHeight: height} = this.tip;
    const room = this.box.clientWidth;
    const at = x + 14 + width < room ? x + 14 : x - 14 - width;
    this.tip.style.left = `${Math.min(Math.max(0, at), Math.max(0, room - width))}px`;
    this.tip.style.top = `${Math.max(0, Math.min((this.height ?? 20) - height / 2, this.box.clientHeight - height))}px`;
  }

  end() {
    removeEventListener('theme', this.repaint);
    this.resized.disconnect();
    this.element.remove();
  }
}

/** The rows of a series in pieces without a gap. A gap begins if the next row comes more than one step later. */
function runs({rows, step_ms: step}) {
  const all = [];
  let last = null;
  for (const row of rows) {
    if (row[2] === null) {
      last = null;
      continue;
    }
    if (last === null || row[0] - last > 1.5 * step) all.push([]);
    all.at(-1).push(row);
    last = row[0];
  }
  return all;
}
