#!/usr/bin/env bash
# Tests the Sparkplug B of a gateway with the decoder of the npm package sparkplug-payload: births, data by alias, stored values
# and deaths, with a real mosquitto.
# usage: packaging/sparkplug_test.sh [--module FOLDER]    FOLDER/node_modules has sparkplug-payload; without it npm fetches it
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/prepare.sh

install_packages mosquitto mosquitto-clients nodejs
build_product baudgate
work=$(mktemp -d)
started=()
end() {
  [ ${#started[@]} = 0 ] || kill "${started[@]}" 2>/dev/null || true
  wait
  rm -rf "$work"
}
trap end EXIT
modules=$work
if [ "${1:-}" = --module ]; then
  modules=$2
else
  npm install --silent --no-audit --no-fund --prefix "$work" sparkplug-payload@1.0.3 >/dev/null
fi

port=$(python3 -c 'import socket; s = socket.create_server(("127.0.0.1", 0)); print(s.getsockname()[1])')
cat >"$work/mosquitto.conf" <<END
listener $port 127.0.0.1
allow_anonymous true
END
cat >"$work/gateway.yaml" <<END
gateway: { name: gate, state: $work/state, socket: $work/control }
modbus: { enabled: false }
dds: { enabled: false }
history: { points: [ '*.*.current_*' ] }
mqtt: { broker: "mqtt://127.0.0.1:$port", payload: sparkplug, prefix: plant }
lines:
  - name: bay
    port: $work/bay
    protocol: spabus
    devices:
      - { name: feeder, address: 1, profile: spaj140c, poll: 200ms }
END
PATH=$PATH:/usr/sbin mosquitto -c "$work/mosquitto.conf" 2>"$work/broker" & started+=($!)
build/release/baudgate simulate --profile spaj140c --address 1 --pty "$work/bay" >"$work/twin" & started+=($!)
until [ -e "$work/bay" ] && grep -q running "$work/broker"; do sleep 0.1; done
mosquitto_sub -p "$port" -t 'spBv1.0/#' -F '%t %x' >"$work/heard" & started+=($!)
sleep 1
build/release/baudgate run -c "$work/gateway.yaml" 2>"$work/log" & gateway=$!
sleep 8
kill "$gateway"
wait "$gateway"
sleep 1

say "decoding $(wc -l <"$work/heard") messages with sparkplug-payload"
NODE_PATH=$modules/node_modules node - "$work/heard" <<'END'
const assert = require('assert');
const lines = require('fs').readFileSync(process.argv[2], 'utf8').trim().split('\n');
const decode = require('sparkplug-payload').get('spBv1.0').decodePayload;
const all = lines.map((line) => {
  const [topic, hex] = line.split(' ');
  return { type: topic.split('/')[2], topic, ...decode(Buffer.from(hex, 'hex')) };
});
const of = (type) => all.filter((one) => one.type === type);
assert.strictEqual(all[0].type, 'NBIRTH');
assert.strictEqual(all[0].topic, 'spBv1.0/plant/NBIRTH/gate');
const names = new Map();
for (const birth of of('DBIRTH')) {
  assert.strictEqual(birth.topic, 'spBv1.0/plant/DBIRTH/gate/feeder');
  for (const metric of birth.metrics) names.set(Number(metric.alias), metric.name);
}
let seq = 0;
for (const one of all.filter((message) => message.type !== 'NDEATH')) {
  assert.strictEqual(Number(one.seq), seq, one.topic);
  seq = (seq + 1) % 256;
}
let stored = 0;
const last = new Map();
for (const data of of('DDATA')) {
  for (const metric of data.metrics) {
    const alias = Number(metric.alias);
    assert.ok(names.has(alias), 'an alias of a birth');
    assert.ok([0, 192, 500].includes(metric.properties.Quality.value));
    if (!metric.isHistorical) continue;
    ++stored;
    assert.ok(Number(metric.timestamp) > (last.get(alias) ?? 0), 'stored values are in order');
    last.set(alias, Number(metric.timestamp));
  }
}
assert.ok(stored > 0, 'stored values');
assert.strictEqual(of('NDEATH').length, 1);
const bdSeq = (message) => Number(message.metrics.find((metric) => metric.name === 'bdSeq').value);
assert.strictEqual(bdSeq(of('NDEATH')[0]), bdSeq(all[0]));
console.log(`births ${of('DBIRTH').length}, data ${of('DDATA').length}, stored values ${stored}: as the specification says`);
END
