// SPDX-License-Identifier: Apache-2.0
// The addresses of views: #/NAME, #/NAME/THING, with parameters behind a question mark.

const made = (path, parameters = {}) => {
  const given = Object.entries(parameters).filter(([, value]) => value);
  return `#/${path}${given.length ? `?${new URLSearchParams(given)}` : ''}`;
};

export const lineLink = (line) => made(`line/${encodeURIComponent(line)}`);
/** If `point` is given, the view scrolls to its row. */
export const deviceLink = ({line, device}, point) => made(`device/${encodeURIComponent(`${line}.${device}`)}`, {point});
export const trendsLink = (parameters) => made('trends', parameters);
export const alarmsLink = (parameters) => made('alarms', parameters);
export const writesLink = (parameters) => made('writes', parameters);
export const pointsLink = (parameters) => made('points', parameters);

/** The part of the system view that an alarm of the gateway itself names. */
const parts = {'server away': 'routes', 'no answer to clients': 'routes', 'events are not kept': 'records',
  'values are not kept': 'records', 'writes are not recorded': 'records', 'certificate ends': 'configuration',
  'receiver away': 'records', 'values refused': 'records'};

/** The view of an event's or alarm's source; events of the gateway itself lead to the system view. */
export function sourceLink({line, device, point, name}) {
  if (parts[name]) return made('system', {at: parts[name]});
  if (line && device) return deviceLink({line, device}, point);
  if (line) return lineLink(line);
  return made('system', {at: device ? 'routes' : ''});
}

/** Returns {view, thing, parameters} of an address. */
export function parse(hash) {
  const [path, query = ''] = hash.replace(/^#\/?/, '').split('?');
  const [view, ...rest] = path.split('/');
  let thing = rest.join('/');
  try {
    thing = decodeURIComponent(thing);
  } catch {
    // A broken address names nothing that exists; the gateway's answer reports that.
  }
  return {view, thing, parameters: Object.fromEntries(new URLSearchParams(query))};
}

/** Changes the address with a step in the browser's history, without a new view. */
export const push = (hash) => location.hash === hash || history.pushState(null, '', hash);

/** Changes the address without a step in the browser's history. */
export const replace = (hash) => history.replaceState(null, '', hash);
