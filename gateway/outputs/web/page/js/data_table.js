// SPDX-License-Identifier: Apache-2.0
// A table of some hundred rows that is updated every few seconds: rows keep their elements and their focus.
import {h, setText} from './dom.js';

/**
 * columns: {title, text(item)} writes a text; {title, make(cell), paint(made, item, cell)} makes and updates any content.
 * `class` is set on every cell of the column. On small screens each cell shows its title, and a `wide` cell has a line for
 * itself.
 */
export class DataTable {
  constructor({columns, key, caption, empty = 'None.', rowClass}) {
    Object.assign(this, {columns, key, rowClass});
    this.rows = new Map();
    this.body = h('tbody', {role: 'rowgroup'});
    const heads = columns.map((c) => h('th', {scope: 'col', role: 'columnheader', class: c.class}, c.title));
    this.table = h('table', {class: 'data', role: 'table'},
        h('caption', {class: 'hidden'}, caption),
        h('thead', {role: 'rowgroup'}, h('tr', {role: 'row'}, heads)), this.body);
    this.table.hidden = true;
    this.empty = h('p', {class: 'empty', hidden: true}, empty);
    this.element = h('div', {class: 'table-box'}, this.table, this.empty);
  }

  paint(items) {
    const seen = new Set();
    let place = this.body.firstChild;
    for (const item of items) {
      const key = String(this.key(item));
      if (seen.has(key)) continue;
      seen.add(key);
      let row = this.rows.get(key);
      if (!row) {
        row = this.make();
        this.rows.set(key, row);
      }
      for (const [i, column] of this.columns.entries()) {
        if (column.paint) column.paint(row.made[i], item, row.cells[i]);
        else setText(row.cells[i], String(column.text(item)));
      }
      if (this.rowClass) {
        const name = this.rowClass(item);
        if (row.element.className !== name) row.element.className = name;
      }
      if (row.element === place) place = place.nextSibling;
      else this.body.insertBefore(row.element, place);
    }
    for (const [key, row] of this.rows) {
      if (seen.has(key)) continue;
      row.element.remove();
      this.rows.delete(key);
    }
    this.table.hidden = !seen.size;
    this.empty.hidden = seen.size > 0;
  }

  make() {
    const cells = this.columns.map((c) => h('td', {role: 'cell', class: c.class, 'data-title': c.title}));
    const made = this.columns.map((c, i) => (c.make ? c.make(cells[i]) : null));
    return {element: h('tr', {role: 'row'}, cells), cells, made};
  }
}
