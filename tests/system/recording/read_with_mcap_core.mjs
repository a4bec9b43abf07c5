// Reads a recording with Foxglove's own libraries, by its index and front to back, and checks
// what record_sample put in: node read_with_mcap_core.mjs FILE
import { readFileSync } from "node:fs";
import assert from "node:assert/strict";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const bytes = readFileSync(process.argv[2]);
const rounds = 50;
const types = [
  "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo",
  "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry",
  "tf2_msgs/msg/TFMessage", "std_msgs/msg/String",
  "vergence_msgs/msg/Frame", "vergence_msgs/msg/InsReading", "vergence_msgs/msg/Pulse",
];

const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) =>
    new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(size)),
};
const reader = await McapIndexedReader.Initialize({ readable });
assert.equal(reader.header.profile, "ros2");
assert.equal(Number(reader.statistics.messageCount), rounds * types.length);
assert.equal(reader.chunkIndexes.length, reader.statistics.chunkCount);
assert.ok(reader.chunkIndexes.length > 1);
assert.equal(reader.summaryOffsetsByOpcode.size, 4);

const decoders = new Map();
for (const schema of reader.schemasById.values()) {
  assert.equal(schema.encoding, "ros2msg");
  decoders.set(schema.id,
    new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
}
const last = new Map();
let count = 0;
let time = 0n;
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  assert.equal(channel.messageEncoding, "cdr");
  assert.ok(channel.metadata.has("offered_qos_profiles"));
  assert.ok(message.logTime >= time);
  time = message.logTime;
  last.set(reader.schemasById.get(channel.schemaId).name,
    decoders.get(channel.schemaId).readMessage(message.data));
  ++count;
}
assert.equal(count, rounds * types.length);
assert.deepEqual([...last.keys()].sort(), [...types].sort());

const image = last.get("sensor_msgs/msg/Image");
assert.deepEqual([image.width, image.height, image.step, image.encoding], [4, 3, 4, "mono8"]);
assert.deepEqual([...image.data], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
assert.equal(BigInt(image.header.stamp.sec) * 1000000000n + BigInt(image.header.stamp.nanosec),
  1336964645250000000n + 49n * 33333333n);
const info = last.get("sensor_msgs/msg/CameraInfo");
assert.equal(info.distortion_model, "plumb_bob");
assert.ok(Math.abs(info.p[3] + 450.5 * 0.75) < 1e-9);
const fix = last.get("sensor_msgs/msg/NavSatFix");
assert.deepEqual([fix.latitude, fix.longitude, fix.altitude, fix.position_covariance[0]],
  [-27.476543, 153.028765, 52.25, 4]);
assert.deepEqual(last.get("nav_msgs/msg/Odometry").pose.pose.position, { x: 1, y: 2, z: 3 });
const covariance = last.get("nav_msgs/msg/Odometry").pose.covariance;
assert.deepEqual([covariance[0], covariance[1], covariance[6], covariance[35]], [0.25, 0.125, 0.125, 0.5]);
assert.equal(last.get("tf2_msgs/msg/TFMessage").transforms[0].transform.translation.x, 0.75);
assert.equal(last.get("vergence_msgs/msg/InsReading").number, 7n);

// Cut anywhere: whole messages, in order, never a fault.
for (let cut = 0; cut <= 200; ++cut) {
  const size = Math.floor((bytes.length * cut) / 200);
  const stream = new McapStreamReader({ validateCrcs: true });
  stream.append(new Uint8Array(bytes.buffer, bytes.byteOffset, size));
  let messages = 0;
  for (let record; (record = stream.nextRecord()) !== undefined;)
    if (record.type === "Message") ++messages;
  if (cut === 200) assert.equal(messages, rounds * types.length);
}
console.log(`${count} messages of ${types.length} types read by index and front to back`);
