// An MCAP file by the format's own writer, with its index:  write_mcap.cjs OUT CONTENT…
// Each CONTENT is a file; its bytes are a message of the topic /left/image_raw, log time its number.
const fs = require("fs");
const { McapWriter } = require("@mcap/core");

class File {
  constructor(path) {
    this.fd = fs.openSync(path, "w");
    this.written = 0n;
  }
  position() {
    return this.written;
  }
  async write(bytes) {
    fs.writeSync(this.fd, bytes);
    this.written += BigInt(bytes.byteLength);
  }
}

async function main() {
  const [out, ...contents] = process.argv.slice(2);
  const writer = new McapWriter({ writable: new File(out), chunkSize: 600 });
  await writer.start({ profile: "ros2", library: "test" });
  const schemaId = await writer.registerSchema({
    name: "sensor_msgs/msg/Image",
    encoding: "ros2msg",
    data: Buffer.from("uint8[] data"),
  });
  const channelId = await writer.registerChannel({
    topic: "/left/image_raw",
    messageEncoding: "cdr",
    schemaId,
    metadata: new Map(),
  });
  for (const [sequence, file] of contents.entries()) {
    const time = BigInt(sequence);
    await writer.addMessage({ channelId, sequence, logTime: time, publishTime: time, data: fs.readFileSync(file) });
  }
  await writer.end();
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
