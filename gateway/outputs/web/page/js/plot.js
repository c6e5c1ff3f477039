// SPDX-License-Identifier: Apache-2.0
// One chart of the points of one unit over time: means as lines, minima to maxima as bands (dygraphs).
import {h} from './dom.js';
import {civil, valueText} from './format.js';
import {doubtful, onOneGrid} from './series.js';

export const dashes = [null, [8, 3], [2, 2], [9, 3, 2, 3], [14, 4], [4, 4], [2, 5], [12, 3, 2, 3, 2, 3]];

let loading = null;

/** Loads the chart library when the first chart is needed. */
export function loadCharts() {
  loading ||= new Promise((resolve, reject) => {
    document.head.append(h('link', {rel: 'stylesheet', href: 'chart.css'}));
    document.head.append(h('script', {src: 'chart.js', onload: () => {
      // The library's legend writes HTML with styles, which the page's security policy forbids.
      Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
      resolve();
    }, onerror: () => {
      loading = null;
      reject(new Error('The chart library cannot be loaded: reload the page.'));
    }}));
  });
  return loading;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Draws the band from minima to maxima: one polygon for each sequence of rows without a hole. */
function band(e) {
  const {drawingContext: context, plotArea: area, points} = e;
  context.save();
  context.globalAlpha = 0.18;
  context.fillStyle = e.color;
  for (let begin = 0; begin < points.length;) {
    while (begin < points.length && points[begin].yval === null) ++begin;
    let end = begin;
    while (end < points.length && points[end].yval !== null && !Number.isNaN(points[end].yval)) ++end;
    if (end - begin > 1) {
      context.beginPath();
      for (let i = begin; i < end; ++i) context.lineTo(points[i].canvasx, area.y + area.h * points[i].y_top);
      for (let i = end - 1; i >= begin; --i) context.lineTo(points[i].canvasx, area.y + area.h * points[i].y_bottom);
      context.closePath();
      context.fill();
    }
    begin = Math.max(end, begin + 1);
  }
  context.restore();
}

export class Plot {
  /**
   * zoomed(since, until) is called after a zoom, with null for the whole span; pointed(time or null) when the pointer moves.
   */
  constructor(zoomed, pointed) {
    this.zoomed = zoomed;
    this.pointed = pointed;
    this.box = h('div', {class: 'plot'});
    this.title = h('h2');
    this.element = h('figure', {class: 'plot-figure'}, this.title, this.box);
    this.themed = () => this.graph?.updateOptions(this.colours());
    addEventListener('theme', this.themed);
    this.resized = new ResizeObserver(() => this.graph?.resize());
    this.resized.observe(this.box);
  }

  colours() {
    return {
      colors: this.numbers.map((n) => colour(`--series-${n}`)),
      gridLineColor: colour('--grid'),
      axisLineColor: colour('--edge'),
      highlightCircleSize: 3,
    };
  }

  /** list: [{number, series}]; number selects colour and dash. */
  show(unit, list, since, until) {
    this.numbers = list.map((one) => one.number);
    this.spans = doubtful(list.map((one) => one.series), until);
    this.title.textContent = unit || 'without a unit';
    this.box.setAttribute('role', 'img');
    this.box.setAttribute('aria-label',
        `Chart of ${list.map((one) => one.series.point).join(', ')} from ${civil(since)} to ${civil(until)}; the table below has the figures`);
    const file = onOneGrid(list.map((one) => one.series));
    const labels = ['time', ...list.map((one) => one.series.point)];
    if (!file.length) file.push([since, ...list.map(() => [null, null, null])]);
    const series = Object.fromEntries(list.map((one) => [one.series.point, {strokePattern: dashes[one.number]}]));
    const options = {file, labels, series, dateWindow: [since, until], ...this.colours()};
    if (this.graph) {
      this.graph.updateOptions(options);
      return;
    }
    this.graph = new Dygraph(this.box, file, {
      ...options,
      customBars: true,
      plotter: [band, Dygraph.Plotters.linePlotter],
      drawGapEdgePoints: true,
      labelsUTC: true,
      legend: 'never',
      strokeWidth: 1.5,
      includeZero: false,
      rightGap: 24,
      axes: {
        x: {
          axisLabelWidth: 80,
          axisLabelFontSize: 12,
          ticker: Dygraph.dateTicker,
          axisLabelFormatter: Dygraph.dateAxisLabelFormatter,
        },
        y: {axisLabelWidth: 56, axisLabelFontSize: 12, axisLabelFormatter: (y) => valueText(Number(y.toPrecision(6)))},
      },
      underlayCallback: (context, area, graph) => this.shade(context, area, graph),
      interactionModel: this.gestures(),
      zoomCallback: (from, to) => this.zoomed(from, to),
      highlightCallback: (event, x) => this.pointed(x),
      unhighlightCallback: () => this.pointed(null),
    });
  }

  /** A drag zooms, a double click shows the whole span; a finger scrolls the page, and the buttons above zoom. */
  gestures() {
    const {touchstart, touchmove, touchend, ...mouse} = Dygraph.defaultInteractionModel;
    return {...mouse, dblclick: () => this.zoomed(null, null)};
  }

  /** Hatches the times in which not every value was good, so that the mark does not depend on a colour. */
  shade(context, area, graph) {
    context.save();
    context.beginPath();
    context.rect(area.x, area.y, area.w, area.h);
    context.clip();
    context.strokeStyle = colour('--hatch');
    context.lineWidth = 1;
    context.beginPath();
    for (const [from, until] of this.spans) {
      const left = Math.max(area.x, graph.toDomXCoord(from));
      const right = Math.min(area.x + area.w, Math.max(left + 2, graph.toDomXCoord(until)));
      for (let x = left - (left % 6); x < right; x += 6) {
        context.moveTo(x, area.y);
        context.lineTo(x, area.y + area.h);
      }
    }
    context.stroke();
    context.restore();
  }

  end() {
    removeEventListener('theme', this.themed);
    this.resized.disconnect();
    this.graph?.destroy();
    this.element.remove();
  }
}
