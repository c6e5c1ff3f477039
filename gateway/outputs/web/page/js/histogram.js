// SPDX-License-Identifier: Apache-2.0
// The chart of round trips: each row covers twice the time of the row before, as in `baudgate status`.
import {barred} from './columns.js';
import {DataTable} from './data_table.js';
import {count, micros} from './format.js';

function octaves(buckets) {
  const rows = new Map();
  for (const bucket of buckets) {
    const octave = bucket.up_to_us ? Math.ceil(Math.log2(bucket.up_to_us) - 1e-6) : 99;
    rows.set(octave, (rows.get(octave) || 0) + bucket.count);
  }
  const most = Math.max(...rows.values());
  return [...rows].sort(([a], [b]) => a - b).map(([octave, n]) =>
    ({upTo: octave === 99 ? 'longer' : `up to ${micros(2 ** octave)}`, n, share: n / most}));
}

export function histogram() {
  const table = new DataTable({
    columns: [
      {title: 'Time', class: 'num', text: (row) => row.upTo},
      barred('Exchanges', (row) => [row.share, count(row.n)]),
    ],
    key: (row) => row.upTo, caption: 'Round trips', empty: 'No reply yet.',
  });
  table.element.classList.add('histogram');
  return {element: table.element, paint: (trips) => table.paint(octaves(trips.histogram))};
}
