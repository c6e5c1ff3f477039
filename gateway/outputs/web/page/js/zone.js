// SPDX-License-Identifier: Apache-2.0
// The zone of all times on the page: that of the browser, or UTC by the user's choice.
import {emit} from './bus.js';
import {recall, remember} from './memory.js';

let utc = recall('utc', false) === true;

export const isUtc = () => utc;

export function setUtc(on) {
  utc = on;
  remember('utc', on);
  emit('zone');
}

/** The difference between the shown time and UTC at a moment, both in milliseconds. */
export const offset = (ms) => (utc ? 0 : -new Date(ms).getTimezoneOffset() * 60e3);

/** The zone as headers name it, for example "UTC" or "CET". */
export function zoneName() {
  if (utc) return 'UTC';
  const parts = new Intl.DateTimeFormat('en', {timeZoneName: 'short'}).formatToParts(Date.now());
  return parts.find((part) => part.type === 'timeZoneName')?.value || 'local time';
}

/** The shown date and time as text: "2026-11-27T01:12:09.908". */
export const shownTime = (ms) => new Date(ms + offset(ms)).toISOString().slice(0, -1);

/** The moment of a shown date and time; NaN if the text is no time. */
export function momentOf(text) {
  const asUtc = Date.parse(`${text}Z`);
  return utc ? asUtc : Date.parse(text);
}

/** The begin of the shown day or month that contains a moment, moved by `days` and `months`. */
export function calendar(ms, {days = 0, months = 0, month = false}) {
  const at = new Date(ms + offset(ms));
  const moved = Date.UTC(at.getUTCFullYear(), at.getUTCMonth() + months, month ? 1 : at.getUTCDate() + days);
  return moved - offset(moved - offset(moved));
}
