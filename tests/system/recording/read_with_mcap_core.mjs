// Reads recorded drives with Foxglove's own libraries, by their index and front to back, and checks
// them against the other files of their sessions; what these libraries write of a drive is replayed:
// node read_with_mcap_core.mjs VERGENCE SESSION…
import { closeSync, openSync, readFileSync, writeSync } from "node:fs";
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { McapIndexedReader, McapStreamReader, McapWriter } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return ~crc >>> 0;
}

function csv(file) {
  const [head, ...lines] = readFileSync(file, "utf8").trim().split("\n").map((line) => line.split(","));
  return lines.map((line) => Object.fromEntries(head.map((key, i) => [key, line[i]])));
}
const near = (a, b, most) => assert.ok(Math.abs(a - b) <= most, `${a} is not ${b}`);

/// The file by the format's own writer.
async function write_copy(reader, path) {
  const file = openSync(path, "w");
  let written = 0n;
  const writable = {
    position: () => written,
    write: async (bytes) => { writeSync(file, bytes); written += BigInt(bytes.byteLength); },
  };
  const writer = new McapWriter({ writable, chunkSize: 200_000 });
  await writer.start(reader.header);
  const schemas = new Map(), channels = new Map();
  for (const schema of reader.schemasById.values())
    schemas.set(schema.id, await writer.registerSchema(schema));
  for (const channel of reader.channelsById.values())
    channels.set(channel.id,
      await writer.registerChannel({ ...channel, schemaId: schemas.get(channel.schemaId) }));
  for await (const message of reader.readMessages())
    await writer.addMessage({ ...message, channelId: channels.get(message.channelId) });
  await writer.end();
  closeSync(file);
}

async function check(vergence, session) {
  const bytes = readFileSync(`${session}/drive.mcap`);
  const poses = csv(`${session}/poses.csv`), readings = csv(`${session}/ins.csv`);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) =>
      new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  assert.equal(reader.header.profile, "ros2");
  assert.equal(reader.chunkIndexes.length, reader.statistics.chunkCount);
  assert.ok(reader.chunkIndexes.length > 1);
  assert.equal(reader.summaryOffsetsByOpcode.size, 4);

  const decoders = new Map();
  for (const schema of reader.schemasById.values()) {
    assert.equal(schema.encoding, "ros2msg");
    decoders.set(schema.id,
      new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
  }
  const last = new Map(), times = new Map();
  let count = 0, time = 0n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    assert.equal(channel.messageEncoding, "cdr");
    assert.ok(channel.metadata.has("offered_qos_profiles"));
    assert.ok(message.logTime >= time);
    time = message.logTime;
    last.set(channel.topic, decoders.get(channel.schemaId).readMessage(message.data));
    times.set(channel.topic, (times.get(channel.topic) ?? 0) + 1);
    ++count;
  }
  assert.equal(count, Number(reader.statistics.messageCount));
  const stamp = ({ sec, nanosec }) => BigInt(sec) * 1000000000n + BigInt(nanosec);

  const pose = poses.at(-1), odometry = last.get("/vergence/odometry");
  assert.equal(times.get("/vergence/odometry"), poses.length);
  assert.equal(stamp(odometry.header.stamp), BigInt(pose.stamp_ns));
  const moved = last.get("/tf").transforms[0].transform.translation;
  for (const axis of ["x", "y", "z"]) {
    near(odometry.pose.pose.position[axis], pose[axis], 1e-9);
    near(odometry.pose.pose.orientation[axis], pose[`q${axis}`], 1e-9);
    near(moved[axis], pose[axis], 1e-9);
  }
  const covariance = odometry.pose.covariance;
  for (let i = 0; i < 36; ++i) assert.equal(covariance[i], covariance[6 * (i % 6) + Math.floor(i / 6)]);

  const row = readings.at(-1), fix = last.get("/ins/fix");
  assert.equal(times.get("/vergence/ins_reading"), readings.length);
  assert.equal(last.get("/vergence/ins_reading").number, BigInt(row.number));
  near(fix.latitude, row.latitude_deg, 1e-9);
  near(fix.longitude, row.longitude_deg, 1e-9);
  near(fix.position_covariance[0], row.position_sigma_m ** 2, 1e-9);
  near(last.get("/ins/imu").orientation.z, row.qz, 1e-8);
  const pulse = last.get("/vergence/pulse");
  assert.equal(BigInt(times.get("/vergence/pulse")), pulse.number + 1n);
  assert.ok(JSON.parse(last.get("/vergence/session").data).calibration.includes("baseline: 0.75"));
  near(last.get("/tf_static").transforms[0].transform.translation.x, 0.75, 1e-12);
  const info = last.get("/right/camera_info");
  assert.equal(info.distortion_model, "plumb_bob");
  near(info.p[3], -0.75 * info.p[0], 1e-9);

  // Pixels by the check sums that their frame has of them.
  const frame = last.get("/vergence/frame");
  ["left", "right"].forEach((side, k) => {
    const raw = last.get(`/${side}/image_raw`);
    assert.equal(stamp(raw.header.stamp), frame.stamp_ns);
    assert.deepEqual([raw.width, raw.height, raw.step, raw.encoding], [320, 240, 320, "mono8"]);
    assert.equal(crc32(raw.data), frame.image_crc[k]);
  });

  // Cut anywhere: whole messages, in order, never a fault.
  for (let cut = 0; cut <= 20; ++cut) {
    const size = Math.floor((bytes.length * cut) / 20);
    const stream = new McapStreamReader({ validateCrcs: true });
    stream.append(new Uint8Array(bytes.buffer, bytes.byteOffset, size));
    let messages = 0;
    for (let record; (record = stream.nextRecord()) !== undefined;)
      if (record.type === "Message") ++messages;
    if (cut === 20) assert.equal(messages, count);
  }

  await write_copy(reader, `${session}/copy.mcap`);
  const replay = spawnSync(vergence,
    ["replay", `${session}/copy.mcap`, "--quiet", "--out", `${session}/again`], { encoding: "utf8" });
  assert.ok(replay.status < 2, replay.stderr);
  const frames = JSON.parse(readFileSync(`${session}/again/summary.json`)).frames.read;
  assert.equal(frames, times.get("/left/image_raw"));
  console.log(`${count} messages of ${times.size} topics read by index and front to back`);
}

const [vergence, ...sessions] = process.argv.slice(2);
for (const session of sessions) await check(vergence, session);
