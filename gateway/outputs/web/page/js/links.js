// SPDX-License-Identifier: Apache-2.0
// The addresses of views: #/NAME, #/NAME/THING, with parameters behind a question mark.

const made = (path, parameters = {}) => {
  const given = Object.entries(parameters).filter(([, value]) => value);
  return `#/${path}${given.length ? `?${new URLSearchParams(given)}` : ''}`;
};

export const lineLink = (line) => made(`line/${encodeURIComponent(line)}`);
/** With a point, its row is shown. */
export const deviceLink = ({line, device}, point) => made(`device/${encodeURIComponent(`${line}.${device}`)}`, {point});
export const trendsLink = (parameters) => made('trends', parameters);
export const alarmsLink = (parameters) => made('alarms', parameters);
export const pointsLink = (q) => made('points', {q});

/** Where an event or an alarm comes from; that of the gateway itself is on the view of the system. */
export function sourceLink({line, device}) {
  if (device) return deviceLink({line, device});
  return line ? lineLink(line) : made('system');
}

/** {view, thing, parameters} of the address in force. */
export function parse(hash) {
  const [path, query = ''] = hash.replace(/^#\/?/, '').split('?');
  const [view, ...rest] = path.split('/');
  let thing = rest.join('/');
  try {
    thing = decodeURIComponent(thing);
  } catch {
    // A broken address names nothing that exists, and the gateway says so.
  }
  return {view: view || 'overview', thing, parameters: Object.fromEntries(new URLSearchParams(query))};
}

/** Writes the address without a step in the browser's history. */
export const replace = (hash) => history.replaceState(null, '', hash);
