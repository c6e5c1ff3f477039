// SPDX-License-Identifier: Apache-2.0
import {on} from './bus.js';
import {count} from './format.js';
import {h, setText} from './dom.js';
import {Headline, Problem} from './parts.js';
import {PointTable} from './point_table.js';
import {allPoints, matching} from './store.js';

export function points(root, _, parameters) {
  const headline = new Headline('Points');
  const problem = new Problem();
  const found = h('p', {class: 'about', role: 'status'}, 'Fetching the points …');
  const table = new PointTable({full: true, label: 'Points'});
  let text = parameters.q || '';
  let all = null;
  const paint = () => {
    if (!all) return;
    const list = matching(all, text);
    setText(found, text ? `${count(list.length)} of ${count(all.length)} points have “${text}”`
      : `${count(all.length)} points; the search box above finds them by name and description`);
    table.paint(list);
  };
  const fetchAll = () => allPoints().then((list) => {
    all = list;
    problem.paint(null);
    paint();
  }, (error) => problem.paint(error));
  root.append(headline.element, problem.element, found, table.element);
  fetchAll();
  const ends = [on('points', fetchAll), on('search', (query) => {
    text = query;
    paint();
  }), () => table.end()];
  return () => ends.forEach((end) => end());
}
