// SPDX-License-Identifier: Apache-2.0
// Sends requests to the gateway. The message of an error is the gateway's own sentence. Paths are relative to the page,
// because a proxy may show the page below a path of its own.
import {emit} from './bus.js';

export class ApiError extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

async function request(path, options) {
  let response;
  try {
    response = await fetch(path, {cache: 'no-store', ...options});
  } catch {
    throw new ApiError(0, 'The gateway does not answer.');
  }
  if (response.status === 204) return null;
  const body = await response.json().catch(() => null);
  if (response.ok && body) return body;
  if (response.ok) throw new ApiError(0, 'The gateway does not answer.');
  if (response.status === 401 && path !== 'login') emit('login');
  throw new ApiError(response.status, body?.detail || body?.text || body?.title || `The gateway answered ${response.status}.`);
}

/**
 * Example: get('status', {target: 'bay-1'}). Parameters without a value are left out. `patience` is the timeout in
 * milliseconds; 0: no timeout.
 */
export function get(name, parameters = {}, patience = 0) {
  return request(address(name, parameters), patience ? {signal: AbortSignal.timeout?.(patience)} : {});
}

export function address(name, parameters = {}) {
  const given = Object.entries(parameters).filter(([, value]) => value !== undefined && value !== '');
  const query = new URLSearchParams(given).toString();
  return `api/v1/${name}${query ? `?${query}` : ''}`;
}

export function post(path, body = {}) {
  return request(path, {
    method: 'POST',
    headers: {'Content-Type': 'application/json'},
    body: JSON.stringify(body),
  });
}
